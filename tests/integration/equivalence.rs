//! The f32 core against the f64 desktop crate: every reading of the sample, all kinds of term, faults
//! on the bus.

use nalgebra::{Complex, DVector, Matrix2};
use rotor_edge::bus::BusConfig;
use rotor_edge::edge::Deployment;
use rotor_edge::replay::check::{EXCESS_LIMIT, FEATURE_LIMIT, equivalence};
use rotor_edge::replay::{self, AnsweredReading, Replay, ReplayConfig, flags};
use rotor_edge::sample;
use rotor_edge_core::can::{FLAG_FLAGGED, FLAG_SUSPICIOUS};
use rotor_edge_core::response::{SupportAmplitudes, response};
use rotor_edge_core::state::{NodeState, Reason};
use rotor_edge_desktop::bearing::Law;
use rotor_edge_desktop::bearing::film::Film;
use rotor_edge_desktop::bearing::film_law::FilmLaw;
use rotor_edge_desktop::bearing::support::{Pedestal, SupportLaw};
use rotor_edge_desktop::bearing::table::{CoefficientTable, TableRow};
use rotor_edge_desktop::identify::{PhaseOneConfig, identify};
use rotor_edge_desktop::machine::drawing::{Mount, Rotor};
use rotor_edge_desktop::machine::place::SpeedLaw;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::model::terms::{Forcing, Support};
use rotor_edge_desktop::units::rad_s;
use rotor_edge_tests::with_supports;

fn identified() -> (Rotor, Vec<Reading>) {
    let (rotor, record, runup) = sample::load().unwrap();
    let readings: Vec<Reading> = record[..3].iter().chain(&runup).cloned().collect();
    (identify(&rotor, &readings, &PhaseOneConfig::default()).unwrap().rotor, record)
}

fn deployment(rotor: &Rotor) -> Deployment {
    Deployment::new(rotor, 12_000.0).unwrap()
}

#[test]
fn core_equals_desktop_on_sample_and_flags_event() {
    let (rotor, record) = identified();
    let deployment = deployment(&rotor);
    let played = replay::run(&deployment, &record, &ReplayConfig::default(), |_| ()).unwrap();
    let some = record.iter().filter(|r| r.probes.iter().any(Option::is_some)).count();
    assert_eq!(played.answers.len(), some, "every reading that shows something is answered");
    assert!(record.iter().any(|r| r.complete().is_none()), "the sample has a lost probe");
    let agreement = equivalence(&deployment, &ReplayConfig::default(), &record, &played.answers).unwrap();
    println!("{agreement:?}");
    assert_eq!((agreement.compared, agreement.certified), (some, some));
    assert!(agreement.max_relative_gap <= EXCESS_LIMIT);
    assert!(agreement.max_relative_feature_error <= FEATURE_LIMIT);
    assert!(agreement.max_relative_excess <= EXCESS_LIMIT);
    let raised = flags(&record, &played.answers);
    let first = raised.first().expect("the event is flagged");
    assert!(first.since_d >= 120.0, "no flag before day 120: {first:?}");
    let readings_after =
        record.iter().filter(|r| r.time_d >= Some(125.0) && r.time_d <= Some(first.time_d)).count();
    assert!(readings_after <= 6, "flag within six readings of day 125: {first:?}");
    assert_eq!(rotor.bearing[first.suspect.unwrap()].name, "16");
}

#[test]
fn the_check_itself_fails_for_a_core_with_another_model() {
    let (rotor, record) = identified();
    let mut deployment = deployment(&rotor);
    deployment.edge = with_supports(&deployment.edge, |supports| supports[1].stiffness_n_m[0][0] *= 1.001);
    let played = replay::run(&deployment, &record[..50], &ReplayConfig::default(), |_| ()).unwrap();
    let agreement =
        equivalence(&deployment, &ReplayConfig::default(), &record[..50], &played.answers).unwrap();
    assert!(agreement.max_relative_feature_error > FEATURE_LIMIT);
    assert!(agreement.verdict().is_err());
}

