//! Campbell diagram: damped natural frequencies over speed, drawn by their sense of whirl.

use rotor_edge_desktop::check::modes::{STRONG_LOG_DECREMENT, Whirl};

use super::chart::{Anchor, Axis, Chart, Column, Look, Panel};
use crate::scale::Scale;

const HEIGHT_PX: f64 = 360.0;
/// Colours of what is marked.
const RUNNING: usize = 2;
const UNSTABLE: usize = 1;
const FAILING: usize = 1;
/// Highest frequency that is shown, of the fastest speed.
const ABOVE_SPEED: f64 = 1.2;
/// Least width of a range, of the fastest speed.
const THINNEST: f64 = 0.012;
/// How the senses are drawn, and in which order they stand in the legend.
const SENSES: [(Whirl, &str); 3] =
    [(Whirl::Forward, "forward"), (Whirl::Backward, "backward"), (Whirl::Mixed, "mixed")];
/// One mode followed over speed: speed and frequency, rpm; sense; log decrement. Where it is strongly damped, it is not drawn.
pub struct Branch {
    /// By ascending speed.
    pub points: Vec<(f64, f64, Whirl, f64)>,
}

/// A damped critical speed.
pub struct CriticalMark {
    pub speed_rpm: f64,
    pub log_decrement: f64,
    /// Its separation margin, where one is needed.
    pub word: Option<String>,
    /// Whether that margin fails.
    pub is_failing: bool,
}

/// What is marked in the diagram besides its curves.
#[derive(Default)]
pub struct CampbellMarks {
    /// First and last speed at which the machine runs.
    pub running_rpm: Option<[f64; 2]>,
    /// From this speed on a mode grows.
    pub unstable_from_rpm: Option<f64>,
    pub critical: Vec<CriticalMark>,
}

/// The diagram; what has no resonance peak is left out.
pub fn campbell(branches: &[Branch], marks: &CampbellMarks) -> Chart {
    let points = || branches.iter().flat_map(|b| &b.points).filter(|p| p.3 < STRONG_LOG_DECREMENT);
    let reach = |of: fn(&(f64, f64, Whirl, f64)) -> f64| points().map(of).fold(0.0, f64::max);
    let fastest = reach(|p| p.0);
    // modes far above the speed meet nothing
    let highest = reach(|p| p.1).min(ABOVE_SPEED * fastest);
    let scale = Scale::from_zero([highest].into_iter(), 4);
    let x = Axis::named("speed, rpm");
    let y = Axis { to: Some(scale.to), step: Some(scale.step()), ..Axis::from_zero("frequency, rpm") };
    let mut chart = Chart::of(Panel { x, y, height_px: HEIGHT_PX, ..Panel::default() });
    let ranges = [
        ("running range", RUNNING, marks.running_rpm),
        ("unstable", UNSTABLE, marks.unstable_from_rpm.map(|from| [from, fastest.max(from)])),
    ];
    for (name, colour, range) in ranges {
        let Some(ends) = range else { continue };
        let columns = ["speed", "from", "to"].map(|name| Column::new(name, "rpm"));
        chart.draw(0, name, Look::Band(colour), &columns, wide(ends, fastest).map(|at| [at, 0.0, scale.to]));
    }
    let columns = |name: &str| {
        [Column::new("speed", "rpm"), Column::new(name, "rpm"), Column::new("log decrement", "")]
    };
    let is_shown = |b: &&Branch| b.points.iter().any(|p| p.1 <= scale.to);
    for branch in branches.iter().filter(is_shown) {
        for (sense, piece) in pieces(branch) {
            chart.draw(0, SENSES[sense].1, Look::Model(sense), &columns("frequency"), piece);
        }
    }
    let end = fastest.min(highest);
    chart.draw(0, "speed of rotation", Look::Faint, &[], [[0.0, 0.0], [end, end]]);
    let met = || marks.critical.iter().filter(|c| c.log_decrement < STRONG_LOG_DECREMENT);
    for (name, colour, is_failing) in [("critical speed", 0, false), ("margin fails", FAILING, true)] {
        let rows: Vec<_> = met().filter(|c| c.is_failing == is_failing).collect();
        if is_failing && rows.is_empty() {
            continue;
        }
        let rows = rows.into_iter().map(|c| [c.speed_rpm, c.speed_rpm, c.log_decrement]);
        chart.draw(0, name, Look::Rings(colour), &columns("critical speed"), rows);
    }
    for c in met() {
        let is_late = c.speed_rpm > 0.6 * fastest;
        let anchor = if is_late { Anchor::Right } else { Anchor::Left };
        let at = [c.speed_rpm, c.speed_rpm];
        chart.write(0, anchor, c.word.iter().map(|word| (at, word.clone())));
    }
    chart
}

/// A range as it is drawn: one speed has a width too.
fn wide([from, to]: [f64; 2], fastest: f64) -> [f64; 2] {
    let least = 0.5 * THINNEST * fastest;
    let middle = 0.5 * (from + to);
    [from.min(middle - least), to.max(middle + least)]
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

    #[test]
    fn running_range_and_failing_margin_are_marked() {
        let points = [10.0, 20.0, 30.0].map(|s| (s, 18.0, Whirl::Forward, 0.1)).to_vec();
        let mark = |speed_rpm, is_failing: bool| CriticalMark {
            speed_rpm,
            log_decrement: 0.1,
            word: is_failing.then(|| "2 %, 15 % needed".into()),
            is_failing,
        };
        let marks = CampbellMarks {
            running_rpm: Some([20.0, 20.0]),
            unstable_from_rpm: None,
            critical: vec![mark(18.0, true), mark(5.0, false)],
        };
        let chart = campbell(&[Branch { points }], &marks);
        let rows =
            |name: &str| chart.series.iter().find(|s| s.name.as_deref() == Some(name)).map(|s| &s.rows);
        let range = rows("running range").unwrap();
        assert!(range[0][0] < 20.0 && range[1][0] > 20.0, "one speed is seen: {range:?}");
        assert_eq!(rows("margin fails").unwrap()[0][0], 18.0);
        assert_eq!((rows("critical speed").unwrap().len(), rows("unstable")), (1, None));
        assert!(chart.series.iter().any(|s| s.words == ["2 %, 15 % needed"]));
    }
}
