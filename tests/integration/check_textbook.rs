//! `check` of machines from textbooks (tests/machines/textbook): figures of ROSS 2.3.0 on the same drawings and published
//! ones, and what the answer says beside them.

use rotor_edge::answers::check::CheckAnswer;
use rotor_edge::render::check::text;
use rotor_edge_desktop::check::modes::modes;
use rotor_edge_desktop::check::system::System;
use rotor_edge_desktop::check::{Check, CheckUnbalance, check};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::units::{rad_s, rpm};
use rotor_edge_tests::repository;

/// Relative, of frequencies, critical speeds and log decrements.
const TOLERANCE: f64 = 0.005;
/// Relative, of the amplitude of forced peaks.
const PEAK_TOLERANCE: f64 = 0.01;
/// ROSS prints log decrements to five decimals here.
const DECREMENT_DIGIT: f64 = 2e-5;

const UNDAMPED: [&str; 6] = ["f581", "f591", "f592", "f594", "f691", "nm_iso"];
const DAMPED: [&str; 6] = ["damped", "f595", "f596", "jeff", "lalanne-ferraris", "nm_ortho"];

fn machine(name: &str) -> Rotor {
    rotor_file::read(&repository(&format!("tests/machines/textbook/{name}.toml"))).unwrap()
}

fn checked(name: &str, range_rpm: [f64; 2]) -> Check {
    check(&machine(name), Some(range_rpm), CheckUnbalance::Assumed).unwrap()
}

fn answer(name: &str, range_rpm: [f64; 2]) -> CheckAnswer {
    CheckAnswer::from(&checked(name, range_rpm))
}

fn near(ours: f64, theirs: f64, tolerance: f64) -> bool {
    (ours - theirs).abs() <= tolerance * theirs.abs()
}