/// Adds one of every kind of term to the deployed model, desktop and edge alike.
fn with_every_term(rotor: &Rotor) -> Deployment {
    let plain = deployment(rotor);
    let mut model = plain.desktop.clone();
    let disk = &model.planes[0] * 0.3 + &model.planes[1] * 0.7;
    let mut seal = SupportLaw::linear(Matrix2::new(2e7, 3e7, -3e7, 2e7), Matrix2::identity() * 1e4);
    seal.mass_kg = 4.0;
    model.supports.push(Support { shape: disk.clone(), law: seal });
    model.supports[0].law.pedestal = Some(Pedestal::isotropic(8e8, 2e4, 300.0));
    model.supports[1].law.stiffness_slope = 0.3;
    model.supports[1].law.reference_rad_s = 800.0;
    model.internal_damping_s = 2e-5;
    let force = |amplitude, law| Forcing { shape: disk.clone(), amplitude, law };
    model.forcings.push(force(Complex::new(120.0, -80.0), SpeedLaw::Constant));
    model.forcings.push(force(Complex::new(1e-4, 5e-5), SpeedLaw::Squared));
    model.probes[2].gain = Complex::from_polar(1.1, 0.2);
    model.probes[1].runout_m = Complex::new(1e-6, -2e-6);
    Deployment::of_model(model, rotor, plain.unbalance_kg_m, 12_000.0).unwrap()
}

#[test]
fn response_with_every_kind_of_term_equals_desktop() {
    let (rotor, _) = identified();
    let all = with_every_term(&rotor);
    let plain = deployment(&rotor);
    let u = &all.unbalance_kg_m;
    let u_g_mm: Vec<[f32; 2]> = u.iter().map(|u| [(u.re * 1e6) as f32, (u.im * 1e6) as f32]).collect();
    for speed_rpm in [1500.0, 4000.0, 8000.0, 11_000.0, 12_000.0] {
        let speed = rad_s(speed_rpm);
        let desktop = all.desktop.response(speed).unwrap().at(u);
        let core = response(&all.edge, speed as f32, &SupportAmplitudes::default()).unwrap();
        let shown = core.probes()[..4].iter().map(|probe| probe.phasor(&u_g_mm));
        let core =
            DVector::from_iterator(4, shown.map(|y| Complex::new(f64::from(y.re), f64::from(y.im)) * 1e-6));
        assert!((&core - &desktop).camax() < 1e-5 * desktop.camax(), "{speed_rpm} rpm");
        let without = plain.desktop.response(speed).unwrap().at(u);
        assert!((without - &desktop).camax() > 1e-2 * desktop.camax(), "the terms matter");
    }
}

/// The identified sample with a film at one bearing, a table at the other, a pedestal stated under it and its probes on
/// that housing.
fn on_films(rotor: &Rotor) -> Rotor {
    let mut rotor = rotor.clone();
    rotor.schema = 2;
    let film = r#"kind = "tilting_pad"
        diameter_m = 0.1
        length_m = 0.05
        radial_clearance_m = 1e-4
        viscosity_pa_s = 0.02
        load_n = 2000.0
        pads = 5
        preload = 0.3"#;
    rotor.bearing[0].law = Law::Film(FilmLaw::new(toml::from_str::<Film>(film).unwrap()).unwrap());
    let row = |speed_rpm: f64| {
        let k = 1e8 * (1.0 + speed_rpm / 20_000.0);
        let c = 2e5 * (3000.0 / speed_rpm).sqrt();
        TableRow {
            speed_rpm,
            kxx: k,
            kxy: 0.3 * k,
            kyx: -0.4 * k,
            kyy: 1.3 * k,
            cxx: c,
            cxy: 0.0,
            cyx: 0.0,
            cyy: c,
        }
    };
    let speeds = [1000.0, 2000.0, 3000.0, 4500.0, 6000.0, 8000.0, 10_000.0, 11_000.0, 12_000.0, 13_000.0];
    rotor.bearing[1].law = Law::Table(CoefficientTable::new(speeds.map(row).to_vec()).unwrap());
    rotor.bearing[1].pedestal =
        Some(Pedestal { stiffness_n_m: [6e8, 4e8], damping_n_s_m: [2e4, 3e4], mass_kg: [100.0, 80.0] });
    let name = rotor.bearing[1].name.clone();
    rotor.probe.iter_mut().filter(|p| p.bearing == name).for_each(|p| p.mount = Mount::Housing);
    rotor
}

#[test]
fn response_of_films_tables_and_pedestals_equals_desktop() {
    let (rotor, _) = identified();
    let rotor = on_films(&rotor);
    let deployed = deployment(&rotor);
    let full = Model::finite_elements(&rotor);
    let u = &deployed.unbalance_kg_m;
    let u_g_mm: Vec<[f32; 2]> = u.iter().map(|u| [(u.re * 1e6) as f32, (u.im * 1e6) as f32]).collect();
    let mut worst = 0.0_f64;
    for speed_rpm in [3000.0, 4000.0, 5500.0, 8000.0, 9500.0, 11_000.0, 12_000.0] {
        let speed = rad_s(speed_rpm);
        let desktop = deployed.desktop.response(speed).unwrap().at(u);
        let core = response(&deployed.edge, speed as f32, &SupportAmplitudes::default()).unwrap();
        let shown = core.probes()[..4].iter().map(|probe| probe.phasor(&u_g_mm));
        let core =
            DVector::from_iterator(4, shown.map(|y| Complex::new(f64::from(y.re), f64::from(y.im)) * 1e-6));
        assert!((&core - &desktop).camax() < 1e-5 * desktop.camax(), "{speed_rpm} rpm");
        let exact = full.response(speed).unwrap().at(u);
        worst = worst.max((&exact - &desktop).camax() / exact.camax());
    }
    println!("straight lines between knots and six shapes: {worst:.1e} of the response at worst");
    assert!(worst < 0.03, "{worst}");
}

