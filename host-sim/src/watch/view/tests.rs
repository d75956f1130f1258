use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::buffer::Buffer;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use rotor_edge_core::can::{
    FLAG_FLAGGED, FLAG_SUSPICIOUS, Message, MonitorResult, PROTOCOL_VERSION, result_frames,
};
use rotor_edge_core::state::{NodeState, Reason, Status};

use super::*;
use crate::watch::screen::Flow;
use crate::watch::testing::{Bench, plain_result};

const SECOND_US: u64 = 1_000_000;

fn buffer(watch: &Watch, screen: &Screen, columns: u16, rows: u16) -> Buffer {
    let mut terminal = Terminal::new(TestBackend::new(columns, rows)).unwrap();
    let place = WatchedBus { bus: "slcan:127.0.0.1:29537".into(), bit_rate: 500_000 };
    terminal.draw(|frame| draw(frame, watch, screen, &place)).unwrap();
    terminal.backend().buffer().clone()
}

/// Signs alone, a string a row: what is left where nobody sees colours.
fn lines(watch: &Watch, screen: &Screen, columns: u16, rows: u16) -> Vec<String> {
    let buffer = buffer(watch, screen, columns, rows);
    let row = |y| (0..columns).map(|x| buffer[(x, y)].symbol()).collect();
    (0..rows).map(row).collect()
}

fn text(watch: &Watch, columns: u16, rows: u16) -> String {
    lines(watch, &Screen::default(), columns, rows).join("\n")
}

#[track_caller]
fn assert_shows(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "\"{part}\" is missing in:\n{text}");
    }
}

/// A result, and what its monitor then says of itself.
fn hear(watch: &mut Watch, node: u8, result: &MonitorResult) {
    result_frames(node, result).iter().for_each(|frame| watch.receive(0, frame));
    let is_flagged = result.flags & FLAG_FLAGGED != 0;
    let (state, cause) =
        if is_flagged { (NodeState::Flagged, Reason::Ratio) } else { (NodeState::Tracking, Reason::None) };
    let status = Status { state, cause, suspect: result.suspect, ..Status::default() };
    watch.receive(0, &Message::State(status).encode(node));
}

fn result(sequence: u16, [[a, b], [c, d]]: [[f32; 2]; 2]) -> MonitorResult {
    MonitorResult {
        unbalance_g_mm: [[a, b], [c, d], [0.0; 2], [0.0; 2]],
        static_g_mm: [a + c, b + d],
        dynamic_g_mm: [(a - c) / 2.0, (b - d) / 2.0],
        e_um: 1.5,
        ratio: 0.05,
        ..plain_result(sequence, 2)
    }
}

fn flagged(sequence: u16) -> MonitorResult {
    MonitorResult {
        flags: FLAG_FLAGGED | FLAG_SUSPICIOUS,
        suspect: Some(1),
        streak: 3,
        ratio: 0.4,
        ..result(sequence, [[500.0, 0.0], [0.0, 300.0]])
    }
}

fn heartbeat(state: NodeState) -> Message {
    let version = PROTOCOL_VERSION;
    Message::Heartbeat { version, state, reason: Reason::None, missing_mask: 0, readings: 7 }
}

fn press(code: KeyCode) -> KeyEvent {
    KeyEvent::new(code, KeyModifiers::NONE)
}

#[test]
fn at_80_by_24_everything_is_in_sight() {
    let mut bench = Bench::new(&[1, 3]);
    bench.run(SECOND_US);
    bench.send_healthy(1, 12);
    bench.send_faulty(1, 4);
    bench.run(SECOND_US);
    let text = text(&bench.watch, 80, 24);
    let lines: Vec<&str> = text.lines().collect();
    assert_shows(lines[0], &["slcan:127.0.0.1:29537", "load ≤ ", "% of 500 kbit/s", "frames/s"]);
    assert_shows(
        &text,
        &["Monitors (2)", "▶ 1 FLAGGED", " 3 waiting", "Counters of 1", "readings            16"],
    );
    assert_shows(
        &text,
        &["Monitor 1: FLAGGED", "the probes of one bearing alone", "suspect", "`rotor-edge improve`"],
    );
    assert_shows(&text, &["Unbalance ↺ rotation", "0°", "90°", "180°", "-90°"]);
    assert_shows(
        &text,
        &["plane 1 ", "plane 2 ", "static ", "dynamic 1 ", "residual ", "9,000 rpm", "protocol  3, 6 shapes"],
    );
    assert_shows(&text, &["Residual %, 16 readings in 1.5 s", "s high F flag"]);
    assert_shows(lines[23], &["q quit", "↑↓ Tab monitor", "p pause", "r clear its history"]);
}

