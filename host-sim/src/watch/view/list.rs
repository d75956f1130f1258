//! The monitors, one a row: number, state, ratio of the residual.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Modifier;
use ratatui::text::{Line, Span};
use ratatui::widgets::{List, ListItem, ListState};

use super::{style, titled};
use crate::watch::Watch;
use crate::watch::monitor::Monitor;
use crate::watch::words::Words;

/// Draws the list; the selected one is in sight, however many there are.
pub fn draw(frame: &mut Frame, area: Rect, watch: &Watch, selected: Option<u8>) {
    let nodes: Vec<u8> = watch.monitors().map(|(node, _)| node).collect();
    let items = watch.monitors().map(|(node, monitor)| ListItem::new(row(watch, node, monitor)));
    let list = List::new(items.collect::<Vec<_>>())
        .block(titled(format!("Monitors ({})", nodes.len())))
        .highlight_symbol("▶")
        .highlight_style(Modifier::BOLD);
    let at = nodes.iter().position(|node| Some(*node) == selected);
    frame.render_stateful_widget(list, area, &mut ListState::default().with_selected(at));
}

fn row(watch: &Watch, node: u8, monitor: &Monitor) -> Line<'static> {
    let words = Words::of(node, monitor, watch.now_us());
    let ratio = monitor.last().map_or(String::new(), |last| percent(last.what.ratio));
    Line::from(vec![
        Span::raw(format!("{node:>2} ")),
        Span::styled(format!("{:<11}", words.short), style(words.level)),
        Span::raw(format!("{ratio:>7}")),
    ])
}

/// A ratio; beyond 1,000 % the number says nothing any more.
pub(super) fn percent(ratio: f32) -> String {
    match 100.0 * ratio {
        percent if percent < 1_000.0 => format!("{percent:.1} %"),
        percent if percent.is_nan() => "NaN".into(),
        _ => "> 999 %".into(),
    }
}