#[test]
fn lost_repeated_and_late_frames_give_no_wrong_estimate() {
    let (rotor, record) = identified();
    let deployment = deployment(&rotor);
    let clean = replay::run(&deployment, &record, &ReplayConfig::default(), |_| ()).unwrap();
    for seed in 1..=5 {
        let bus =
            BusConfig { loss: 0.02, repetition: 0.05, longest_delay_us: 400, seed, ..BusConfig::default() };
        let config = ReplayConfig { bus, ..ReplayConfig::default() };
        let played = replay::run(&deployment, &record, &config, |_| ()).unwrap();
        let c = played.counters;
        println!("seed {seed}: {} answers, {c:?}", played.answers.len());
        assert!(played.answers.len() < clean.answers.len(), "some readings must have suffered");
        assert!(c.incomplete > 0);
        // a gap shows when the next reading arrives, so only the two ends of the record can stay unknown
        let accounted = (c.readings + c.lost + c.skipped) as usize;
        assert!(
            (record.len() - 6..=record.len()).contains(&accounted),
            "every reading is accounted for: {c:?}"
        );
        let agreement = equivalence(&deployment, &config, &record, &played.answers).unwrap();
        assert!(
            agreement.max_relative_feature_error <= FEATURE_LIMIT,
            "what was evaluated was what was sent"
        );
        // three suspicious readings raise the flag; the third that is heard of has it at the latest
        let (before, after): (Vec<&AnsweredReading>, Vec<&AnsweredReading>) =
            played.answers.iter().partition(|a| replay::day(&record, a.row) < 125.0);
        assert!(before.iter().all(|a| !a.flagged()));
        assert!(after.iter().skip(2).take(100).all(|a| a.flagged()));
    }
}

#[test]
fn lost_readings_and_missing_days_raise_no_flag() {
    let (rotor, record) = identified();
    let deployment = deployment(&rotor);
    let mut holes: Vec<Reading> =
        record[..120].iter().enumerate().filter(|(i, _)| i % 7 != 3).map(|(_, r)| r.clone()).collect();
    for (i, reading) in holes.iter_mut().enumerate() {
        if i % 3 == 0 {
            reading.probes[i % 4] = None;
        }
    }
    let config = ReplayConfig::default();
    let played = replay::run(&deployment, &holes, &config, |_| ()).unwrap();
    assert!(flags(&holes, &played.answers).is_empty());
    assert_eq!(played.answers.len(), holes.len(), "three probes tell two planes");
    assert_eq!(played.counters.partial as usize, holes.len().div_ceil(3));
    let agreement = equivalence(&deployment, &config, &holes, &played.answers).unwrap();
    println!("{agreement:?}");
    assert_eq!((agreement.compared, agreement.certified), (holes.len(), holes.len()));
    agreement.verdict().unwrap();
}

/// Probes lost in every combination: what is left is compared, and what says nothing is not called healthy.
#[test]
fn any_lost_probes_are_named_and_the_rest_equals_desktop() {
    let (rotor, record) = identified();
    let deployment = deployment(&rotor);
    let config = ReplayConfig::default();
    for mask in 0..16_u8 {
        let mut part: Vec<Reading> = record[20..60].to_vec();
        for reading in &mut part[15..25] {
            for (place, probe) in reading.probes.iter_mut().enumerate() {
                *probe = probe.filter(|_| mask >> place & 1 == 0);
            }
        }
        let played = replay::run(&deployment, &part, &config, |_| ()).unwrap();
        let agreement = equivalence(&deployment, &config, &part, &played.answers).unwrap();
        agreement.verdict().unwrap();
        assert_eq!(agreement.compared, played.answers.len(), "mask {mask}");
        let during = |time_d: f64| replay::day(&part, 15) <= time_d && time_d < replay::day(&part, 25);
        let said: Vec<_> = played.states.iter().filter(|change| during(change.time_d)).collect();
        match mask.count_ones() {
            0 => assert!(said.is_empty(), "{said:?}"),
            1 => assert_eq!(
                (said[0].status.state, said[0].status.reason),
                (NodeState::Tracking, Reason::Probes)
            ),
            _ => assert!(said.iter().any(|c| c.status.state == NodeState::Blind), "mask {mask}: {said:?}"),
        }
        assert!(said.iter().all(|change| change.status.missing_mask == mask), "mask {mask}: {said:?}");
        let after = played.states.last().unwrap().status;
        assert_eq!((after.state, after.reason), (NodeState::Tracking, Reason::None), "mask {mask}");
    }
}