/// Where the numbers of both planes stand, and where the middle of the plot is, in cells.
fn places(text: &str) -> ([(usize, usize); 2], (usize, usize)) {
    let rows: Vec<Vec<char>> = text.lines().map(|line| line.chars().collect()).collect();
    let part_of_number =
        |sign: Option<&char>| sign.is_some_and(|c| c.is_ascii_digit() || [',', '-'].contains(c));
    let find = |what: &str| {
        let what: Vec<char> = what.chars().collect();
        let stands_alone = |row: &[char], x: usize| {
            row[x..].starts_with(&what)
                && !part_of_number(row.get(x - 1))
                && !part_of_number(row.get(x + what.len()))
        };
        // between the titles of this plot and of the next, left of the numbers
        let mut plot = rows.iter().enumerate().skip(6).take(20);
        let found = plot.find_map(|(y, row)| (25..68).find(|x| stands_alone(row, *x)).map(|x| (x, y)));
        found.unwrap_or_else(|| panic!("{what:?} is missing in:\n{text}"))
    };
    let (top, right) = (find("90°"), find("0°"));
    ([find("1"), find("2")], (top.0 + 1, right.1))
}

#[test]
fn angles_grow_counter_clockwise_from_the_right() {
    // plane 1 along x, plane 2 along y: heavy at 0° and at 90°
    for (vectors, steps) in [
        ([[900.0, 0.0], [0.0, 900.0]], [(1, 0), (0, -1)]),
        ([[-900.0, 0.0], [0.0, -900.0]], [(-1, 0), (0, 1)]),
    ] {
        let mut watch = Watch::new(None);
        hear(&mut watch, 1, &result(1, vectors));
        let text = text(&watch, 100, 40);
        let (tips, centre) = places(&text);
        for ((x, y), (right, down)) in tips.into_iter().zip(steps) {
            let from_centre = (x as isize - centre.0 as isize, y as isize - centre.1 as isize);
            let sign = |d: isize| if d.abs() <= 3 { 0 } else { d.signum() };
            assert_eq!((sign(from_centre.0), sign(from_centre.1)), (right, down), "{text}");
        }
    }
}

#[test]
fn flags_stand_below_the_readings_that_raised_them() {
    let mut watch = Watch::new(None);
    for sequence in 0..100 {
        let well = result(sequence, [[500.0, 0.0], [0.0, 300.0]]);
        let suspicious = MonitorResult { flags: FLAG_SUSPICIOUS, ..well };
        hear(
            &mut watch,
            1,
            &[well, suspicious, flagged(sequence)][usize::from(sequence / 50 + sequence / 75)],
        );
    }
    let lines = lines(&watch, &Screen::default(), 80, 24);
    let marks: String = lines[22].chars().skip(31).collect();
    assert_eq!(marks.chars().count(), 49);
    let (clear, rest) = marks.split_at(marks.find('s').unwrap());
    let suspicious = rest.find('F').unwrap();
    // half, a quarter and a quarter of 49 columns
    assert_eq!(clear.trim(), "");
    assert!((24..=25).contains(&clear.len()), "{marks}");
    assert!((11..=13).contains(&suspicious), "{marks}");
    assert_eq!(&rest[suspicious..], "F".repeat(rest.len() - suspicious));
}

#[test]
fn thirty_monitors_fit_and_the_selected_one_is_in_sight() {
    let mut watch = Watch::new(None);
    for node in 0..30 {
        watch.receive(0, &heartbeat(NodeState::Waiting).encode(node));
    }
    let mut screen = Screen::default();
    for node in 0..60_u8 {
        let text = lines(&watch, &screen, 80, 24).join("\n");
        assert_shows(
            &text,
            &["Monitors (30)", &format!("▶{:>2} waiting", node % 30), &format!("Monitor {}: ", node % 30)],
        );
        assert_eq!(screen.key(&mut watch, press(KeyCode::Tab)), Flow::Go);
    }
    screen.key(&mut watch, press(KeyCode::Up));
    assert_eq!(screen.selected(&watch), Some(29), "back over the first");
    assert_shows(&lines(&watch, &screen, 60, 20).join("\n"), &["30 of 30", "Monitor 29"]);
}

