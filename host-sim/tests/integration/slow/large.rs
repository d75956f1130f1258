//! Machines and records of the size that a campaign found too slow: a shaft of 306 pieces, 200 disks, 2,000 days. Nothing here
//! looks at a clock; what once took minutes would be noticed.

use crate::program::{json, rotor_edge};
use rotor_edge::sample;
use serde_json::Value;
use tempfile::TempDir;

/// Pieces that each piece of the sample's shaft is cut into.
const CUTS: usize = 34;
const SPECKS: usize = 200;
const DAYS: usize = 2_000;

fn written(folder: &TempDir, name: &str, text: &str) -> String {
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

/// The sample's drawing with something changed in it.
fn drawing(change: impl FnOnce(&mut toml::Table)) -> String {
    let mut drawing: toml::Table = sample::ROTOR.parse().unwrap();
    change(&mut drawing);
    toml::to_string(&drawing).unwrap()
}

fn cut(drawing: &mut toml::Table) {
    let shaft = drawing["shaft"].as_array_mut().unwrap();
    let pieces = std::mem::take(shaft).into_iter().flat_map(|mut piece| {
        let length_m = piece["length_m"].as_float().unwrap() / CUTS as f64;
        piece["length_m"] = length_m.into();
        std::iter::repeat_n(piece, CUTS)
    });
    *shaft = pieces.collect();
}

/// Disks of a milligram each.
fn add_specks(drawing: &mut toml::Table) {
    let disks = drawing["disk"].as_array_mut().unwrap();
    for number in 0..SPECKS {
        let mut speck = disks[0].clone();
        speck["name"] = format!("speck {number}").into();
        speck["position_m"] = (0.05 + 0.9 * number as f64 / SPECKS as f64).into();
        for key in ["mass_kg", "diametral_inertia_kg_m2", "polar_inertia_kg_m2"] {
            speck[key] = 1e-6.into();
        }
        disks.push(speck);
    }
}

#[test]
fn shaft_of_306_sections_or_200_disks_compares_as_plain_one() {
    let folder = tempfile::tempdir().unwrap();
    let data = written(&folder, "runup.csv", sample::RUNUP_DAY_126);
    let compared = |name: &str, drawing: String| -> Value {
        json(&rotor_edge(&["compare", &written(&folder, name, &drawing), &data, "--json"]))
    };
    let plain = compared("plain.toml", drawing(|_| {}));
    let large = [compared("cut.toml", drawing(cut)), compared("specks.toml", drawing(add_specks))];
    for large in &large {
        for key in ["relative_error", "chi2_per_value", "residual_um"] {
            let [few, many] = [&plain, large].map(|answer| answer["by_run"][0][key].as_f64().unwrap());
            assert!((many / few - 1.0).abs() < 1e-3, "{key}: {many} instead of {few}");
        }
    }
}

#[test]
fn a_record_of_2_000_days_is_followed_and_its_forecast_scored() {
    let folder = tempfile::tempdir().unwrap();
    let mut rows = sample::RECORD.lines();
    let mut record = rows.next().unwrap().to_string() + "\n";
    // days before the ring was replaced, again and again, and never the same number twice: that would be a clipped probe
    let rows: Vec<&str> = rows.take(120).collect();
    for day in 0..DAYS {
        let mut cells = rows[day % rows.len()].split(',').skip(1);
        record += &format!("{day},{}", cells.next().unwrap());
        for cell in cells {
            record += &format!(",{}", cell.parse::<f64>().unwrap() * (1.0 + 1e-5 * day as f64));
        }
        record += "\n";
    }
    let track = folder.path().join("track.csv").display().to_string();
    let [rotor, record] = [("rotor.toml", sample::ROTOR), ("record.csv", &record)]
        .map(|(name, text)| written(&folder, name, text));
    let followed =
        json(&rotor_edge(&["track", &rotor, &record, "--method", "fixed", "--csv", &track, "--json"]));
    assert_eq!(followed["estimates"].as_array().unwrap().len(), DAYS);
    let forecast = json(&rotor_edge(&["forecast", &track, "--model", "naive", "--json"]));
    assert!(forecast["compared"]["U_g"]["60"].as_f64().unwrap() > 100.0, "{}", forecast["compared"]);
    assert!(forecast["forecast"][0]["U_g"]["value"].as_f64().unwrap() > 0.0);
}
