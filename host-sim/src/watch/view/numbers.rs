//! The last result in numbers, and the counters.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;
use rotor_edge_core::can::{Keyphasor, MonitorResult};

use super::list::percent;
use super::{PLANE_COLOURS, titled};
use crate::bus::decoded::Timed;
use crate::bus::numbers::bearing_number;
use crate::scale::{number, three_digits};
use crate::watch::monitor::{ModelInUse, Monitor, Replacement};
use crate::watch::words::span;

/// Room for the numbers of a result.
pub const COLUMNS: u16 = 30;
const COUNTER_COLUMNS: usize = 15;

/// Draws the last result, and where it comes from.
pub fn draw(frame: &mut Frame, area: Rect, monitor: &Monitor, now_us: u64) {
    let mut lines = vec![];
    if let Some(last) = monitor.last() {
        lines.extend(result(&last.what));
    }
    if let Some(reading) = monitor.reading() {
        let reading = &reading.what;
        let keyphasor = match reading.keyphasor {
            Keyphasor::NotStated | Keyphasor::Locked => "",
            Keyphasor::Missing => ", no mark",
            Keyphasor::Unsteady => ", unsteady",
        };
        let speed = number(f64::from(reading.reading.speed_rpm), 0);
        lines.push(entry("speed", format!("{speed} rpm{keyphasor}")));
        lines.extend(gaps(reading.reading.gaps_v()));
    }
    if let Some(last) = monitor.last() {
        let rate = monitor.readings_a_second(now_us);
        let rate = rate.map_or(String::new(), |rate| format!("{}/s, ", three_digits(rate)));
        let age = span(now_us.saturating_sub(last.time_us));
        lines.push(entry("results", format!("{rate}{age} ago")));
    }
    if let Some(in_use) = monitor.model() {
        lines.push(entry("model", model(&in_use, monitor.replacements().last(), now_us)));
    }
    if let Some(version) = monitor.version() {
        let text = format!("{}, {} shapes", version.protocol, version.shapes);
        lines.push(entry("protocol", text));
    }
    let title = match monitor.last() {
        Some(last) => format!("Reading {}", last.what.sequence),
        None => "No result yet".into(),
    };
    frame.render_widget(Paragraph::new(lines).block(titled(title)), area);
}

/// Gap voltages, four a row; nothing if none is stated.
fn gaps(gaps_v: &[f32]) -> Vec<Line<'static>> {
    if gaps_v.iter().all(|gap_v| gap_v.is_nan()) {
        return vec![];
    }
    let volts = |gap_v: &f32| if gap_v.is_nan() { "    –".into() } else { format!("{gap_v:>5.1}") };
    let row = |four: &[f32]| entry("gaps, V", four.iter().map(volts).collect());
    gaps_v.chunks(4).map(row).collect()
}

fn result(last: &MonitorResult) -> Vec<Line<'static>> {
    let planes = (1..=last.planes).zip(last.unbalance_g_mm).zip(PLANE_COLOURS);
    let plane = |((number, vector), colour)| {
        entry(&format!("plane {number}"), unbalance(vector)).style(Style::new().fg(colour))
    };
    let mut lines: Vec<_> = planes.map(plane).collect();
    lines.push(entry("static", unbalance(last.static_g_mm)));
    if last.planes <= 2 {
        lines.push(entry("dynamic 1", unbalance(last.dynamic_g_mm)));
    }
    let suspect = match last.suspect {
        Some(bearing) => format!(", bearing {}", bearing_number(bearing)),
        None => String::new(),
    };
    let residual = three_digits(f64::from(last.e_um));
    lines.push(entry("residual", format!("{residual} µm 0-pk, {}", percent(last.ratio))));
    lines.push(entry("high for", format!("{}{suspect}", last.streak)));
    lines
}

fn unbalance([x, y]: [f32; 2]) -> String {
    let size = f64::from(x).hypot(f64::from(y));
    let angle_deg = f64::from(y).atan2(f64::from(x)).to_degrees();
    match size {
        0.0 => "0".into(),
        size if size.is_finite() => format!("{:>6} g·mm {angle_deg:>6.1}°", three_digits(size)),
        _ => "not a number".into(),
    }
}

fn model(in_use: &ModelInUse, replaced: Option<&Timed<Replacement>>, now_us: u64) -> String {
    let checksum = in_use.checksum;
    match replaced {
        _ if in_use.on_trial => format!("{checksum:08x}, on trial"),
        Some(timed) => format!("{checksum:08x}, new {} ago", span(now_us.saturating_sub(timed.time_us))),
        None => format!("{checksum:08x}"),
    }
}

fn entry(name: &str, value: String) -> Line<'static> {
    Line::from(vec![Span::styled(format!("{name:<10}"), Modifier::DIM), Span::raw(value)])
}

/// Draws the counters: all if there is room, else those that are not zero.
pub fn counters(frame: &mut Frame, area: Rect, node: u8, monitor: &Monitor) {
    let Some(totals) = monitor.totals() else { return };
    let of_commands = ["accepted", "refused", "forged", "replayed", "broken"];
    let all: Vec<(String, u64)> = totals
        .named()
        .map(|(name, n)| (if of_commands.contains(&name) { format!("cmd {name}") } else { name.into() }, n))
        .chain([("damaged results".into(), u64::from(monitor.damaged()))])
        .collect();
    let rows = usize::from(area.height.saturating_sub(1));
    let row = |(name, number): (String, u64)| Line::from(format!("{name:<COUNTER_COLUMNS$}{number:>7}"));
    let mut lines: Vec<Line> = if all.len() <= rows {
        all.into_iter().map(row).collect()
    } else {
        let (zeros, some): (Vec<_>, Vec<_>) = all.into_iter().partition(|(_, number)| *number == 0);
        let rest = (!zeros.is_empty()).then(|| Line::from(format!("{} others are 0", zeros.len())));
        some.into_iter().map(row).chain(rest).collect()
    };
    lines.truncate(rows);
    frame.render_widget(Paragraph::new(lines).block(titled(format!("Counters of {node}"))), area);
}