#[test]
fn a_pause_holds_the_picture_while_listening_goes_on() {
    let mut watch = Watch::new(None);
    let mut screen = Screen::default();
    hear(&mut watch, 1, &result(41, [[1.0, 0.0], [0.0, 1.0]]));
    screen.key(&mut watch, press(KeyCode::Char('p')));
    hear(&mut watch, 1, &flagged(42));
    let paused = lines(&watch, &screen, 80, 24).join("\n");
    assert_shows(&paused, &[" PAUSED ", "Reading 41", "tracking"]);
    screen.key(&mut watch, press(KeyCode::Char('p')));
    let text = lines(&watch, &screen, 80, 24).join("\n");
    assert_shows(&text, &["Reading 42", "FLAGGED", "Residual %, 2 readings"]);
    assert!(!text.contains("PAUSED"));
}

#[test]
fn keys_clear_and_leave_and_their_release_does_nothing() {
    let mut watch = Watch::new(None);
    let mut screen = Screen::default();
    hear(&mut watch, 1, &flagged(41));
    let released = KeyEvent { kind: KeyEventKind::Release, ..press(KeyCode::Char('q')) };
    assert_eq!(screen.key(&mut watch, released), Flow::Go);
    assert_eq!(screen.key(&mut watch, press(KeyCode::Char('r'))), Flow::Go);
    assert!(watch.monitor(1).unwrap().history().is_empty());
    assert_shows(&lines(&watch, &screen, 80, 24).join("\n"), &["FLAGGED", "no result yet", "Reading 41"]);
    assert_eq!(screen.key(&mut watch, press(KeyCode::Char('q'))), Flow::Quit);
    let interrupt = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
    assert_eq!(screen.key(&mut watch, interrupt), Flow::Quit);
    assert_eq!(screen.key(&mut watch, press(KeyCode::Char('c'))), Flow::Go);
}

#[test]
fn a_silent_bus_says_what_to_do() {
    let mut watch = Watch::new(Some(4));
    watch.pass(7 * SECOND_US);
    let text = text(&watch, 80, 24);
    assert_shows(&text, &["Nothing was heard of monitor 4 in 7.0 s: 0 frames", "rotor-edge node --bus"]);
}

#[test]
fn nonzero_counters_stay_when_space_is_short() {
    let mut watch = Watch::new(None);
    for node in 1..9 {
        watch.receive(0, &heartbeat(NodeState::Tracking).encode(node));
        watch.receive(0, &Message::Counters { pair: 0, values: [3, 0] }.encode(node));
    }
    let text = text(&watch, 80, 20);
    assert_shows(&text, &["readings             7", "lost                 3", "20 others are 0"]);
    assert!(!text.contains("rejected"));
}

#[test]
fn no_size_and_no_number_makes_it_panic() {
    let mut watches = vec![Watch::new(None)];
    let mut one = Watch::new(None);
    hear(&mut one, 1, &flagged(0));
    watches.push(one.clone());
    for value in [f32::NAN, f32::INFINITY, f32::MAX, f32::MIN_POSITIVE, 0.0, -1.0] {
        let odd = MonitorResult { e_um: value, ratio: value, ..result(1, [[value, 1.0], [value; 2]]) };
        let mut watch = Watch::new(None);
        hear(&mut watch, 1, &odd);
        watches.push(watch);
        hear(&mut one, 1, &odd);
    }
    watches.push(one);
    let mut many = Watch::new(None);
    for node in 0..=30 {
        many.receive(0, &heartbeat(NodeState::Blind).encode(node));
        (0..50).for_each(|sequence| hear(&mut many, node, &flagged(sequence)));
    }
    watches.push(many);
    for watch in &watches {
        for columns in (1..=200).step_by(17).chain([20, 80, 200]) {
            for rows in (1..=60).step_by(5).chain([5, 24, 60]) {
                buffer(watch, &Screen::default(), columns, rows);
            }
        }
    }
}

#[test]
fn the_smallest_picture_still_names_monitor_and_state() {
    let mut watch = Watch::new(None);
    hear(&mut watch, 1, &flagged(0));
    assert_shows(&text(&watch, 20, 5), &["Monitor 1: FLAGGED", "the residual", "q quit"]);
}
