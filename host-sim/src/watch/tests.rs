use rotor_edge_core::can::{
    Frame, Keyphasor, Message, MonitorResult, PROTOCOL_VERSION, flag_at_bound, result_frames,
};
use rotor_edge_core::model::{Description, MAX_PLANES, MODEL_SCHEMA};
use rotor_edge_core::node::NodeConfig;
use rotor_edge_core::reading::MAX_PROBES;
use rotor_edge_core::state::{NodeState, Reason};

use super::monitor::{HISTORY, Replacement, Version};
use super::testing::{Bench, faulty, healthy, plain_result, told};
use super::words::{Level, Words};
use super::*;
use crate::bus::numbers::bearing_number;
use crate::edge::{EdgeModel, EdgeNode, SHAPES};

const SECOND_US: u64 = 1_000_000;

fn words(watch: &Watch, node: u8) -> Words {
    Words::of(node, watch.monitor(node).unwrap(), watch.now_us())
}

fn heartbeat(version: u8, state: NodeState) -> Message {
    Message::Heartbeat { version, state, reason: Reason::None, missing_mask: 0, readings: 0 }
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
    plain_result(sequence, 2)
}

#[test]
fn monitor_is_known_by_heartbeat_and_answers_version_query() {
    let mut bench = Bench::new(&[4]);
    bench.run(SECOND_US);
    let found: Vec<u8> = bench.watch.monitors().map(|(node, _)| node).collect();
    assert_eq!(found, [4]);
    let monitor = bench.watch.monitor(4).unwrap();
    assert_eq!(monitor.state(), Some(NodeState::Waiting));
    let version = monitor.version().unwrap();
    let expected = Version {
        protocol: PROTOCOL_VERSION,
        oldest: version.oldest,
        model_schema: MODEL_SCHEMA as u8,
        shapes: SHAPES as u8,
        probes: MAX_PROBES as u8,
        planes: MAX_PLANES as u8,
    };
    assert_eq!(version, expected);
    assert_eq!(monitor.counters(), Some(&bench.nodes[0].counters()));
    let model = monitor.model().unwrap();
    assert_eq!((model.checksum, model.probes, model.planes), (bench.model.checksum(), 4, 2));
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
    let heartbeat = heartbeat(PROTOCOL_VERSION, NodeState::Waiting);
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
fn lasting_residual_is_flagged_until_it_falls() {
    let mut bench = Bench::new(&[1]);
    bench.run(SECOND_US);
    bench.send_healthy(1, 10);
    bench.send_faulty(1, 1);
    assert_says(&bench.watch, 1, Level::Attention, &["suspicious", "the residual", "for 1 reading", "wait"]);
    assert!(bench.watch.monitor(1).unwrap().flagged().is_empty());
    bench.send_faulty(1, 4);
    let suspect = bench.nodes[0].verdict().unwrap().suspect.unwrap();
    let suspect_words = format!("suspect bearing {}", bearing_number(suspect));
    let next = ["record a run-up", "rotor-edge improve", "then `rotor-edge acknowledge --node 1`"];
    assert_says(&bench.watch, 1, Level::Alarm, &["FLAGGED", "the residual", &suspect_words]);
    assert_says(&bench.watch, 1, Level::Alarm, &next);
    let stretches = bench.watch.monitor(1).unwrap().flagged();
    // the third of a streak raises the flag
    assert_eq!((stretches[0].first.what, stretches[0].last.what), (12, 14));
    assert!(stretches[0].lasts);
    assert_eq!(stretches[0].suspect, Some(suspect));
    bench.send_healthy(1, 20);
    let stretches = bench.watch.monitor(1).unwrap().flagged();
    assert_eq!(stretches.len(), 1);
    assert!(!stretches[0].lasts);
    // nobody acknowledged it
    assert_says(&bench.watch, 1, Level::Alarm, &["FLAGGED", &suspect_words]);
    bench.send_faulty(1, 3);
    assert_eq!(bench.watch.monitor(1).unwrap().flagged().len(), 2);
}

#[test]
fn growth_at_the_bound_counts_when_it_is_no_coincidence() {
    let at_bound = MonitorResult { flags: flag_at_bound(0) | flag_at_bound(2), ..plain_result(0, 3) };
    for (number, says) in
        [(2, "describes the machine → "), (3, "planes 1 and 3 grow as fast as they may → if it goes on")]
    {
        let mut watch = Watch::new(None);
        watch.receive(0, &told(NodeState::Tracking, Reason::None).encode(1));
        for sequence in 0..number {
            let frames = result_frames(1, &MonitorResult { sequence, ..at_bound });
            frames.iter().for_each(|frame| watch.receive(0, frame));
        }
        let words = words(&watch, 1);
        assert!(format!("{} → {}", words.state, words.next).contains(says), "{number}: {words:?}");
        result_frames(1, &result(3)).iter().for_each(|frame| watch.receive(0, frame));
        assert_eq!(watch.monitor(1).unwrap().at_bound(), [0; 4]);
    }
}

#[test]
fn every_state_has_words_and_says_what_to_do() {
    let cases = [
        (NodeState::Waiting, Reason::NoReading, Level::Idle, ["waiting", "send readings"]),
        (NodeState::Learning, Reason::Learning, Level::Idle, ["learning", "reference"]),
        (NodeState::Listening, Reason::None, Level::Idle, ["starting", "listens"]),
        (NodeState::Tracking, Reason::None, Level::Good, ["tracking", "describes the machine"]),
        (NodeState::Tracking, Reason::Gap, Level::Attention, ["gap range", "check the gap voltage"]),
        (NodeState::Suspicious, Reason::Ratio, Level::Attention, ["suspicious", "wait for more"]),
        (NodeState::Blind, Reason::Keyphasor, Level::Alarm, ["BLIND", "keyphasor"]),
        (NodeState::Blind, Reason::NoRedundancy, Level::Alarm, ["any machine would fit", "check the probe"]),
        (NodeState::Stale, Reason::Age, Level::Alarm, ["STALE", "last judged 0.5 s ago"]),
        (NodeState::NoModel, Reason::Schema, Level::Alarm, ["NO MODEL", "rotor-edge deploy"]),
        (NodeState::Conflict, Reason::NumberInUse, Level::Alarm, ["CONFLICT", "another number"]),
        (NodeState::Flagged, Reason::Probes, Level::Alarm, ["FLAGGED", "acknowledge --node 1"]),
    ];
    for (state, reason, level, parts) in cases {
        let mut watch = Watch::new(None);
        watch.receive(0, &heartbeat(PROTOCOL_VERSION, state).encode(1));
        watch.receive(0, &told(state, reason).encode(1));
        assert_says(&watch, 1, level, &parts);
        assert!(words(&watch, 1).short.chars().count() <= 10);
    }
    assert!(NodeState::ALL.iter().all(|state| cases.iter().any(|case| case.0 == *state)));
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
    bench.nodes.pop();
    bench.run(8 * SECOND_US);
    bench.send_healthy(5, 2);
    bench.run(SECOND_US);
    assert_says(&bench.watch, 5, Level::Idle, &["learning"]);
    assert!(bench.watch.monitor(5).unwrap().counters().unwrap().conflicts > 0);
}

#[test]
fn a_replaced_model_is_noticed_with_its_time() {
    let mut bench = Bench::new(&[1]);
    bench.run(2 * SECOND_US);
    let description = bench.model.description();
    let mut supports = description.supports.to_vec();
    supports[0].mass_kg += 1.0;
    let better = EdgeModel::new(&Description { supports: &supports, ..description }).unwrap();
    let (from, to) = (bench.model.checksum(), better.checksum());
    bench.nodes[0].replace_model(bench.watch.now_us(), better).unwrap();
    let replaced_us = bench.watch.now_us();
    bench.run(3 * SECOND_US);
    let seen: Vec<_> = bench.watch.monitor(1).unwrap().replacements().copied().collect();
    assert_eq!(seen.len(), 1);
    assert_eq!(seen[0].what, Replacement { from, to });
    assert!((replaced_us..=replaced_us + SECOND_US).contains(&seen[0].time_us));
}

#[test]
fn result_with_missing_or_altered_frame_is_damaged() {
    let mut watch = Watch::new(None);
    let frames = result_frames(1, &result(7));
    frames.iter().for_each(|frame| watch.receive(0, frame));
    for missing in 1..7 {
        let others = frames.iter().enumerate().filter(|(i, _)| *i != missing);
        others.for_each(|(_, frame)| watch.receive(0, frame));
    }
    let altered = Message::Residual { e_um: 1.0, ratio: 0.2 }.encode(1);
    assert_ne!(altered, frames[5]);
    let rest = [&frames[..5], &[altered], &frames[6..]].concat();
    rest.iter().for_each(|frame| watch.receive(0, frame));
    let monitor = watch.monitor(1).unwrap();
    assert_eq!((monitor.damaged(), monitor.history().len()), (7, 1));
}

#[test]
fn readings_that_cannot_be_judged_are_explained() {
    let mut bench = Bench::new(&[1]);
    bench.run(SECOND_US);
    let good = healthy(&bench.model);
    let (mut without_one, mut without_two, mut fast) = (good, good, good);
    without_one.lose(0b100);
    without_two.lose(0b101);
    fast.speed_rpm *= 60.0;
    bench.send(1, Keyphasor::Missing, good);
    assert_says(&bench.watch, 1, Level::Alarm, &["BLIND", "keyphasor", "mark", "nothing judged"]);
    bench.send_healthy(1, 12);
    assert_says(&bench.watch, 1, Level::Good, &["tracking"]);
    bench.send(1, Keyphasor::NotStated, without_one);
    let says = ["tracking", "but probe 3 gives no value", "check the probe"];
    assert_says(&bench.watch, 1, Level::Attention, &says);
    bench.send(1, Keyphasor::NotStated, without_two);
    assert_says(&bench.watch, 1, Level::Alarm, &["BLIND", "any machine would fit", "last judged 0."]);
    bench.send(1, Keyphasor::NotStated, fast);
    assert_says(&bench.watch, 1, Level::Alarm, &["BLIND", "the speed is outside the range"]);
    bench.run(15 * SECOND_US);
    assert_says(&bench.watch, 1, Level::Alarm, &["STALE", "last judged 15 s ago"]);
    assert_eq!(bench.watch.monitor(1).unwrap().counters().unwrap().rejected, 1);
}

#[test]
fn monitor_without_model_says_one_must_be_deployed() {
    let mut bench = Bench::new(&[1]);
    bench.nodes[0] = EdgeNode::new(NodeConfig::new(1)).unwrap();
    bench.run(SECOND_US);
    bench.send_healthy(1, 2);
    assert_says(&bench.watch, 1, Level::Alarm, &["NO MODEL", "no model was deployed", "rotor-edge deploy"]);
    assert_eq!(bench.watch.monitor(1).unwrap().model(), None);
}

#[test]
fn readings_for_nobody_show_an_absent_monitor() {
    let mut bench = Bench::new(&[1]);
    bench.send_healthy(9, 2);
    assert_says(&bench.watch, 9, Level::Alarm, &["absent", "monitor 9", "number"]);
    assert_eq!(bench.watch.monitor(9).unwrap().unanswered(), 2);
}

#[test]
fn incompatible_version_is_not_interpreted() {
    let answer = |oldest| {
        Message::Version { protocol: 9, oldest, model_schema: 1, shapes: 6, probes: 4, planes: 2 }.encode(1)
    };
    let mut watch = Watch::new(None);
    watch.receive(0, &heartbeat(9, NodeState::Tracking).encode(1));
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
        watch.receive(0, &Frame::standard(id, &[0xee; 8]).unwrap());
        watch.receive(0, &Frame::standard(id, &[1, 2]).unwrap());
    }
    assert_eq!(watch.monitors().count(), 0);
    assert_eq!(watch.frames(), 0x1000);
    assert!(watch.foreign() > 0x800, "{}", watch.foreign());
}

#[test]
fn history_is_bounded_clearable_and_filtered_by_number() {
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
