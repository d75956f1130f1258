//! Campbell diagram: damped natural frequencies over speed, drawn by their sense of whirl.

use rotor_edge_desktop::check::modes::{STRONG_LOG_DECREMENT, Whirl};

use super::chart::{Axis, Chart, Column, Look, Panel};

const HEIGHT_PX: f64 = 360.0;
/// How the senses are drawn, and in which order they stand in the legend.
const SENSES: [(Whirl, &str); 3] =
    [(Whirl::Forward, "forward"), (Whirl::Backward, "backward"), (Whirl::Mixed, "mixed")];
/// One mode followed over speed: speed and frequency, rpm; sense; log decrement. Where it is strongly damped, it is not drawn.
pub struct Branch {
    /// By ascending speed.
    pub points: Vec<(f64, f64, Whirl, f64)>,
}

/// The diagram; circles at the damped critical speeds, rpm, given with their log decrements.
pub fn campbell(branches: &[Branch], critical: &[(f64, f64)]) -> Chart {
    let x = Axis::named("speed, rpm");
    let y = Axis::from_zero("frequency, rpm");
    let mut chart = Chart::of(Panel { x, y, height_px: HEIGHT_PX, ..Panel::default() });
    let columns = |name: &str| {
        [Column::new("speed", "rpm"), Column::new(name, "rpm"), Column::new("log decrement", "")]
    };
    for branch in branches {
        for (sense, piece) in pieces(branch) {
            chart.draw(0, SENSES[sense].1, Look::Model(sense), &columns("frequency"), piece);
        }
    }
    let points = || branches.iter().flat_map(|b| &b.points).filter(|p| p.3 < STRONG_LOG_DECREMENT);
    let reach = |of: fn(&(f64, f64, Whirl, f64)) -> f64| points().map(of).fold(0.0, f64::max);
    let end = reach(|p| p.0).min(reach(|p| p.1));
    chart.draw(0, "speed of rotation", Look::Faint, &[], [[0.0, 0.0], [end, end]]);
    let met = critical.iter().filter(|c| c.1 < STRONG_LOG_DECREMENT).map(|c| [c.0, c.0, c.1]);
    chart.draw(0, "critical speed", Look::Rings(0), &columns("critical speed"), met);
    chart
}

/// A branch in pieces of one sense; a piece ends where the next begins.
fn pieces(branch: &Branch) -> Vec<(usize, Vec<[f64; 3]>)> {
    let number = |sense: Whirl| SENSES.iter().position(|(s, _)| *s == sense).unwrap_or(2);
    let mut all: Vec<(usize, Vec<[f64; 3]>)> = Vec::new();
    for (speed, frequency, sense, decrement) in branch.points.iter().filter(|p| p.3 < STRONG_LOG_DECREMENT) {
        let (sense, at) = (number(*sense), [*speed, *frequency, *decrement]);
        match all.last_mut() {
            Some((last, piece)) if *last == sense => piece.push(at),
            Some((_, piece)) => {
                piece.push(at);
                all.push((sense, vec![at]));
            }
            None => all.push((sense, vec![at])),
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn branch_that_changes_sense_is_drawn_in_pieces() {
        let points = [(1.0, Whirl::Mixed), (2.0, Whirl::Mixed), (3.0, Whirl::Forward), (4.0, Whirl::Forward)];
        let branch = Branch { points: points.map(|(s, w)| (s, 10.0, w, 0.1)).to_vec() };
        let ends: Vec<_> = pieces(&branch).iter().map(|(i, p)| (*i, p[0][0], p[p.len() - 1][0])).collect();
        assert_eq!(ends, [(2, 1.0, 3.0), (0, 3.0, 4.0)]);
    }
}
