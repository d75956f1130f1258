use rotor_edge_core::can::{
    FLAG_AT_BOUND_1, Frame, Keyphasor, Message, MonitorResult, NodeState, PROTOCOL_VERSION, result_frames,
};
use rotor_edge_core::model::MODEL_SCHEMA;
use rotor_edge_core::reading::ProbeVector;

use super::monitor::{HISTORY, Replacement, Version};
use super::testing::{Bench, faulty, healthy};
use super::words::{Level, Words, bearing_number};
use super::*;
use crate::edge::SHAPES;

const SECOND_US: u64 = 1_000_000;

fn words(watch: &Watch, node: u8) -> Words {
    Words::of(node, watch.monitor(node).unwrap(), watch.now_us())
}

#[track_caller]
fn assert_says(watch: &Watch, node: u8, level: Level, parts: &[&str]) {
    let words = words(watch, node);
    let text = format!("{}: {} → {}", words.short, words.state, words.next);
    for part in parts {
        assert!(text.contains(part), "\"{part}\" is missing in: {text}");
    }
    assert_eq!(words.level, level, "{text}");
}

fn result(sequence: u16) -> MonitorResult {
    MonitorResult {
        sequence,
        flags: 0,
        suspect: None,
        streak: 0,
        unbalance_g_mm: [[3.0, 4.0], [-1.0, 0.0]],
        static_g_mm: [2.0, 4.0],
        dynamic_g_mm: [2.0, 2.0],
        e_um: 1.0,
        ratio: 0.1,
    }
}

#[test]
fn a_monitor_is_known_by_its_heartbeat_and_answers_the_question_for_versions() {
    let mut bench = Bench::new(&[4]);
    bench.run(SECOND_US);
    let found: Vec<u8> = bench.watch.monitors().map(|(node, _)| node).collect();
    assert_eq!(found, [4]);
    let monitor = bench.watch.monitor(4).unwrap();
    assert_eq!(monitor.state(), Some(NodeState::Waiting));
    let (protocol, model_schema) = (PROTOCOL_VERSION, MODEL_SCHEMA as u8);
    let version = monitor.version().unwrap();
    assert_eq!(version, Version { protocol, oldest: version.oldest, model_schema, shapes: SHAPES as u8 });
    assert_eq!(monitor.counters(), Some(&bench.nodes[0].counters()));
    assert_eq!(monitor.model_checksum(), Some(bench.model.checksum()));
    assert_says(&bench.watch, 4, Level::Idle, &["waiting", "send readings"]);
    assert!(bench.watch.questions().is_empty(), "asked once");
}

#[test]
fn a_monitor_that_comes_later_is_asked_by_number_and_once() {
    let mut bench = Bench::new(&[]);
    bench.run(SECOND_US);
    bench.nodes = Bench::new(&[7]).nodes;
    bench.run(3 * SECOND_US);
    assert!(bench.watch.monitor(7).unwrap().version().is_some());
    let mut watch = Watch::new(None);
    watch.questions();
    let heartbeat =
        Message::Heartbeat { version: 2, state: NodeState::Waiting, readings: 0, lost: 0, rejected: 0 };
    for _ in 0..3 {
        watch.receive(0, &heartbeat.encode(7));
    }
    assert_eq!(watch.questions(), [Message::VersionQuery.encode(7)]);
}

#[test]
fn results_are_those_of_the_core_to_the_bit_with_their_rate() {
    let mut bench = Bench::new(&[1]);
    bench.run(SECOND_US);
    for _ in 0..12 {
        bench.send_healthy(1, 1);
        let (node, monitor) = (&bench.nodes[0], bench.watch.monitor(1).unwrap());
        let (estimate, last) = (node.estimate().unwrap(), monitor.last().unwrap());
        assert_eq!(last.what.unbalance_g_mm, estimate.unbalance_g_mm);
        assert_eq!((last.what.e_um, last.what.ratio), (estimate.residual.e_um, estimate.residual.ratio));
    }
    let monitor = bench.watch.monitor(1).unwrap();
    let sequences: Vec<u16> = monitor.history().iter().map(|timed| timed.what.sequence).collect();
    assert_eq!(sequences, (0..12).collect::<Vec<_>>());
    // 11 intervals of 0.1 s, and 0.1 s since the last
    assert!((monitor.readings_a_second(bench.watch.now_us()).unwrap() - 11.0 / 1.2).abs() < 1e-9);
    assert_eq!(monitor.reading().unwrap().what.keyphasor, Keyphasor::Locked);
    assert_says(&bench.watch, 1, Level::Good, &["tracking", "the model describes the machine"]);
}

