//! The paper of a polar plot: circles with their radii, spokes with their angles, and which way the shaft turns.

use super::chart::{Anchor, Arc, Axis, Chart, Look, Panel};
use crate::scale::Scale;

const HEIGHT_PX: f64 = 400.0;
/// Room for the angles around the outer circle, relative to its radius.
const ROOM: f64 = 1.24;

/// Which way the angles around the outer circle grow.
#[derive(Clone, Copy)]
pub(super) enum Turn {
    /// Against the rotation, clockwise: the lag of a motion.
    Lag,
    /// With the rotation: a place on the shaft.
    WithRotation,
}

impl Turn {
    fn sign(self) -> f64 {
        match self {
            Self::Lag => -1.0,
            Self::WithRotation => 1.0,
        }
    }
}

/// Paper for radii up to the largest of these, with 0° to the right; and how far its outer circle reaches.
pub(super) fn polar_paper(radii: impl Iterator<Item = f64>, unit: &str, angles: Turn) -> (Chart, f64) {
    let radius = Scale::from_zero(radii, 4);
    let rim = radius.to;
    let bare = Axis { to: Some(ROOM * rim), is_hidden: true, ..Axis::default() };
    let mut chart = Chart::of(Panel {
        x: bare.clone(),
        y: bare,
        height_px: HEIGHT_PX,
        is_plane: true,
        ..Panel::default()
    });
    let at = |r: f64, deg: f64| {
        let (sin, cos) = deg.to_radians().sin_cos();
        [r * cos, r * sin]
    };
    for r in &radius.ticks[1..] {
        chart.turn(0, None, Look::Faint, &[], Arc::of_circle(*r, 0.0, 360.0));
    }
    let spokes = || (0..360).step_by(45).map(f64::from);
    for deg in spokes() {
        chart.ground(0, Look::Faint, [[0.0, 0.0], at(rim, deg)]);
    }
    let degrees = spokes().map(|deg| (at(1.1 * rim, angles.sign() * deg), format!("{deg}°")));
    chart.write(0, Anchor::Centre, degrees);
    let labelled = radius.ticks.iter().skip(1);
    chart.write(0, Anchor::Centre, labelled.map(|r| (at(*r, 67.5), format!("{} {unit}", radius.label(*r)))));
    // above the rim, where no angle is written
    let (from_deg, tip_deg) = (118.0, 127.0);
    chart.turn(0, None, Look::Faint, &[], Arc::of_circle(1.18 * rim, from_deg, tip_deg));
    let [x, y] = at(1.18 * rim, tip_deg);
    chart.ground(0, Look::Arrows(None), [[x, y, tip_deg + 90.0]]);
    chart.write(0, Anchor::Right, [(at(1.2 * rim, tip_deg), "rotation".into())]);
    (chart, rim)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_labelled_radius_has_a_whole_circle() {
        let (chart, rim) = polar_paper([3.0].into_iter(), "µm", Turn::Lag);
        let whole =
            chart.series.iter().filter_map(|s| s.arc).filter(|arc| arc.to_deg - arc.from_deg == 360.0);
        let radii: Vec<f64> = whole.map(|arc| arc.path[0]).collect();
        let labelled = chart.series.iter().flat_map(|s| &s.words).filter(|word| word.ends_with("µm")).count();
        assert_eq!((radii.len(), radii.last()), (labelled, Some(&rim)));
    }

    #[test]
    fn lags_grow_clockwise_and_places_counter_clockwise() {
        let quarter = |turn| {
            let (chart, rim) = polar_paper([3.0].into_iter(), "µm", turn);
            let words = chart.series.iter().find(|s| s.words.contains(&"90°".to_string())).unwrap();
            let row = &words.rows[words.words.iter().position(|w| w == "90°").unwrap()];
            assert!(row[0].abs() < 1e-9);
            row[1] / rim
        };
        assert!(quarter(Turn::Lag) < -1.0 && quarter(Turn::WithRotation) > 1.0);
    }
}
