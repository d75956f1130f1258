//! Everything drawn, for terminals of any size: what matters most goes last when there is less room.
//!
//! | module | holds |
//! |---|---|
//! | [`list`] | the monitors, one a row |
//! | [`numbers`] | unbalance, residual, counters |
//! | [`polar`] | unbalance of the planes with their past |
//! | [`trend`] | residual ratio with its flags |
//!
//! Colours repeat what words and signs say and add nothing.

pub mod list;
pub mod numbers;
pub mod polar;
#[cfg(test)]
mod tests;
pub mod trend;

use std::fmt::Display;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Borders, Paragraph, Wrap};
use rotor_edge_core::model::MAX_PLANES;

use super::Watch;
use super::monitor::Monitor;
use super::screen::Screen;
use super::words::{Level, Words, span};

/// Colour of each plane, wherever it is drawn.
const PLANE_COLOURS: [Color; MAX_PLANES] = [Color::Cyan, Color::Magenta, Color::Yellow, Color::Blue];
const LIST_COLUMNS: u16 = 24;
/// Narrower, and the list and the counters give way.
const LEAST_COLUMNS_WITH_LIST: u16 = 70;
/// Narrower, and the state alone stands above the words.
const LEAST_COLUMNS_WITH_POSITION: u16 = 40;
/// Narrower or lower, and the polar plot gives way to its numbers.
const LEAST_POLAR: (u16, u16) = (24, 9);
const LEAST_TREND_ROWS: u16 = 4;
const WORD_ROWS: u16 = 3;

#[derive(Debug, Clone)]
pub struct WatchedBus {
    /// As `--bus` names it.
    pub bus: String,
    /// Bits a second, for the load.
    pub bit_rate: u32,
}

pub fn draw(frame: &mut Frame, watch: &Watch, screen: &Screen, place: &WatchedBus) {
    let shown = screen.shown(watch);
    let selected = screen.selected(watch);
    let rows = [Constraint::Length(1), Constraint::Min(1), Constraint::Length(1)];
    let [head, body, foot] = frame.area().layout(&Layout::vertical(rows));
    frame.render_widget(header(shown, screen, place), head);
    let detail = if body.width >= LEAST_COLUMNS_WITH_LIST {
        let columns = [Constraint::Length(LIST_COLUMNS), Constraint::Length(1), Constraint::Min(1)];
        let [left, _, right] = body.layout(&Layout::horizontal(columns));
        side(frame, left, shown, selected);
        right
    } else {
        body
    };
    match selected.and_then(|node| shown.monitor(node).map(|monitor| (node, monitor))) {
        Some((node, monitor)) => {
            one(frame, detail, shown, node, monitor);
            if detail == body && body.width >= LEAST_COLUMNS_WITH_POSITION {
                frame.render_widget(position(shown, node), Rect { height: 1, ..detail });
            }
        }
        None => frame.render_widget(nobody(shown, place), detail),
    }
    let help = " q quit   ↑↓ Tab monitor   p pause   r clear its history";
    frame.render_widget(Line::from(help).style(Modifier::DIM), foot);
}

fn header(watch: &Watch, screen: &Screen, place: &WatchedBus) -> Line<'static> {
    let now_us = watch.now_us();
    let percent = 100.0 * watch.load().bits_a_second(now_us) / f64::from(place.bit_rate);
    let mut parts = vec![];
    if screen.is_paused() {
        parts.push(Span::styled(" PAUSED ", Modifier::REVERSED));
    }
    parts.push(Span::styled(format!(" {}", place.bus), Modifier::BOLD));
    parts.push(Span::raw(format!(
        "   load ≤ {percent:.1} % of {} kbit/s   {:.0} frames/s",
        place.bit_rate / 1000,
        watch.load().frames_a_second(now_us)
    )));
    Line::from(parts)
}

