//! Campbell diagram: damped natural frequencies over speed, drawn by their sense of whirl.

use plotters::prelude::{Circle, LineSeries};

use rotor_edge_desktop::check::modes::Whirl;

use super::canvas::{Axis, Entry, FAINT, INK, Legend, axes, curve, line, px, svg};
use super::scale::Scale;

const HEIGHT_PX: f64 = 330.0;
/// How the senses are drawn, and in which order they stand in the legend.
const SENSES: [(Whirl, &str); 3] =
    [(Whirl::Forward, "forward"), (Whirl::Backward, "backward"), (Whirl::Mixed, "mixed")];
/// A mode that loses more than this from one period to the next is not drawn: it does not swing.
const OVERDAMPED: f64 = 12.0;

/// One mode followed over speed: speed and frequency, rpm; sense; log decrement.
pub struct Branch {
    /// By ascending speed.
    pub points: Vec<(f64, f64, Whirl, f64)>,
}

/// The diagram; circles where the frequency is the speed.
pub fn campbell(title: &str, branches: &[Branch], critical_rpm: &[f64]) -> String {
    let legend = Legend::new(SENSES.iter().enumerate().map(|(i, (_, name))| Entry::Model(i, name)));
    let points = || branches.iter().flat_map(|b| &b.points).filter(|p| p.3 < OVERDAMPED);
    let x = Scale::around(points().map(|p| p.0), 6);
    let y = Scale::from_zero(points().map(|p| p.1).chain(critical_rpm.iter().copied()), 5);
    svg(title, legend.height_px + HEIGHT_PX, |sheet| {
        legend.draw(sheet)?;
        let (_, below) = sheet.split_vertically(px(legend.height_px));
        let frequency = Axis { scale: &y, name: Some("frequency, rpm") };
        let mut chart = axes(&below, &Axis { scale: &x, name: Some("speed, rpm") }, &frequency)?;
        let ends = [x.from.max(y.from), x.to.min(y.to)];
        if ends[0] < ends[1] {
            chart.draw_series(LineSeries::new(ends.map(|v| (v, v)), line(FAINT, 1.2)))?;
        }
        for branch in branches {
            for (sense, piece) in pieces(branch) {
                curve(&mut chart, sense, &piece)?;
            }
        }
        chart.draw_series(critical_rpm.iter().map(|s| Circle::new((*s, *s), px(4.0), line(INK, 1.2))))?;
        Ok(())
    })
}

/// A branch in pieces of one sense; a piece ends where the next begins.
fn pieces(branch: &Branch) -> Vec<(usize, Vec<(f64, f64)>)> {
    let number = |sense: Whirl| SENSES.iter().position(|(s, _)| *s == sense).unwrap_or(2);
    let mut all: Vec<(usize, Vec<(f64, f64)>)> = Vec::new();
    for (speed, frequency, sense, _) in branch.points.iter().filter(|p| p.3 < OVERDAMPED) {
        let (sense, at) = (number(*sense), (*speed, *frequency));
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
    fn a_branch_that_changes_its_sense_is_drawn_in_pieces_without_a_gap() {
        let points = [(1.0, Whirl::Mixed), (2.0, Whirl::Mixed), (3.0, Whirl::Forward), (4.0, Whirl::Forward)];
        let branch = Branch { points: points.map(|(s, w)| (s, 10.0, w, 0.1)).to_vec() };
        let ends: Vec<_> = pieces(&branch).iter().map(|(i, p)| (*i, p[0].0, p[p.len() - 1].0)).collect();
        assert_eq!(ends, [(2, 1.0, 3.0), (0, 3.0, 4.0)]);
    }
}
