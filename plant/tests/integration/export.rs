//! `export`: a day is a file, whole or not at all, with the store's numbers to the bit. `forget`: what is old goes, and what
//! says where numbers go on stays.

use std::fs::File;
use std::path::Path;

use crate::common::{reading, refusal, result, run};
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::record::RowAccessor as _;
use rotor_edge::answers::monitor_result::ResultAnswer;
use rotor_edge_core::can::NumberedReading;
use rotor_edge_plant::item::{Body, Item, Kind, ReadingItem, SCHEMA, Source};
use rotor_edge_plant::sink::Sink as _;
use rotor_edge_plant::store::Store;

const DAY_US: i64 = 86_400_000_000;
/// 2026-03-01T00:00Z.
const BEGIN_US: i64 = 1_772_323_200_000_000;

fn item(node: u8, sequence: u16, time_us: i64, body: Body) -> Item {
    let source = Source { plant: "north".into(), bus: "hall \"1\"".into(), node };
    Item { schema: SCHEMA, source, epoch: 0, sequence, time_us, is_clock_doubtful: false, body }
}

fn told(node: u8, sequence: u16, time_us: i64) -> [Item; 2] {
    let mut read = ReadingItem::from(&NumberedReading::new(sequence, reading(node, sequence)));
    read.probes_um[1] = [None; 2];
    let evaluated = ResultAnswer::from(&result(node, sequence));
    [Body::Reading(read), Body::Result(evaluated)].map(|body| item(node, sequence, time_us, body))
}

fn exported(store: &Path, folder: &Path) -> String {
    let output = run(&["export", store.to_str().unwrap(), folder.to_str().unwrap()]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn daily_export_has_store_numbers_and_is_updated() {
    let folder = tempfile::tempdir().unwrap();
    let (path, days) = (folder.path().join("plant.db"), folder.path().join("days"));
    let mut store = Store::open(&path).unwrap();
    // the last µs of a day, and the first of the next but one
    let times = [BEGIN_US, BEGIN_US + DAY_US - 1, BEGIN_US + 2 * DAY_US];
    for node in [2, 1] {
        for (sequence, time_us) in times.iter().enumerate() {
            store.put(&told(node, sequence as u16, *time_us)).unwrap();
        }
    }
    assert_eq!(exported(&path, &days), "4 files written with 12 rows, 0 left as they were.\n");
    let mut names: Vec<_> = std::fs::read_dir(days.join("reading"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["2026-03-01.parquet", "2026-03-03.parquet"]);

    let file =
        SerializedFileReader::new(File::open(days.join("reading/2026-03-01.parquet")).unwrap()).unwrap();
    let rows: Vec<_> = file.get_row_iter(None).unwrap().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 4);
    for (row, (node, sequence)) in rows.iter().zip([(1, 0), (1, 1), (2, 0), (2, 1)]) {
        let sent = reading(node, sequence);
        let values: std::collections::HashMap<&str, String> =
            row.get_column_iter().map(|(name, field)| (name.as_str(), field.to_string())).collect();
        assert_eq!((values["plant"].as_str(), values["bus"].as_str()), ("\"north\"", "\"hall \"1\"\""));
        assert_eq!(values["node"], node.to_string());
        assert_eq!(values["p2_cos_um"], "null", "a lost probe");
        let column = row.get_column_iter().position(|(name, _)| name == "p4_cos_um").unwrap();
        assert_eq!(row.get_double(column).unwrap(), f64::from(sent.probes()[3].cos_um), "to the bit");
        let column = row.get_column_iter().position(|(name, _)| name == "time_us").unwrap();
        assert_eq!(row.get_timestamp_micros(column).unwrap(), times[usize::from(sequence)]);
    }

    assert_eq!(exported(&path, &days), "0 files written with 0 rows, 4 left as they were.\n");
    store.put(&told(1, 9, BEGIN_US + 5)).unwrap();
    assert_eq!(exported(&path, &days), "2 files written with 10 rows, 2 left as they were.\n");
    std::fs::write(days.join("result/2026-03-03.parquet"), "PAR1 and then no more").unwrap();
    assert_eq!(exported(&path, &days), "1 files written with 2 rows, 3 left as they were.\n");
    let said = refusal(&["export", path.to_str().unwrap(), path.to_str().unwrap()]);
    assert!(said.contains("cannot be created"), "{said}");
}

#[test]
fn items_older_than_a_day_go_and_last_of_each_stays() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plant.db");
    let mut store = Store::open(&path).unwrap();
    for (sequence, hour) in (0..48).enumerate() {
        store.put(&told(1, sequence as u16, BEGIN_US + hour * DAY_US / 24)).unwrap();
    }
    // it fell silent on the first day
    store.put(&told(2, 5, BEGIN_US)).unwrap();
    store.put(&told(2, 6, BEGIN_US + 1)).unwrap();
    let forget = |more: &[&str]| {
        let words = [&["forget", path.to_str().unwrap(), "--before", "2026-03-02"], more].concat();
        String::from_utf8(run(&words).stdout).unwrap()
    };
    assert!(forget(&["--only", "result"]).contains("25 of result"));
    assert_eq!(store.count(Kind::Reading).unwrap(), 50, "of one kind alone");
    let said = forget(&[]);
    assert!(said.contains("25 of reading") && said.contains(" 0 of result"), "{said}");
    let last = store.last("north", "hall \"1\"").unwrap();
    let mut numbers: Vec<_> = last.iter().map(|(node, _, last)| (*node, last.sequence)).collect();
    numbers.sort();
    assert_eq!(numbers, [(1, 47), (1, 47), (2, 6), (2, 6)]);
    assert_eq!(store.count(Kind::Reading).unwrap(), 25);
}
