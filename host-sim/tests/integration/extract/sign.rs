//! One sign for vibration, gap voltage and the rotor's file: toward the probe is positive.

use std::f64::consts::TAU;

use rotor_edge_desktop::machine::drawing::Gap;

use super::recording::Recording;
use super::{miss, run};
use crate::import::truth::Folder;

const NEARER_UM: f64 = 50.0;

#[test]
fn motion_towards_probe_is_positive_as_in_rotor_file() {
    let gap: Gap = toml::from_str("at_rest_v = -9.5").unwrap();
    let folder = Folder::new();
    let as_the_file_has_it = |turns: f64, row: &mut [f64; 5]| {
        for (probe, volts) in row[..4].iter_mut().enumerate() {
            let y = Recording::phasor_um(probe);
            let um = NEARER_UM + y.re * (TAU * turns).cos() - y.im * (TAU * turns).sin();
            *volts = gap.at_rest_v + 1e-3 * gap.sensitivity_v_mm * um;
        }
    };
    let file = folder.write("a.csv", Recording::default().csv_with(as_the_file_has_it));
    let sensitivity = gap.sensitivity_v_mm.to_string();
    let (_, readings) = run(&folder, &file, &["--mv-um", &sensitivity]);
    assert!(readings.len() > 5);
    for probe in 0..4 {
        assert!(miss(&readings, probe, Recording::phasor_um(probe)) < 1e-5);
        for reading in &readings {
            let moved_um = 1e6 * gap.moved_m(reading.gaps_v[probe].unwrap());
            assert!((moved_um - NEARER_UM).abs() < 0.1, "{moved_um}");
        }
    }
    let (_, turned) = run(&folder, &file, &["--mv-um", &format!("-{sensitivity}")]);
    assert!(
        miss(&turned, 0, -Recording::phasor_um(0)) < 1e-5,
        "the other sign turns every angle by 180 degrees"
    );
}