#[test]
fn a_residual_that_stays_high_is_flagged_with_its_bearing_and_the_stretch_ends_when_it_falls() {
    let mut bench = Bench::new(&[1]);
    bench.run(SECOND_US);
    bench.send_healthy(1, 10);
    bench.send_faulty(1, 1);
    assert_says(&bench.watch, 1, Level::Attention, &["suspicious", "residual high for 1 reading", "wait"]);
    assert!(bench.watch.monitor(1).unwrap().flagged().is_empty());
    bench.send_faulty(1, 4);
    let suspect = bench.nodes[0].verdict().unwrap().suspect.unwrap();
    let state = format!("residual high for 5 readings, suspect bearing {}", bearing_number(suspect));
    assert_says(&bench.watch, 1, Level::Alarm, &["FLAGGED", &state, "record a run-up", "rotor-edge improve"]);
    let stretches = bench.watch.monitor(1).unwrap().flagged();
    // the third of a streak raises the flag
    assert_eq!((stretches[0].first.what, stretches[0].last.what), (12, 14));
    assert!(stretches[0].lasts);
    assert_eq!(stretches[0].suspect, Some(suspect));
    bench.send_healthy(1, 20);
    let stretches = bench.watch.monitor(1).unwrap().flagged();
    assert_eq!(stretches.len(), 1);
    assert!(!stretches[0].lasts);
    bench.send_faulty(1, 3);
    assert_eq!(bench.watch.monitor(1).unwrap().flagged().len(), 2);
}

#[test]
fn growth_at_the_bound_counts_when_it_is_no_coincidence() {
    let mut watch = Watch::new(None);
    let at_bound = MonitorResult { flags: FLAG_AT_BOUND_1, ..result(0) };
    for (number, says) in [(2, "describes the machine → "), (3, "plane 1 grows as fast as it may")] {
        watch = Watch::new(None);
        for sequence in 0..number {
            let frames = result_frames(1, &MonitorResult { sequence, ..at_bound });
            frames.iter().for_each(|frame| watch.receive(0, frame));
        }
        assert!(format!("{} → ", words(&watch, 1).state).contains(says), "{number}");
    }
    result_frames(1, &result(3)).iter().for_each(|frame| watch.receive(0, frame));
    assert_eq!(watch.monitor(1).unwrap().at_bound(), [0, 0]);
}

#[test]
fn three_missed_heartbeats_are_silence_and_two_are_not() {
    let mut bench = Bench::new(&[1]);
    bench.run(SECOND_US);
    let last_us = bench.watch.monitor(1).unwrap().heard_us().unwrap();
    bench.nodes.clear();
    bench.watch.pass(last_us + 3 * SECOND_US);
    assert!(!bench.watch.monitor(1).unwrap().is_silent(bench.watch.now_us()));
    bench.watch.pass(last_us + 3 * SECOND_US + 1);
    assert!(bench.watch.monitor(1).unwrap().is_silent(bench.watch.now_us()));
    assert_says(&bench.watch, 1, Level::Alarm, &["SILENT", "not heard for 3.0 s", "power"]);
}

#[test]
fn two_devices_with_one_number_are_a_conflict_until_one_is_gone() {
    let mut bench = Bench::new(&[5, 6, 5]);
    bench.run(SECOND_US);
    assert_says(
        &bench.watch,
        5,
        Level::Alarm,
        &["CONFLICT", "two devices call themselves monitor 5", "another number"],
    );
    assert_says(&bench.watch, 6, Level::Idle, &["waiting"]);
    assert!(bench.watch.monitor(5).unwrap().counters().unwrap().conflicts > 0);
    bench.nodes.pop();
    bench.run(8 * SECOND_US);
    bench.send_healthy(5, 2);
    assert_says(&bench.watch, 5, Level::Good, &["tracking"]);
}

#[test]
fn a_replaced_model_is_noticed_with_its_time() {
    let mut bench = Bench::new(&[1]);
    bench.run(2 * SECOND_US);
    let mut better = bench.model.clone();
    better.supports[0].mass_kg += 1.0;
    let (from, to) = (bench.model.checksum(), better.checksum());
    bench.nodes[0].replace_model(better).unwrap();
    let replaced_us = bench.watch.now_us();
    bench.run(3 * SECOND_US);
    let seen: Vec<_> = bench.watch.monitor(1).unwrap().replacements().copied().collect();
    assert_eq!(seen.len(), 1);
    assert_eq!(seen[0].what, Replacement { from, to });
    assert!((replaced_us..=replaced_us + SECOND_US).contains(&seen[0].time_us));
}

