//! The residual's part of the features over the last readings, with what the monitor made of each.

use std::collections::VecDeque;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line as Text, Span};
use ratatui::widgets::Paragraph;
use ratatui::widgets::canvas::{Canvas, Line, Points};
use rotor_edge_core::can::{FLAG_FLAGGED, FLAG_SUSPICIOUS, MonitorResult};

use super::titled;
use crate::bus::decoded::Timed;
use crate::scale::Scale;
use crate::watch::monitor::Monitor;
use crate::watch::words::span;

const LABEL_COLUMNS: u16 = 6;
/// How finely the upper end is rounded.
const TICKS: usize = 4;
/// More than this is drawn at the upper edge: then nothing was measured to speak of.
const MOST_PERCENT: f64 = 1_000.0;

/// Draws the trend: the curve, and below it a sign for each column that is not well.
pub fn draw(frame: &mut Frame, area: Rect, monitor: &Monitor) {
    let history = monitor.history();
    let (Some(first), Some(last)) = (history.front(), history.back()) else {
        return frame.render_widget(titled("Residual, % of the features"), area);
    };
    let title = match history.len() {
        1 => "Residual %, 1 reading".into(),
        number => format!("Residual %, {number} readings in {}", span(last.time_us - first.time_us)),
    };
    let block = titled(title).title(Text::from(" s high F flag ").right_aligned());
    let inner = block.inner(area);
    frame.render_widget(block, area);
    let parts = [Constraint::Length(LABEL_COLUMNS), Constraint::Min(0)];
    let [labels, right] = inner.layout(&Layout::horizontal(parts));
    let [plot, signs] = right.layout(&Layout::vertical([Constraint::Min(0), Constraint::Length(1)]));
    let percents: Vec<f64> = history.iter().map(|timed| percent(&timed.what)).collect();
    let scale = Scale::from_zero(percents.iter().copied(), TICKS);
    axis(frame, Rect { height: plot.height, ..labels }, &scale);
    let most = (history.len() - 1).max(1) as f64;
    let canvas =
        Canvas::default().marker(Marker::Braille).x_bounds([0.0, most]).y_bounds([0.0, scale.to]).paint(
            |plot| {
                plot.draw(&Points { coords: &[(0.0, percents[0])], color: colour(&first.what) });
                for (at, pair) in percents.windows(2).enumerate() {
                    let color = colour(&history[at + 1].what);
                    let [x1, x2] = [at, at + 1].map(|x| x as f64);
                    plot.draw(&Line { x1, y1: pair[0], x2, y2: pair[1], color });
                }
            },
        );
    frame.render_widget(canvas, plot);
    frame.render_widget(Text::from(marks(history, signs.width)), signs);
}

fn percent(result: &MonitorResult) -> f64 {
    let percent = 100.0 * f64::from(result.ratio);
    if percent.is_nan() { MOST_PERCENT } else { percent.clamp(0.0, MOST_PERCENT) }
}

fn axis(frame: &mut Frame, area: Rect, scale: &Scale) {
    let rows = usize::from(area.height);
    let mut lines = vec![Text::default(); rows];
    if let Some(top) = lines.first_mut() {
        *top = Text::from(format!("{:>5}", scale.label(scale.to)));
    }
    if rows > 1 {
        lines[rows - 1] = Text::from(format!("{:>5}", 0));
    }
    frame.render_widget(Paragraph::new(lines), area);
}

/// A sign for each column: the worst of its readings.
fn marks(history: &VecDeque<Timed<MonitorResult>>, columns: u16) -> Vec<Span<'static>> {
    let readings = history.len();
    let columns = usize::from(columns);
    let at = |column: usize| column * (readings - 1) / (columns - 1).max(1);
    let worst = |column: usize| {
        let range = at(column)..=at((column + 1).min(columns - 1)).saturating_sub(1).max(at(column));
        history
            .range(range)
            .map(|timed| timed.what.flags & (FLAG_FLAGGED | FLAG_SUSPICIOUS))
            .fold(0, |a, b| a | b)
    };
    let mark = |flags: u8| match flags {
        0 => Span::raw(" "),
        FLAG_SUSPICIOUS => Span::styled("s", Style::new().fg(Color::Yellow)),
        _ => Span::styled("F", Style::new().fg(Color::Red)),
    };
    (0..columns).map(|column| mark(worst(column))).collect()
}

fn colour(result: &MonitorResult) -> Color {
    match result.flags & (FLAG_FLAGGED | FLAG_SUSPICIOUS) {
        0 => Color::Green,
        FLAG_SUSPICIOUS => Color::Yellow,
        _ => Color::Red,
    }
}