fn nobody(watch: &Watch, place: &WatchedBus) -> Paragraph<'static> {
    let (who, number) = match watch.only() {
        Some(node) => (format!("monitor {node}"), format!(" --node {node}")),
        None => ("a monitor".into(), String::new()),
    };
    let text = format!(
        "Nothing was heard of {who} in {}: {} frames, {} of them of another protocol. A monitor sends a heartbeat every \
         second. Is one on this bus, and at this bit rate? `rotor-edge node --bus {}{number}` starts one.",
        span(watch.now_us()),
        watch.frames(),
        watch.foreign(),
        place.bus
    );
    Paragraph::new(text).wrap(Wrap { trim: true })
}

/// The list of monitors, and the counters of the selected one in what room is left.
fn side(frame: &mut Frame, area: Rect, watch: &Watch, selected: Option<u8>) {
    let monitors = watch.monitors().count() as u16;
    let half = area.height / 2;
    let rows = (monitors + 1).clamp(2, half.max(2));
    let [above, below] = area.layout(&Layout::vertical([Constraint::Length(rows), Constraint::Min(0)]));
    list::draw(frame, above, watch, selected);
    if let Some((node, monitor)) = selected.and_then(|n| watch.monitor(n).map(|m| (n, m))) {
        numbers::counters(frame, below, node, monitor);
    }
}

/// One monitor: words first, then plots as far as there is room.
fn one(frame: &mut Frame, area: Rect, watch: &Watch, node: u8, monitor: &Monitor) {
    let words = Words::of(node, monitor, watch.now_us());
    let [above, below] =
        area.layout(&Layout::vertical([Constraint::Length(WORD_ROWS + 1), Constraint::Min(0)]));
    frame.render_widget(sentence(node, &words), above);
    let trend_rows = if below.height >= LEAST_POLAR.1 + LEAST_TREND_ROWS {
        (below.height * 2 / 5).max(LEAST_TREND_ROWS)
    } else {
        0
    };
    let parts = [Constraint::Min(0), Constraint::Length(trend_rows)];
    let [middle, trend] = below.layout(&Layout::vertical(parts));
    trend::draw(frame, trend, monitor);
    let plot_columns = middle.width.saturating_sub(numbers::COLUMNS);
    if middle.height >= LEAST_POLAR.1 && plot_columns >= LEAST_POLAR.0 {
        let columns = [Constraint::Min(0), Constraint::Length(numbers::COLUMNS)];
        let [plot, beside] = middle.layout(&Layout::horizontal(columns));
        polar::draw(frame, plot, monitor);
        numbers::draw(frame, beside, monitor, watch.now_us());
    } else {
        numbers::draw(frame, middle, monitor, watch.now_us());
    }
}

/// Which of how many, where there is no list.
fn position(watch: &Watch, node: u8) -> Line<'static> {
    let before = watch.monitors().take_while(|(number, _)| *number != node).count();
    match watch.monitors().count() {
        1 => Line::default(),
        all => Line::from(format!(" {} of {all}", before + 1)).right_aligned(),
    }
}

fn sentence(node: u8, words: &Words) -> Paragraph<'static> {
    let title = format!("Monitor {node}: {}", words.short);
    let mut lines = vec![Line::from(words.state.clone()).style(Modifier::BOLD)];
    if !words.next.is_empty() {
        lines.push(Line::from(format!("→ {}", words.next)));
    }
    Paragraph::new(lines).wrap(Wrap { trim: true }).block(titled(title).title_style(style(words.level)))
}

/// A line with a title above something.
fn titled(title: impl Display) -> Block<'static> {
    Block::new().borders(Borders::TOP).border_style(Modifier::DIM).title(format!(" {title} "))
}

fn style(level: Level) -> Style {
    match level {
        Level::Good => Style::new().fg(Color::Green),
        Level::Idle => Style::new(),
        Level::Attention => Style::new().fg(Color::Yellow),
        Level::Alarm => Style::new().fg(Color::Red).add_modifier(Modifier::BOLD),
    }
}
