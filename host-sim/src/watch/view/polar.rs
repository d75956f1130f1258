//! Unbalance of the planes on a polar plot, with their past.
//!
//! Angles are those of the files: 0° along x, growing in the direction of rotation, which is drawn counter-clockwise (x to
//! the right, y upwards). Plane 1 has a whole line, the others broken ones, and each its number at the tip.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::Span;
use ratatui::widgets::Paragraph;
use ratatui::widgets::canvas::{Canvas, Circle, Context, Line, Points};
use rotor_edge_core::model::MAX_PLANES;

use super::{PLANE_COLOURS, titled};
use crate::scale::{Scale, three_digits};
use crate::watch::monitor::Monitor;

/// Dots of a cell: across, up.
const DOTS: [f64; 2] = [2.0, 4.0];
/// Room beside the rim for the angles, with a gap to a number at the rim, columns.
const LEFT: f64 = 6.0;
const RIGHT: f64 = 5.0;
/// The same above and below, rows.
const ABOVE: f64 = 1.3;
/// Strokes of a broken line, each as long as the gap after it.
const STROKES: u32 = 5;

/// How finely the rim is rounded.
const TICKS: usize = 4;

type Point = (f64, f64);

pub fn draw(frame: &mut Frame, area: Rect, monitor: &Monitor) {
    let trails: [_; MAX_PLANES] = std::array::from_fn(|plane| trail(monitor, plane));
    let points = || trails.iter().flatten();
    let block = titled("Unbalance ↺ rotation");
    if points().next().is_none() {
        return frame.render_widget(Paragraph::new("no result yet").block(block), area);
    }
    let rim = Scale::from_zero(points().map(|(x, y)| x.hypot(*y)), TICKS).to;
    let inner = block.inner(area);
    frame.render_widget(block, area);
    let dots = [f64::from(inner.width) * DOTS[0], f64::from(inner.height) * DOTS[1]];
    let [left, right, above] = [LEFT * DOTS[0], RIGHT * DOTS[0], ABOVE * DOTS[1]];
    let rim_dots = ((dots[0] - left - right) / 2.0).min(dots[1] / 2.0 - above).max(1.0);
    let dot = rim / rim_dots;
    // what is left of the width is shared
    let spare = dots[0] - left - right - 2.0 * rim_dots;
    let from = -dot * (rim_dots + left + spare / 2.0);
    let corner = [from + dot * dots[0], -dot * dots[1] / 2.0];
    let canvas = Canvas::default()
        .marker(Marker::Braille)
        .x_bounds([from, corner[0]])
        .y_bounds([corner[1], -corner[1]])
        .paint(|plot| {
            grid(plot, rim, dot, corner);
            for (points, colour) in trails.iter().zip(PLANE_COLOURS) {
                plot.draw(&Points { coords: points, color: colour });
            }
            tips(plot, &trails);
        });
    frame.render_widget(canvas, inner);
}

/// The unbalance of one plane, oldest first; what is no number is left out.
fn trail(monitor: &Monitor, plane: usize) -> Vec<Point> {
    let results = monitor.history().iter().map(|timed| timed.what);
    let vectors = results.filter(|r| plane < usize::from(r.planes)).map(|r| r.unbalance_g_mm[plane]);
    vectors.filter(|v| v.iter().all(|x| x.is_finite())).map(|[x, y]| (f64::from(x), f64::from(y))).collect()
}

/// Rim and half of it, cross, angles, and the rim's radius in the corner.
fn grid(plot: &mut Context, rim: f64, dot: f64, [right, bottom]: [f64; 2]) {
    let faint = Color::DarkGray;
    for radius in [rim, rim / 2.0] {
        plot.draw(&Circle { x: 0.0, y: 0.0, radius, color: faint });
    }
    for (x, y) in [(rim, 0.0), (0.0, rim)] {
        plot.draw(&Line { x1: -x, y1: -y, x2: x, y2: y, color: faint });
    }
    plot.layer();
    let column = DOTS[0] * dot;
    let mut write = |x: f64, y: f64, text: &str| {
        plot.print(x, y, Span::styled(text.to_string(), Modifier::DIM));
    };
    write(rim + 3.0 * column, 0.0, "0°");
    write(-column, -bottom, "90°");
    write(-rim - LEFT * column, 0.0, "180°");
    write(-1.5 * column, bottom, "-90°");
    let radius = format!("○ {}", three_digits(rim));
    write(right - column * radius.chars().count() as f64, bottom, &radius);
}

/// Where the planes are now.
fn tips(plot: &mut Context, trails: &[Vec<Point>]) {
    for (plane, (points, color)) in trails.iter().zip(PLANE_COLOURS).enumerate() {
        let Some(&(x, y)) = points.last() else { continue };
        let strokes = if plane == 0 { 1 } else { STROKES };
        for stroke in 0..strokes {
            let [from, to] = [2 * stroke, 2 * stroke + 1].map(|k| f64::from(k) / f64::from(2 * strokes - 1));
            plot.draw(&Line { x1: from * x, y1: from * y, x2: to * x, y2: to * y, color });
        }
        let style = Style::new().fg(color).add_modifier(Modifier::BOLD);
        plot.print(x, y, Span::styled((plane + 1).to_string(), style));
    }
}
