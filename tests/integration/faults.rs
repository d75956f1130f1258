//! Faults on the bus, swept: what is detected, what is lost, and that nothing wrong ever comes out.

mod deployment;
mod disturbances;
mod parts_client;
mod scene;

use std::fmt::Write as _;

use disturbances::{Babbler, BusOff, Flood, Impostor, Namesake, PowerCuts};
use rotor_edge::bus::BusConfig;
use rotor_edge::edge::{Deployment, EdgeModel};
use rotor_edge::sample;
use rotor_edge_core::reading::Reading;
use scene::{Disturbance, Outcome, Quiet, play};

const TABLE: &str = include_str!("../faults/table.md");
const PAGE: &str = include_str!("../../docs/can-bus.md");

/// The sample turbine's model and its record, the lost readings left out, over and over.
pub fn machine(readings: usize) -> (EdgeModel, Vec<Reading>) {
    let (mut rotor, record, _) = sample::load().unwrap();
    for (plane, unbalance) in rotor.plane.iter_mut().zip([900.0, 700.0]) {
        (plane.unbalance_g_mm, plane.angle_deg) = (Some(unbalance), Some(40.0));
    }
    let deployment = Deployment::new(&rotor, 11_500.0).unwrap();
    let whole: Vec<Reading> =
        record.iter().map(|r| deployment.reading(r)).filter(Reading::is_complete).collect();
    (deployment.edge, whole.into_iter().cycle().take(readings).collect())
}

fn row(table: &mut String, name: &str, o: &Outcome) {
    let _ = writeln!(
        table,
        "| {name} | {} | {} | {} | {} | {} | {} |",
        o.disturbed,
        o.noticed,
        o.readings - o.evaluated,
        o.evaluated - o.results,
        o.results,
        o.wrong
    );
}

#[test]
fn fault_sweep_gives_recorded_outcomes_and_no_wrong_result() {
    const READINGS: usize = 1000;
    let (model, readings) = machine(READINGS);
    let clean = BusConfig { seed: 11, ..BusConfig::default() };
    let mut scenes: Vec<(&str, BusConfig, Box<dyn Disturbance>)> = Vec::new();
    let mut with_bus = |name, config| scenes.push((name, config, Box::new(Quiet)));
    with_bus("nothing", clean);
    with_bus("1 % of frames lost", BusConfig { loss: 0.01, ..clean });
    with_bus("10 % lost", BusConfig { loss: 0.1, ..clean });
    with_bus("10 % arrive twice", BusConfig { repetition: 0.1, ..clean });
    with_bus("all arrive twice", BusConfig { repetition: 1.0, ..clean });
    with_bus("up to 0.25 ms late", BusConfig { longest_delay_us: 250, ..clean });
    with_bus("up to 2 ms late, out of order", BusConfig { longest_delay_us: 2_000, ..clean });
    with_bus("up to 150 ms late, across readings", BusConfig { longest_delay_us: 150_000, ..clean });
    with_bus("1 % with a flipped bit", BusConfig { flip: 0.01, ..clean });
    with_bus("10 % with a flipped bit", BusConfig { flip: 0.1, ..clean });
    with_bus(
        "all of these at 2 %",
        BusConfig { loss: 0.02, repetition: 0.02, flip: 0.02, longest_delay_us: 500, ..clean },
    );
    let mut with_other = |name, other| scenes.push((name, clean, other));
    with_other("babbling node, half the bus", Box::new(Babbler { per_period: 185 }));
    with_other("babbling node, all of the bus", Box::new(Babbler { per_period: 400 }));
    with_other("arbitrary bytes in the host's name", Box::new(Impostor::new(1)));
    with_other("the same, ten frames a reading", Box::new(Impostor::new(10)));
    with_other("flood of low priority, full load", Box::new(Flood));
    with_other("bus-off, 3 of 20 readings", Box::new(BusOff));
    with_other("power cut every 50 readings", Box::new(PowerCuts));
    with_other("a second monitor with its number", Box::new(Namesake::new(&model)));
    let mut table = String::from(
        "| fault | copies of frames disturbed | noticed | readings lost | results lost | results | wrong |\n\
         |---|---|---|---|---|---|---|\n",
    );
    for (name, config, mut other) in scenes {
        let outcome = play(&model, &readings, config, &mut *other);
        row(&mut table, name, &outcome);
        assert_eq!(outcome.wrong, 0, "{name}: {outcome:?}");
    }
    println!("{table}");
    assert_eq!(table, TABLE, "tests/faults/table.md holds other outcomes; look at each before replacing it");
    assert_eq!(PAGE.split("<!-- faults -->\n").nth(1), Some(TABLE), "the table in docs/can-bus.md");
}

#[test]
fn a_million_faulty_frames_and_no_wrong_estimate() {
    let (model, readings) = machine(60_000);
    let (mut faulty, mut results) = (0, 0);
    for (seed, (loss, repetition, flip)) in
        (1..).zip([(0.02, 0.05, 0.1), (0.05, 0.3, 0.05), (0.1, 0.2, 0.5), (0.0, 0.6, 0.8)])
    {
        let bus = BusConfig { loss, repetition, flip, longest_delay_us: 600, seed, ..BusConfig::default() };
        let outcome = play(&model, &readings, bus, &mut Impostor::new(1));
        assert_eq!(outcome.wrong, 0, "seed {seed}: {outcome:?}");
        faulty += outcome.faulty;
        results += outcome.results;
    }
    println!("{faulty} lost, repeated or damaged frames, {results} results, none of them wrong");
    assert!(faulty >= 1_000_000, "{faulty}");
    assert!(results >= 1_000, "{results} results came through to be judged");
}
