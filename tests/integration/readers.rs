//! Property tests of the file readers: no text makes them panic, every refusal is one sentence that
//! names the file, and what is written is read back.

use nalgebra::Complex;
use proptest::prelude::*;
use rotor_edge::sample;
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::{self, Reading};
use rotor_edge_desktop::rotor_file;

fn rotor() -> Rotor {
    rotor_file::parse("rotor.toml", sample::ROTOR).unwrap()
}

fn one_sentence(message: &str, file: &str) {
    assert!(message.starts_with(file), "names the file: {message}");
    assert!(!message.contains('\n'), "one line: {message}");
    assert!(message.len() > file.len() + 10, "says something: {message}");
}

fn component() -> impl Strategy<Value = f64> {
    (-500_000_000_i64..500_000_000).prop_map(|n| n as f64 * 1e-5)
}

fn reading() -> impl Strategy<Value = Reading> {
    let probe = proptest::option::weighted(0.9, (component(), component()));
    (1.0..60_000.0_f64, proptest::collection::vec(probe, 4)).prop_map(|(speed_rpm, probes)| Reading {
        speed_rpm,
        probes: probes.into_iter().map(|p| p.map(|(c, s)| measurement::phasor_m(c, s))).collect(),
        ..Reading::default()
    })
}

proptest! {
    #[test]
    fn any_text_is_read_or_refused_in_one_sentence(text in "\\PC{0,300}") {
        if let Err(e) = rotor_file::parse("r.toml", &text) {
            one_sentence(&e.to_string(), "r.toml");
        }
        if let Err(e) = measurement::parse("m.csv", &text, &rotor()) {
            one_sentence(&e.to_string(), "m.csv");
        }
    }

    #[test]
    fn a_damaged_sample_is_read_or_refused_in_one_sentence(at in 0..sample::ROTOR.len(), with in "\\PC{0,3}", cut in 0..40_usize) {
        let damage = |text: &str| {
            let start = (0..=at.min(text.len())).rev().find(|i| text.is_char_boundary(*i)).unwrap();
            let end = ((start + cut).min(text.len())..=text.len()).find(|i| text.is_char_boundary(*i)).unwrap();
            format!("{}{with}{}", &text[..start], &text[end..])
        };
        if let Err(e) = rotor_file::parse("r.toml", &damage(sample::ROTOR)) {
            one_sentence(&e.to_string(), "r.toml");
        }
        if let Err(e) = measurement::parse("m.csv", &damage(sample::RUNUP_DAY_0), &rotor()) {
            one_sentence(&e.to_string(), "m.csv");
        }
    }

    #[test]
    fn readings_survive_being_written_and_read(readings in proptest::collection::vec(reading(), 1..20)) {
        let mut bytes = Vec::new();
        measurement::write(&mut bytes, &rotor(), &readings).unwrap();
        let back = measurement::parse("m.csv", std::str::from_utf8(&bytes).unwrap(), &rotor()).unwrap();
        prop_assert_eq!(back.len(), readings.len());
        for (a, b) in back.iter().zip(&readings) {
            prop_assert_eq!(a.speed_rpm, b.speed_rpm);
            for (x, y) in a.probes.iter().zip(&b.probes) {
                prop_assert_eq!(x.is_some(), y.is_some());
                let difference = x.unwrap_or_default() - y.unwrap_or_default();
                prop_assert!(difference.norm() < Complex::new(1e-11, 1e-11).norm());
            }
        }
    }
}

#[test]
fn a_rotor_survives_being_written_and_read() {
    let folder = std::env::temp_dir().join(format!("rotor-edge-readers-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("rotor.toml");
    rotor_file::write(&path, &rotor()).unwrap();
    assert_eq!(rotor_file::read(&path).unwrap(), rotor());
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn unclosed_quotation_mark_is_refused_in_short_sentence() {
    let rotor = rotor_file::parse("r.toml", sample::ROTOR).unwrap();
    let record = sample::RECORD.replacen("2.03961", "\"2.03961", 1);
    let message = measurement::parse("m.csv", &record, &rotor).unwrap_err().to_string();
    one_sentence(&message, "m.csv");
    assert!(message.contains("row 2") && message.len() < 300, "{message}");
}