/// File, spin speed in rpm, and of each mode frequency in rpm and log decrement.
type SpinModes = (&'static str, f64, &'static [(f64, f64)]);
/// File, range in rpm, and of each critical speed rpm, log decrement and whirl.
type CriticalSpeeds = (&'static str, [f64; 2], &'static [(f64, f64, &'static str)]);
/// File, range in rpm, probe, and of each peak rpm and amplitude.
type ForcedPeaks = (&'static str, [f64; 2], &'static str, &'static [(f64, f64)]);

/// ROSS `run_modal`: damped frequencies of lateral modes with log decrements.
const ROSS_MODES: [SpinModes; 10] = [
    (
        "f591",
        4000.0,
        &[(815.41, 0.0), (838.39, 0.0), (2404.37, 0.0), (2814.31, 0.0), (5731.29, 0.0), (7897.99, 0.0)],
    ),
    (
        "f592",
        4000.0,
        &[(786.15, 0.0), (829.49, 0.0), (2288.42, 0.0), (2743.03, 0.0), (5571.90, 0.0), (7705.21, 0.0)],
    ),
    ("f594", 4000.0, &[(699.10, 0.0), (887.28, 0.0), (1989.30, 0.0), (2981.25, 0.0), (5364.89, 0.0)]),
    ("damped", 4000.0, &[(820.9, 0.2984), (844.3, 0.3370), (2519.4, 1.7660), (3040.0, 1.5570)]),
    ("f581", 3000.0, &[(3218.28, 0.0), (3222.08, 0.0), (15_700.27, 0.0), (19_580.12, 0.0)]),
    ("f691", 4000.0, &[(313.64, 0.0), (430.28, 0.0), (2006.92, 0.0), (2601.07, 0.0), (2966.65, 0.0)]),
    ("taper", 3000.0, &[(834.92, 0.00024), (837.07, 0.00024), (5529.76, 0.00688), (6718.36, 0.01062)]),
    (
        "nm_iso",
        100_000.0,
        &[(11_498.8, 0.0), (20_968.3, 0.0), (44_100.5, 0.0), (51_174.8, 0.0), (59_597.7, 0.0)],
    ),
    (
        "nm_ortho",
        100_000.0,
        &[(10_738.13, 0.1042), (19_455.07, 0.20466), (39_282.55, 0.58956), (47_192.11, 0.52944)],
    ),
    (
        "lalanne-ferraris",
        25_000.0,
        &[
            (3324.65, 0.00185),
            (4031.79, 0.00388),
            (9473.85, 0.01953),
            (11_618.34, 0.01728),
            (14_991.06, 0.02890),
            (24_447.78, 0.03783),
            (26_802.78, 0.02896),
        ],
    ),
];

#[test]
fn damped_modes_of_textbook_machines_equal_ross() {
    for (name, speed_rpm, theirs) in ROSS_MODES {
        let ours = answer(name, [speed_rpm; 2]);
        assert!(ours.modes.len() >= theirs.len(), "{name}: {:?}", ours.modes);
        for ((frequency_rpm, log_decrement), mode) in theirs.iter().zip(&ours.modes) {
            assert!(near(mode.frequency_rpm, *frequency_rpm, TOLERANCE), "{name}: {mode:?}, {frequency_rpm}");
            let off = (mode.log_decrement - log_decrement).abs();
            assert!(off <= TOLERANCE * log_decrement + DECREMENT_DIGIT, "{name}: {mode:?}, {log_decrement}");
        }
    }
}

/// ROSS modes at the speed of their own frequency: rpm, log decrement, sense.
const ROSS_CRITICAL: [CriticalSpeeds; 4] = [
    (
        "damped",
        [100.0, 4000.0],
        &[
            (830.79, 0.31451, "backward"),
            (835.65, 0.32254, "forward"),
            (2616.01, 1.7442, "backward"),
            (2980.33, 1.59073, "forward"),
        ],
    ),
    (
        "lalanne-ferraris",
        [100.0, 27_000.0],
        &[
            (3620.36, 0.00301, "backward"),
            (3798.07, 0.00267, "forward"),
            (10_017.0, 0.01961, "backward"),
            (11_278.41, 0.01779, "mixed"),
            (16_769.05, 0.03194, "backward"),
            (24_399.23, 0.03803, "mixed"),
            (26_602.99, 0.0291, "mixed"),
        ],
    ),
    (
        "nm_ortho",
        [100.0, 100_000.0],
        &[
            (13_860.52, 0.18035, "backward"),
            (16_378.05, 0.11684, "forward"),
            (39_922.41, 0.68039, "mixed"),
            (48_130.81, 0.44882, "mixed"),
            (58_877.6, 0.69127, "mixed"),
            (91_694.62, 0.40679, "forward"),
        ],
    ),
    (
        "nm_iso",
        [100.0, 100_000.0],
        &[
            (15_370.41, 0.0, "backward"),
            (16_999.33, 0.0, "forward"),
            (46_508.55, 0.0, "backward"),
            (49_815.33, 0.0, "forward"),
            (64_286.08, 0.0, "backward"),
            (94_695.64, 0.0, "forward"),
        ],
    ),
];

#[test]
fn critical_speeds_have_decrement_of_their_own_whirl() {
    for (name, range_rpm, theirs) in ROSS_CRITICAL {
        let ours = answer(name, range_rpm).damped_critical_speeds;
        assert_eq!(ours.len(), theirs.len(), "{name}: {ours:?}");
        for (mode, (speed_rpm, log_decrement, whirl)) in ours.iter().zip(theirs) {
            assert!(near(mode.speed_rpm, *speed_rpm, TOLERANCE), "{name}: {mode:?}, {speed_rpm}");
            assert!(near(mode.frequency_rpm, mode.speed_rpm, 1e-6), "{name}: {mode:?}");
            let off = (mode.log_decrement - log_decrement).abs();
            assert!(off <= TOLERANCE * log_decrement + DECREMENT_DIGIT, "{name}: {mode:?}, {log_decrement}");
            assert_eq!(mode.whirl, *whirl, "{name}: {mode:?}");
        }
    }
}

#[test]
fn text_and_json_state_the_same_critical_speeds() {
    let answer = answer("damped", [100.0, 4000.0]);
    let text = text(&answer);
    for (m, row) in answer.damped_critical_speeds.iter().zip([
        "831 0.315 backward inside",
        "836 0.323 forward inside",
        "2,616 1.74 backward inside",
        "2,980 1.59 forward inside",
    ]) {
        let rows = text.lines().map(|l| l.split_whitespace().collect::<Vec<_>>().join(" "));
        assert!(rows.into_iter().any(|line| line == row), "{m:?}: {text}");
    }
}

#[test]
fn every_critical_speed_of_samples_has_a_mode_of_its_own() {
    for sample in ["kit", "turbine"] {
        let rotor = rotor_file::read(&repository(&format!("host-sim/sample/{sample}/rotor.toml"))).unwrap();
        let found = check(&rotor, None, CheckUnbalance::Assumed).unwrap();
        for pair in found.damped_critical.windows(2) {
            let apart = (pair[0].eigenvalue - pair[1].eigenvalue).norm() / pair[0].eigenvalue.norm();
            assert!(apart > 1e-4 || pair[0].whirl != pair[1].whirl, "{sample}: {:?}", pair);
        }
        for mode in &found.damped_critical {
            // solved anew at this speed: one mode has the frequency, the decrement and the sense
            let all = modes(&System::new(&found.rotor).unwrap(), mode.speed_rad_s, 0.0, 8).unwrap();
            let same = |m: &rotor_edge_desktop::check::modes::Mode| {
                (m.eigenvalue - mode.eigenvalue).norm() < 1e-6 * mode.eigenvalue.norm()
                    && m.whirl == mode.whirl
            };
            assert!(all.iter().any(same), "{sample}: {mode:?}");
        }
    }
}

#[test]
fn published_critical_speeds_are_met() {
    // Friswell et al. 6.9.1, and 5.9.2 by ROSS; Nelson and McVaugh without shear deformation
    for (name, to_rpm, published) in [
        ("f691", 4000.0, &[358.43, 389.35, 2123.79, 2659.10, 3118.14][..]),
        ("f592", 4000.0, &[789.15, 827.61, 2366.84, 2689.07][..]),
        (
            "lalanne-ferraris",
            27_000.0,
            &[3620.0, 3798.0, 10_018.0, 11_279.0, 16_785.0, 24_402.0, 26_606.0][..],
        ),
    ] {
        let ours = answer(name, [100.0, to_rpm]).damped_critical_speeds;
        assert_eq!(ours.len(), published.len(), "{name}: {ours:?}");
        for (mode, published) in ours.iter().zip(published) {
            assert!(near(mode.speed_rpm, *published, TOLERANCE), "{name}: {mode:?}, {published}");
        }
    }
    let mut rotor = machine("nm_iso");
    rotor.physics.shear_deformation = false;
    let found = check(&rotor, Some([100.0, 100_000.0]), CheckUnbalance::Assumed).unwrap();
    let forward = found.critical.iter().map(|c| rpm(c.speed_rad_s));
    for (ours, published) in forward.zip([17_159.0, 49_983.0]) {
        assert!(near(ours, published, TOLERANCE), "{ours}, {published}");
    }
}

/// ROSS `run_unbalance_response` for 100 g·mm at the planes in phase: speed of the maximum in rpm, amplitude in µm pk-pk.
const ROSS_PEAKS: [ForcedPeaks; 7] = [
    (
        "lalanne-ferraris",
        [100.0, 25_000.0],
        "LX",
        &[
            (3620.35, 205.6541),
            (3798.09, 163.1096),
            (10_016.94, 73.9902),
            (11_280.1, 71.5588),
            (16_754.52, 20.3333),
            (24_401.49, 245.4922),
        ],
    ),
    (
        "lalanne-ferraris",
        [100.0, 25_000.0],
        "LY",
        &[(3620.48, 46.4611), (3798.07, 353.9203), (24_395.7, 153.1481), (26_618.0, 84.0453)],
    ),
    ("lalanne-ferraris", [100.0, 4000.0], "RY", &[(3620.48, 47.6439), (3798.07, 384.3001)]),
    ("damped", [100.0, 4000.0], "AX", &[(838.62, 14.0059), (3899.4, 4.2879)]),
    ("nm_ortho", [100.0, 100_000.0], "AX", &[(13_817.47, 177.74), (16_397.86, 526.47)]),
    ("taper", [390.0, 9750.0], "AX", &[(836.32, 1046.1003)]),
    ("jeff", [100.0, 3000.0], "AX", &[(808.97, 59.8128)]),
];

#[test]
fn forced_peaks_equal_ross_whatever_the_range() {
    for (name, range_rpm, probe, theirs) in ROSS_PEAKS {
        let answer = answer(name, range_rpm);
        let response = &answer.unbalance[0];
        let per_100_g_mm = 100.0 / response.each_g_mm();
        let peaks = &response.probes.iter().find(|p| p.name == probe).unwrap().peaks;
        for (speed_rpm, um_pk_pk) in theirs {
            let nearest = peaks
                .iter()
                .min_by(|a, b| (a.speed_rpm - speed_rpm).abs().total_cmp(&(b.speed_rpm - speed_rpm).abs()))
                .unwrap();
            assert!(
                near(nearest.speed_rpm, *speed_rpm, TOLERANCE),
                "{name} {probe}: {nearest:?}, {speed_rpm}"
            );
            let ours = nearest.amplitude_um_pk_pk * per_100_g_mm;
            assert!(
                near(ours, *um_pk_pk, PEAK_TOLERANCE),
                "{name} {probe}: {ours}, {um_pk_pk} at {speed_rpm}"
            );
            assert_eq!(nearest.amplitude_um_pk_pk, 2.0 * nearest.amplitude_um);
        }
    }
}

#[test]
fn jeffcott_rotor_has_closed_form_amplification() {
    let answer = answer("jeff", [100.0, 3000.0]);
    let peak = &answer.unbalance[0].probes[0].peaks[0];
    assert!(near(peak.speed_rpm, 809.7, TOLERANCE), "{peak:?}");
    assert!(near(peak.amplification.unwrap(), 84.36, TOLERANCE), "{peak:?}");
    let [backward, forward] = &answer.damped_critical_speeds[..] else { panic!("two critical speeds") };
    assert_eq!([backward.whirl, forward.whirl], ["backward", "forward"]);
    assert!(near(forward.log_decrement, 0.03724, TOLERANCE), "{forward:?}");
}

#[test]
fn undamped_machine_has_no_amplitude_and_no_stability() {
    for name in UNDAMPED {
        let highest = if name == "nm_iso" || name == "f581" { 60_000.0 } else { 4000.0 };
        let found = checked(name, [100.0, highest]);
        let answer = CheckAnswer::from(&found);
        assert!(answer.undamped && answer.stability == "not_judged", "{name}");
        assert!(answer.modes.iter().all(|m| m.log_decrement == 0.0), "{name}");
        assert!(answer.unbalance.iter().flat_map(|t| &t.probes).all(|p| p.peaks.is_empty()), "{name}");
        assert!(answer.critical_speeds_without_amplitude.iter().any(|c| c.excited), "{name}");
        let text = text(&answer);
        let first = text.lines().next().unwrap();
        assert!(first.starts_with("Undamped: no amplitude, stability not judged"), "{name}: {first}");
        assert!(!text.contains("Stable") && !text.contains("µm pk-pk"), "{name}: {text}");
        // away from the gaps a mode alone amplifies at most tenfold: no curve leaves a sensible axis
        let largest = (found.responses.iter().flat_map(|(_, all)| all).flat_map(|r| &r.points))
            .map(|(_, y)| y.norm())
            .filter(|y| y.is_finite())
            .fold(0.0, f64::max);
        assert!(largest < 1e-3, "{name}: {largest} m");
    }
}

#[test]
fn machine_with_one_damped_bearing_keeps_its_amplitudes() {
    let mut rotor = machine("undamped");
    let damped = machine("damped");
    rotor.bearing[0] = damped.bearing[0].clone();
    let answer = CheckAnswer::from(&check(&rotor, Some([100.0, 4000.0]), CheckUnbalance::Assumed).unwrap());
    assert!(!answer.undamped && answer.stability == "stable");
    assert!(answer.critical_speeds_without_amplitude.is_empty());
    assert!(answer.unbalance[0].probes[0].peaks.len() > 1);
}

#[test]
fn damped_textbook_machines_are_stable_and_oil_film_is_not() {
    for name in DAMPED {
        let to = if name == "f596" { 2000.0 } else { 4000.0 };
        assert_eq!(answer(name, [100.0, to]).stability, "stable", "{name}");
    }
    let film = answer("f596", [100.0, 2500.0]);
    let onset = film.stability_threshold.as_ref().unwrap();
    // ROSS's short bearing: between 2,050 and 2,100 rpm
    assert!(near(onset.speed_rpm, 2031.0, TOLERANCE), "{onset:?}");
    assert!(text(&film).starts_with("Unstable from 2,031 rpm: the shaft whirls at 1,044 rpm"));
    let peaks = film.unbalance.iter().flat_map(|t| &t.probes).flat_map(|p| &p.peaks);
    assert!(peaks.into_iter().all(|p| p.speed_rpm < onset.speed_rpm));
}

#[test]
fn film_of_finite_length_is_near_the_short_bearing() {
    let found = answer("f596", [1500.0; 2]);
    let c = &found.bearings[0].coefficients[0];
    // Friswell et al. 5.9.6 and ROSS's short bearing, MN/m and kN·s/m; this bearing's length is 0.3 of its diameter
    let ours = [c.kxx, c.kxy, c.kyx, c.kyy].map(|k| k * 1e-6);
    for (ours, short) in ours.into_iter().zip([12.81, 16.39, -25.06, 8.815]) {
        assert!(near(ours, short, 0.09), "{ours}, {short}");
    }
    let ours = [c.cxx, c.cxy, c.cyx, c.cyy].map(|c| c * 1e-3);
    for (ours, short) in ours.into_iter().zip([232.9, -81.9, -81.9, 294.9]) {
        assert!(near(ours, short, 0.09), "{ours}, {short}");
    }
}

#[test]
fn failing_margin_is_said_in_words() {
    let answer = answer("damped", [100.0, 4000.0]);
    let text = text(&answer);
    assert!(
        text.starts_with(
            "Stable from 100 to 4,000 rpm; 4 critical speeds in the running range; the separation margin fails at 839 rpm."
        ),
        "{text}"
    );
    assert!(text.contains("839 rpm is inside the running range; 15 % outside is needed."), "{text}");
    let peaks = answer.unbalance.iter().flat_map(|t| &t.probes).flat_map(|p| &p.peaks);
    for peak in peaks {
        let (Some(margin), Some(needed)) = (peak.margin_percent, peak.needed_percent) else { continue };
        assert_eq!(peak.margin_kept, Some(margin >= needed), "{peak:?}");
    }
}

#[test]
fn strongly_damped_modes_are_listed_apart() {
    let text = text(&answer("damped", [100.0, 4000.0]));
    let (resonant, strong) = text.split_once("Strongly damped modes at 4,000 rpm").unwrap();
    assert!(!resonant.contains("6.39") && strong.contains("6.39"), "{text}");
    let real = answer("jeff", [8000.0; 2]).overdamped_roots_rad_s;
    let rotor = machine("jeff");
    let all = System::new(&rotor).unwrap();
    assert!(real.iter().all(|rate| *rate < 0.0), "{real:?}");
    assert!(modes(&all, rad_s(8000.0), 0.0, 4).unwrap().iter().all(|m| m.frequency_rad_s() > 0.0));
}

#[test]
fn one_speed_and_rest_are_accepted() {
    let single = answer("damped", [4000.0; 2]);
    assert!(single.modes.iter().all(|m| near(m.speed_rpm, 4000.0, 1e-9)) && single.modes.len() >= 4);
    assert_eq!(single.damped_critical_speeds_outside.len(), 4);
    assert!(text(&single).starts_with("Stable at 4,000 rpm; no critical speed at 4,000 rpm;"));
    let rest = answer("damped", [0.0; 2]);
    assert!(rest.unbalance.is_empty() && rest.damped_critical_speeds.is_empty());
    assert!(rest.modes.iter().all(|m| m.whirl == "mixed" && m.speed_rpm == 0.0));
    assert!(text(&rest).starts_with("Stable at rest.\n"));
    assert!(!text(&rest).contains("inf") && !text(&rest).contains("NaN"));
}

#[test]
fn own_unbalance_answers_to_the_planes_of_the_file() {
    let mut rotor = machine("damped");
    assert!(check(&rotor, None, CheckUnbalance::Own).is_err(), "no plane states one");
    (rotor.plane[0].unbalance_g_mm, rotor.plane[0].angle_deg) = (Some(200.0), Some(30.0));
    (rotor.plane[1].unbalance_g_mm, rotor.plane[1].angle_deg) = (Some(200.0), Some(30.0));
    let own = CheckAnswer::from(&check(&rotor, Some([100.0, 4000.0]), CheckUnbalance::Own).unwrap());
    let [response] = &own.unbalance[..] else { panic!("one response") };
    assert_eq!((response.trial, response.basis), ("own", "rotor_file"));
    assert!(near(response.planes[1].angle_deg, 30.0, 1e-9));
    // ROSS: 14.0059 µm pk-pk for 100 g·mm at both planes
    assert!(near(response.probes[0].peaks[0].amplitude_um_pk_pk, 28.0118, PEAK_TOLERANCE));
    assert!(text(&own).contains("The unbalance that the rotor file states: l 200 g·mm at 30°"));
}
