//! What `extract` finds beside 1x: 2x, spectra, and what a change of speed does to the response.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

use nalgebra::{Complex, Vector2};
use serde_json::Value;

use super::recording::Recording;
use super::{DC, refused, run};
use crate::import::truth::{Folder, measured};
use crate::program::{assert_says, rotor_edge};

/// 12.5 µm zero-to-peak at 2x that lag by 0.7 rad of the second harmonic.
const TWO_X_UM: f64 = 12.5;
const TWO_X_LAG: f64 = 0.7;

#[test]
fn vectors_of_2x_are_found_whatever_1x_3x_and_the_gap_are() {
    let folder = Folder::new();
    // at 300 rpm/s a rise of the wrong sign within a turn would turn the vector by 4e-3
    for (speed_rpm, rise_rpm_s, revolutions) in
        [(11_000.0, 0.0, "16"), (3_011.7, 40.0, "16"), (3_011.7, 300.0, "5")]
    {
        let recording = Recording { speed_rpm, rise_rpm_s, ..Recording::default() };
        let with_harmonics = |turns: f64, row: &mut [f64; 5]| {
            let um = TWO_X_UM * (2.0 * TAU * turns - TWO_X_LAG).cos() + 8.0 * (3.0 * TAU * turns).sin();
            row[1] += 1e-3 * Recording::MV_UM * um;
        };
        let file = folder.write("a.csv", recording.csv_with(with_harmonics));
        let two_x = folder.text("two_x.csv");
        let (_, of_1x) =
            run(&folder, &file, &[&DC[..], &["--two-x", &two_x, "--revolutions", revolutions]].concat());
        let (_, of_2x) = measured(&folder.path("two_x.csv"));
        assert_eq!(of_1x.len(), of_2x.len());
        let known = Complex::from_polar(TWO_X_UM, -TWO_X_LAG);
        for (one, two) in of_1x.iter().zip(&of_2x) {
            assert_eq!((one.speed_rpm, one.time_d), (two.speed_rpm, two.time_d));
            assert!((1e6 * two.probes[1].unwrap() - known).norm() < 2e-3 * TWO_X_UM, "{speed_rpm}: {two:?}");
            assert!((1e6 * two.probes[0].unwrap()).norm() < 2e-3 * TWO_X_UM, "{speed_rpm}: {two:?}");
        }
    }
    let text = std::fs::read_to_string(folder.path("two_x.csv")).unwrap();
    assert!(text.starts_with("# vectors of 2x"), "{text}");
    let few = refused(
        &folder,
        &folder.text("a.csv"),
        &[&DC[..], &["--revolutions", "2", "--two-x", "x.csv"]].concat(),
    );
    assert_says(&few, &["--revolutions 2", "expected 3 at least for 2x"]);
}

#[test]
fn whirl_at_0_47_x_has_side_of_its_direction_in_cascade() {
    for (forward, sense) in [(true, 1.0), (false, -1.0)] {
        let folder = Folder::new();
        let recording = Recording { speed_rpm: 3_000.0, ..Recording::default() };
        let with_whirl = |turns: f64, row: &mut [f64; 5]| {
            let (sin, cos) = (TAU * 0.47 * turns).sin_cos();
            row[0] += 1e-3 * Recording::MV_UM * 200.0 * cos;
            row[1] += 1e-3 * Recording::MV_UM * 200.0 * sense * sin;
        };
        let file = folder.write("a.csv", recording.csv_with(with_whirl));
        let report = folder.text("report.html");
        run(&folder, &file, &[&DC[..], &["--report", &report]].concat());
        let page = std::fs::read_to_string(report).unwrap();
        let figure = page.split_once("Cascade at 15X and 15Y").expect("a cascade of the pair").1;
        // a circle of 200 µm radius, and nothing beside it that is as tall
        // 400 µm, and what the window takes of a line between two
        let caption = figure.split("the tallest line is ").nth(1).unwrap();
        let pk_pk_um: f64 = caption.split(' ').next().unwrap().parse().unwrap();
        assert!((340.0..=401.0).contains(&pk_pk_um), "{pk_pk_um}");
        let cpm = tallest_cpm(figure);
        assert_eq!(cpm > 0.0, forward, "{cpm}");
        assert!((cpm.abs() - 0.47 * 3_000.0).abs() < 200.0, "{cpm}");
    }
}

/// Where the tallest line of the first figure in this text stands.
fn tallest_cpm(page: &str) -> f64 {
    let (_, numbers) = page.split_once("<script type=\"application/json\">").expect("a figure has numbers");
    let figure: Value = serde_json::from_str(numbers.split("</script>").next().unwrap()).unwrap();
    let spectra = figure["series"].as_array().unwrap().iter().filter(|s| s["name"] == "spectrum");
    let rows = spectra.flat_map(|s| s["rows"].as_array().unwrap().clone());
    let column = |row: &Value, i: usize| row[i].as_f64().unwrap();
    let tallest = rows.max_by(|a, b| column(a, 2).total_cmp(&column(b, 2))).expect("a spectrum");
    column(&tallest, 0)
}