/// Silence in a record is silence for the controller.
#[test]
fn gap_in_record_makes_state_stale_until_next_reading() {
    let (rotor, mut record) = identified();
    record.truncate(40);
    let gap_from = replay::day(&record, 19);
    for reading in &mut record[20..] {
        reading.time_d = reading.time_d.map(|day| day + 30.0);
    }
    let deployment = deployment(&rotor);
    let played = replay::run(&deployment, &record, &ReplayConfig::default(), |_| ()).unwrap();
    let stale: Vec<_> =
        played.states.iter().filter(|change| change.status.state == NodeState::Stale).collect();
    assert_eq!(stale.len(), 1);
    assert_eq!((stale[0].time_d, stale[0].status.reason), (gap_from + 2.5, Reason::Age));
    let last = played.states.last().unwrap();
    assert_eq!((last.time_d, last.status.state), (replay::day(&record, 20), NodeState::Tracking));
}

#[test]
fn a_power_cut_changes_no_result_and_keeps_the_flag() {
    let (rotor, record) = identified();
    let deployment = deployment(&rotor);
    const FLAGS: u8 = FLAG_SUSPICIOUS | FLAG_FLAGGED;
    let whole = replay::run(&deployment, &record, &ReplayConfig::default(), |_| ()).unwrap();
    let cut_d = 140.0;
    let config = ReplayConfig { power_cuts_d: vec![60.0, cut_d], ..ReplayConfig::default() };
    let cut = replay::run(&deployment, &record, &config, |_| ()).unwrap();
    assert_eq!(cut.answers.len(), whole.answers.len());
    for (a, b) in cut.answers.iter().zip(&whole.answers) {
        assert_eq!(a.result.flags & FLAGS, b.result.flags & FLAGS, "row {}", a.row);
        // where the swarm has to search, its seed is the number of the reading since the start
        let feature_sum_um = b.result.e_um / b.result.ratio;
        let change_um = (a.result.e_um - b.result.e_um).abs();
        // a restart goes on from what was trusted last, and so does its bound on what is not trusted
        assert!(
            !b.result.is_trusted() || change_um <= 1e-5 * feature_sum_um,
            "row {}: {change_um} µm",
            a.row
        );
    }
    // the level is the stored one; later it lacks the weight of one reading, since nobody knows for how long that stood
    let at_60 = whole.answers.iter().position(|a| replay::day(&record, a.row) >= 60.0).unwrap();
    let level = |played: &Replay, at: usize| played.answers[at].result.level_um;
    assert_eq!(level(&cut, at_60), level(&whole, at_60));
    let weight = 0.1 * (whole.answers[at_60].result.e_um - level(&whole, at_60)).abs();
    for at in at_60..110 {
        let change = (level(&cut, at) - level(&whole, at)).abs();
        assert!(change <= 1.001 * weight, "answer {at}: the level moved by {change} µm, not {weight}");
    }
    let agreement = equivalence(&deployment, &config, &record, &cut.answers).unwrap();
    assert_eq!(agreement.compared, cut.answers.len());
    agreement.verdict().unwrap();
    let after = cut.states.iter().find(|change| change.time_d >= cut_d).expect("it says so when it is back");
    assert_eq!(after.status.state, NodeState::Flagged);
    assert_eq!(after.status.suspect, Some(1));
    assert!(
        cut.states
            .iter()
            .filter(|change| change.time_d > 130.0)
            .all(|c| c.status.state == NodeState::Flagged)
    );
}

#[test]
fn the_same_seed_gives_the_same_bits() {
    let (rotor, record) = identified();
    let deployment = deployment(&rotor);
    let run = || replay::run(&deployment, &record[..60], &ReplayConfig::default(), |_| ()).unwrap().answers;
    let bits = |answers: Vec<AnsweredReading>| -> Vec<[u32; 4]> {
        answers
            .iter()
            .map(|a| {
                let [[a, b], [c, d], ..] = a.result.unbalance_g_mm;
                [a, b, c, d].map(f32::to_bits)
            })
            .collect()
    };
    assert_eq!(bits(run()), bits(run()));
}
