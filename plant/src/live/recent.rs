//! The unbalance of the last day, small enough for a tile.

use anyhow::Result;
use maud::{Markup, html};
use rotor_edge::scale::three_digits;
use rusqlite::{Connection, OptionalExtension as _};

use super::history::{Resolution, sampled};
use super::trends::UNBALANCE;
use crate::names::Names;

/// What a tile looks back, µs.
const BACK_US: i64 = 24 * 3_600_000_000;
/// One row each half hour: a small trend has no room for more.
const RESOLUTION: Resolution = Resolution { stretches: 48, rows: 1 };
/// Size of the drawing, px.
const WIDTH_PX: f64 = 240.0;
const HEIGHT_PX: f64 = 40.0;
/// Of a value alone.
const DOT_PX: f64 = 1.6;

/// What the last results of a monitor say.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recent {
    /// Unbalance of each plane in the last result, g·mm; none where it was not known.
    pub last_g_mm: Vec<Option<f64>>,
    /// The same in each stretch of the last day, by plane.
    pub trend_g_mm: Vec<Vec<Option<f64>>>,
}

impl Recent {
    /// # Errors
    /// If the store cannot be read.
    pub fn of(connection: &Connection, source: i64, now_us: i64) -> Result<Self> {
        let sql = "SELECT * FROM result WHERE source = ? ORDER BY epoch DESC, sequence DESC LIMIT 1";
        let planes = |row: &rusqlite::Row| {
            let number = |name: &str| row.get::<_, Option<f64>>(name);
            let mut last = Vec::new();
            for quantity in UNBALANCE.iter().take(row.get::<_, u8>("planes")?.into()) {
                let parts = number(quantity.columns[0])?.zip(number(quantity.columns[1])?);
                last.push(parts.map(|(cos, sin)| cos.hypot(sin)));
            }
            Ok(last)
        };
        let last_g_mm = connection.query_row(sql, [source], planes).optional()?.unwrap_or_default();
        let period = (now_us - BACK_US, now_us);
        let stretches = sampled(connection, ("result", source), &UNBALANCE, period, RESOLUTION)?;
        let plane = |k: usize| stretches.iter().map(|s| s.spreads[k].map(|spread| spread.mean)).collect();
        Ok(Self { trend_g_mm: (0..last_g_mm.len()).map(plane).collect(), last_g_mm })
    }

    /// The last unbalance of each plane by its name.
    pub fn in_words(&self, names: &Names) -> String {
        let plane = |(k, value): (usize, &Option<f64>)| {
            let value = value.map_or("unknown".into(), |value| format!("{} g·mm", three_digits(value)));
            format!("{} {value}", names.plane(k as u8 + 1))
        };
        match self.last_g_mm.is_empty() {
            true => "no result yet".into(),
            false => self.last_g_mm.iter().enumerate().map(plane).collect::<Vec<_>>().join(", "),
        }
    }

    /// The trend of every plane from zero up, with gaps where nothing was judged.
    pub fn drawing(&self) -> Markup {
        let values = || self.trend_g_mm.iter().flatten().flatten().copied();
        let most = values().fold(0.0, f64::max);
        let place = |k: usize, value: f64| {
            let right = WIDTH_PX * (k as f64 + 0.5) / RESOLUTION.stretches as f64;
            let up = if most > 0.0 { value / most } else { 0.0 };
            (right, HEIGHT_PX - DOT_PX - (HEIGHT_PX - 2.0 * DOT_PX) * up)
        };
        let word = match values().next() {
            None => "No result in the last day".to_string(),
            Some(_) => format!("Unbalance of the last day, from 0 to {} g·mm", three_digits(most)),
        };
        html! {
            svg class="small" viewBox={ "0 0 " (WIDTH_PX) " " (HEIGHT_PX) } role="img" aria-label=(word) {
                title { (word) }
                line x1="0" x2=(WIDTH_PX) y1=(HEIGHT_PX - 0.5) y2=(HEIGHT_PX - 0.5) {}
                @for (plane, trend) in self.trend_g_mm.iter().enumerate() {
                    @for piece in pieces(trend) {
                        @let class = format!("plane-{plane}");
                        @match piece[..] {
                            [(k, value)] => {
                                @let (x, y) = place(k, value);
                                circle class=(class) cx=(px(x)) cy=(px(y)) r=(DOT_PX) {}
                            }
                            _ => {
                                @let points: Vec<String> = piece.iter().map(|(k, value)| {
                                    let (x, y) = place(*k, *value);
                                    format!("{},{}", px(x), px(y))
                                }).collect();
                                polyline class=(class) points=(points.join(" ")) {}
                            }
                        }
                    }
                }
            }
            span class="seen" { (word) }
        }
    }
}

fn px(place: f64) -> String {
    format!("{place:.1}")
}

/// Neighbouring stretches that have a value.
fn pieces(trend: &[Option<f64>]) -> Vec<Vec<(usize, f64)>> {
    let mut all: Vec<Vec<(usize, f64)>> = Vec::new();
    for (k, value) in trend.iter().enumerate() {
        let Some(value) = value else { continue };
        match all.last_mut().filter(|piece| piece.last().is_some_and(|last| last.0 + 1 == k)) {
            Some(piece) => piece.push((k, *value)),
            None => all.push(vec![(k, *value)]),
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_trend_has_gaps_where_nothing_was_judged() {
        let mut trend = vec![None; 48];
        (trend[3], trend[4], trend[9]) = (Some(10.0), Some(20.0), Some(5.0));
        let recent = Recent { last_g_mm: vec![Some(5.0), None], trend_g_mm: vec![trend] };
        let drawing = recent.drawing().into_string();
        assert!(drawing.contains("points=\"17.5,20.0 22.5,1.6\""), "{drawing}");
        assert!(drawing.contains("circle") && drawing.contains("from 0 to 20.0 g·mm"), "{drawing}");
        assert_eq!(recent.in_words(&Names::default()), "plane 1 5.00 g·mm, plane 2 unknown");
        let none = Recent::default();
        assert!(none.drawing().into_string().contains("No result in the last day"));
        assert_eq!(none.in_words(&Names::default()), "no result yet");
    }
}
