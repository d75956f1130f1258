//! Dates of a replayed record that says when its day 0 was.

use rotor_edge::sample;

use crate::program::{assert_says, rotor_edge};

#[test]
fn replay_of_dated_record_tells_dates_in_text_and_page() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let dated = format!("# time_d counts from 2024-03-01T05:00:00Z\n{}", sample::RECORD);
    let (rotor, runup) = (file("rotor.toml", sample::ROTOR), file("runup.csv", sample::RUNUP_DAY_0));
    let replay = |record: &str| {
        let page = record.replace(".csv", ".html");
        let output = rotor_edge(&[
            "replay", "--rotor", &rotor, "--record", record, "--runup", &runup, "--report", &page,
        ]);
        (String::from_utf8(output.stdout).unwrap(), std::fs::read_to_string(&page).unwrap())
    };
    let (text, page_of_dates) = replay(&file("dated.csv", &dated));
    let day_125 = "The model stopped fitting on day 125, 2024-07-04 05:00 UTC: the residual rose";
    assert_says(&text, &[day_125, "Flag raised on day 127, 2024-07-06 05:00 UTC"]);
    assert_says(&page_of_dates, &[day_125, "time, days from 2024-03-01 05:00 UTC", "2024-03-01T05:00:00Z"]);
    let (text, page_of_days) = replay(&file("days.csv", sample::RECORD));
    assert_says(&text, &["The model stopped fitting on day 125: the residual rose"]);
    assert!(!page_of_days.contains("2024-03-01") && page_of_days.contains("time, days"));
}
