//! The shape of a bearing without its size: what its nondimensional table depends on.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::{Film, FilmKind, PadLoad};

/// Grooves between fixed lobes where the file says nothing, degrees (Lund & Thomsen 1978).
const USUAL_GROOVE_DEG: f64 = 20.0;
/// Share of the pitch that a tilting pad covers where the file says nothing.
const USUAL_COVER: f64 = 0.8;

/// The shape of a bearing, seen with the load pulling along −y and lengths in pad clearances.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shape {
    /// L/D.
    pub(super) length_ratio: f64,
    /// 1 − set clearance / pad clearance.
    pub(super) preload: f64,
    pub(super) surface: Surface,
}

/// The surface that faces the journal.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Surface {
    /// A full circle, fed where the film is widest.
    Plain,
    Fixed(Vec<Arc>),
    /// Arcs that tilt about a pivot behind them.
    Tilting(Vec<Arc>),
}

/// A lobe or pad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Arc {
    /// Leading edge, rad from +x in the direction of rotation.
    pub(super) start: f64,
    /// Angle covered, rad.
    pub(super) arc: f64,
    /// Direction in which the pad is moved inwards by its preload; a tilting pad's pivot, rad.
    pub(super) pivot: f64,
}

impl Shape {
    /// The shape of a film that has been checked.
    pub(super) fn of(film: &Film) -> Self {
        let count = film.pads.unwrap_or(2);
        let pitch = TAU / count as f64;
        let on_pad = match film.kind {
            FilmKind::TiltingPad => film.load == Some(PadLoad::OnPad),
            _ => film.load != Some(PadLoad::BetweenPads),
        };
        let first = -FRAC_PI_2 + if on_pad { 0.0 } else { pitch / 2.0 };
        let groove = film.groove_arc_deg.unwrap_or(USUAL_GROOVE_DEG).to_radians();
        let offset = film.offset.unwrap_or(0.5);
        let lobes = |arc: f64, place: &dyn Fn(f64) -> Arc| -> Vec<Arc> {
            debug_assert!(arc <= pitch + 1e-12);
            (0..count).map(|k| place(first + pitch * k as f64)).collect()
        };
        let fixed = |place: &dyn Fn(f64) -> Arc| Surface::Fixed(lobes(pitch - groove, place));
        let arc = pitch - groove;
        let surface = match film.kind {
            FilmKind::Plain => Surface::Plain,
            FilmKind::AxialGroove => fixed(&|centre| Arc { start: centre - arc / 2.0, arc, pivot: centre }),
            FilmKind::Elliptical => fixed(&|centre| {
                let start = centre - arc / 2.0;
                Arc { start, arc, pivot: start + offset * arc }
            }),
            FilmKind::Offset => {
                fixed(&|centre| Arc { start: centre - arc / 2.0, arc, pivot: centre + FRAC_PI_2 })
            }
            FilmKind::TiltingPad => {
                let arc = film.pad_arc_deg.map_or(USUAL_COVER * pitch, f64::to_radians);
                Surface::Tilting(lobes(arc, &|pivot| Arc { start: pivot - offset * arc, arc, pivot }))
            }
        };
        Self { length_ratio: film.length_m / film.diameter_m, preload: film.preload.unwrap_or(0.0), surface }
    }
}

/// The same direction as `angle`, from −π exclusive to π, rad.
pub(super) fn within_half_turn(angle: f64) -> f64 {
    let turned = angle.rem_euclid(TAU);
    if turned > PI { turned - TAU } else { turned }
}