/// A mass on a spring with damping, driven by its unbalance through its resonance, integrated step by step.
struct Resonance {
    critical_rpm: f64,
    damping_ratio: f64,
    rise_rpm_s: f64,
}

impl Resonance {
    const SUBSTEPS: usize = 8;
    const RATE_HZ: f64 = 10_000.0;
    const FROM_RPM: f64 = 2_400.0;

    /// At a held speed, µm: `e Ω²/(ω² − Ω² + 2iζωΩ)` with e = 5 µm.
    fn steady_um(&self, speed_rpm: f64) -> Complex<f64> {
        let [natural, omega] = [self.critical_rpm, speed_rpm].map(|rpm| rpm * PI / 30.0);
        let stiffness =
            Complex::new(natural * natural - omega * omega, 2.0 * self.damping_ratio * natural * omega);
        Complex::from(5.0 * omega * omega) / stiffness
    }

    fn turning(&self, seconds: f64) -> (f64, f64, f64) {
        let omega = (Self::FROM_RPM + self.rise_rpm_s * seconds) * PI / 30.0;
        let alpha = self.rise_rpm_s * PI / 30.0;
        (seconds * (Self::FROM_RPM + 0.5 * self.rise_rpm_s * seconds) * PI / 30.0, omega, alpha)
    }

    /// Of `ü + 2ζω u̇ + ω² u = Re(F)`, `F = e(Ω² − iα) e^{iφ}`: what a mass off the axis does at a speed that rises.
    fn derivative(&self, seconds: f64, state: Vector2<f64>) -> Vector2<f64> {
        let (angle, omega, alpha) = self.turning(seconds);
        let natural = self.critical_rpm * PI / 30.0;
        let force = 5.0 * (Complex::new(omega * omega, -alpha) * Complex::from_polar(1.0, angle)).re;
        Vector2::new(
            state[1],
            force - 2.0 * self.damping_ratio * natural * state[1] - natural * natural * state[0],
        )
    }

    /// Runge and Kutta's fourth order.
    fn csv(&self, seconds: f64) -> String {
        let step = 1.0 / (Self::RATE_HZ * Self::SUBSTEPS as f64);
        let start = self.steady_um(Self::FROM_RPM);
        let mut state = Vector2::new(start.re, (start * Complex::i()).re * Self::FROM_RPM * PI / 30.0);
        let mut text = String::from("time_s,1X,kph\n");
        for n in 0..(seconds * Self::RATE_HZ) as usize * Self::SUBSTEPS {
            let t = n as f64 * step;
            if n.is_multiple_of(Self::SUBSTEPS) {
                let key = Recording::pulse(self.turning(t).0 / TAU);
                writeln!(text, "{t},{},{key}", state[0]).unwrap();
            }
            let a = self.derivative(t, state);
            let b = self.derivative(t + 0.5 * step, state + 0.5 * step * a);
            let c = self.derivative(t + 0.5 * step, state + 0.5 * step * b);
            let d = self.derivative(t + step, state + step * c);
            state += step / 6.0 * (a + 2.0 * b + 2.0 * c + d);
        }
        text
    }
}

#[test]
fn rate_compensated_run_up_equals_steady_state_response() {
    let folder = Folder::new();
    let resonance = Resonance { critical_rpm: 3_000.0, damping_ratio: 0.03, rise_rpm_s: 20.0 };
    let file = folder.write("a.csv", resonance.csv(60.0));
    let options = ["--unit", "um", "--threshold=-6", "--revolutions", "4", "--bin-rpm", "15"];
    let worst_um = |extra: &[&str]| {
        let (answer, readings) = run(&folder, &file, &[&options[..], extra].concat());
        assert!(readings.len() > 60, "{}", readings.len());
        let far = |r: &rotor_edge_desktop::measurement::Reading| {
            (1e6 * r.probes[0].unwrap() - resonance.steady_um(r.speed_rpm)).norm()
        };
        // where the response has forgotten how it began
        let settled = readings.iter().filter(|r| r.speed_rpm > 2_500.0 && r.speed_rpm < 3_550.0);
        (settled.map(far).fold(0.0, f64::max), answer)
    };
    let peak_um = resonance.steady_um(3_000.0).norm();
    let (as_measured_um, plain) = worst_um(&[]);
    let (compensated_um, answer) = worst_um(&["--compensate-rate"]);
    assert_eq!(plain["files"][0]["compensated"], Value::Null);
    println!("{as_measured_um:.3} and {compensated_um:.3} of {peak_um:.1} µm");
    assert!(as_measured_um > 0.02 * peak_um, "{as_measured_um} of {peak_um}");
    assert!(compensated_um < 0.2 * as_measured_um, "{compensated_um} of {as_measured_um}");
    assert!(answer["files"][0]["compensated"]["largest_um"].as_f64().unwrap() > 0.02 * peak_um);
    let without_bins = rotor_edge(&["extract", &file, "--unit", "um", "--compensate-rate"]);
    assert!(
        !without_bins.status.success() && String::from_utf8_lossy(&without_bins.stderr).contains("--bin-rpm")
    );
}