#[test]
fn a_result_with_a_frame_missing_or_altered_is_damaged_and_not_shown() {
    let mut watch = Watch::new(None);
    let frames = result_frames(1, &result(7));
    frames.iter().for_each(|frame| watch.receive(0, frame));
    for missing in 1..6 {
        let others = frames.iter().enumerate().filter(|(i, _)| *i != missing);
        others.for_each(|(_, frame)| watch.receive(0, frame));
    }
    let altered = Message::Residual { e_um: 1.0, ratio: 0.2 }.encode(1);
    let rest = [&frames[..5], &[altered], &frames[6..]].concat();
    rest.iter().for_each(|frame| watch.receive(0, frame));
    let monitor = watch.monitor(1).unwrap();
    assert_eq!((monitor.damaged(), monitor.history().len()), (6, 1));
}

#[test]
fn readings_that_cannot_be_judged_are_explained() {
    let mut bench = Bench::new(&[1]);
    bench.run(SECOND_US);
    let good = healthy(&bench.model);
    let mut blind = good;
    blind.probes[2] = ProbeVector::LOST;
    let mut fast = good;
    fast.speed_rpm *= 60.0;
    bench.send(1, Keyphasor::Missing, good);
    assert_says(&bench.watch, 1, Level::Alarm, &["skips", "keyphasor missing", "mark"]);
    bench.send(1, Keyphasor::Unsteady, good);
    assert_says(&bench.watch, 1, Level::Alarm, &["keyphasor unsteady"]);
    bench.send(1, Keyphasor::NotStated, blind);
    assert_says(&bench.watch, 1, Level::Alarm, &["probe 2X gives no value"]);
    bench.send_healthy(1, 1);
    assert_says(&bench.watch, 1, Level::Good, &["tracking"]);
    for _ in 0..3 {
        bench.send(1, Keyphasor::NotStated, fast);
    }
    assert_says(&bench.watch, 1, Level::Alarm, &["3 readings, at 540000 rpm, were not answered", "rejected"]);
    bench.run(2 * SECOND_US);
    assert_eq!(bench.watch.monitor(1).unwrap().counters().unwrap().rejected, 3);
}

#[test]
fn readings_for_nobody_show_an_absent_monitor() {
    let mut bench = Bench::new(&[1]);
    bench.send_healthy(9, 2);
    assert_says(&bench.watch, 9, Level::Alarm, &["absent", "monitor 9", "number"]);
    assert_eq!(bench.watch.monitor(9).unwrap().unanswered(), 2);
}

#[test]
fn a_version_that_means_something_else_is_not_interpreted_and_a_compatible_one_is() {
    let heartbeat = |version| {
        Message::Heartbeat { version, state: NodeState::Tracking, readings: 0, lost: 0, rejected: 0 }
            .encode(1)
    };
    let answer = |oldest| Message::Version { protocol: 9, oldest, model_schema: 1, shapes: 6 }.encode(1);
    let mut watch = Watch::new(None);
    watch.receive(0, &heartbeat(9));
    assert!(watch.monitor(1).is_none(), "one frame of an unknown version may be anything");
    watch.receive(0, &answer(9));
    assert_says(&watch, 1, Level::Alarm, &["version?", "version 9", "update"]);
    watch.receive(0, &answer(PROTOCOL_VERSION));
    assert_says(&watch, 1, Level::Good, &["tracking"]);
}

#[test]
fn traffic_of_another_protocol_is_counted_and_no_monitor() {
    let mut watch = Watch::new(None);
    for id in 0..0x800 {
        watch.receive(0, &Frame::standard(id, &[9; 8]).unwrap());
        watch.receive(0, &Frame::standard(id, &[1, 2]).unwrap());
    }
    assert_eq!(watch.monitors().count(), 0);
    assert_eq!(watch.frames(), 0x1000);
    assert!(watch.foreign() > 0x800, "{}", watch.foreign());
}

#[test]
fn the_history_is_bounded_and_can_be_cleared_and_one_number_alone_can_be_watched() {
    let mut watch = Watch::new(Some(1));
    assert_eq!(watch.questions(), [Message::VersionQuery.encode(1)]);
    for number in 0..HISTORY + 10 {
        let answer = result(number as u16);
        for node in [1, 2] {
            result_frames(node, &answer).iter().for_each(|frame| watch.receive(number as u64, frame));
        }
    }
    assert_eq!(watch.monitors().map(|(node, _)| node).collect::<Vec<_>>(), [1]);
    let history = watch.monitor(1).unwrap().history();
    assert_eq!((history.len(), history[0].what.sequence), (HISTORY, 10));
    watch.clear(1);
    let monitor = watch.monitor(1).unwrap();
    assert!(monitor.history().is_empty());
    assert_eq!(monitor.last().unwrap().what.sequence, HISTORY as u16 + 9);
}

#[test]
fn the_benches_readings_are_what_they_are_called() {
    let mut bench = Bench::new(&[1]);
    bench.run(SECOND_US);
    bench.send_healthy(1, 1);
    assert!(bench.nodes[0].verdict().unwrap().residual.ratio < 1e-3);
    assert_ne!(healthy(&bench.model), faulty(&bench.model));
}
