//! Trial weights in fixed proportions over several planes: a static pair, a couple pair, or the sets of modal balancing.
//!
//! The weights of a set are turned and scaled together, so a set needs one run beside the base run. In modal balancing each set has a
//! speed of its own; its response at the speeds of the other sets is not measured and counts as zero.

use nalgebra::{Complex, DMatrix, DVector};

use crate::balance::influence::trials::TrialFit;
use crate::decomposition::singular_values;

type C = Complex<f64>;

/// Smallest singular value, of directions scaled to one, above which they are independent.
const INDEPENDENT: f64 = 1e-3;

/// Directions of trial weights over the planes.
#[derive(Debug, Clone, PartialEq)]
pub struct WeightSets {
    /// Planes × sets; the largest part of each set is 1.
    directions: DMatrix<C>,
    /// From weights of the planes to those of the sets.
    inverse: DMatrix<C>,
    /// The run that each set is of.
    pub runs: Vec<String>,
}

impl WeightSets {
    /// The first independent ones of these weights by plane, with the names of their runs.
    pub fn of(all: &[(String, Vec<C>)]) -> Option<Self> {
        let mut columns: Vec<DVector<C>> = Vec::new();
        let mut runs = Vec::new();
        for (run, weights) in all {
            let largest = weights.iter().copied().max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
            if largest.norm() == 0.0 {
                continue;
            }
            columns.push(DVector::from_iterator(weights.len(), weights.iter().map(|w| w / largest)));
            let is_new = columns.len() <= weights.len()
                && singular_values(DMatrix::from_columns(&columns)).min() > INDEPENDENT;
            match is_new {
                true => runs.push(run.clone()),
                false => drop(columns.pop()),
            }
        }
        if columns.is_empty() {
            return None;
        }
        let directions = DMatrix::from_columns(&columns);
        let inverse = (directions.adjoint() * &directions).try_inverse()? * directions.adjoint();
        Some(Self { directions, inverse, runs })
    }

    pub fn names(&self) -> Vec<String> {
        self.runs.iter().map(|run| format!("set of run {run}")).collect()
    }

    /// The sets whose sum comes nearest to weights of the planes.
    pub fn of_planes(&self, weights: &[C]) -> Vec<C> {
        (&self.inverse * DVector::from_column_slice(weights)).iter().copied().collect()
    }

    /// The weights of the planes.
    pub fn to_planes(&self, sets: &[C]) -> Vec<C> {
        (&self.directions * DVector::from_column_slice(sets)).iter().copied().collect()
    }

    /// Standard deviations of the weights of the planes.
    pub fn sd_of_planes(&self, sets: &[f64]) -> Vec<f64> {
        let plane = |row: usize| {
            let part = |(k, sd): (usize, &f64)| self.directions[(row, k)].norm_sqr() * sd * sd;
            sets.iter().enumerate().map(part).sum::<f64>().sqrt()
        };
        (0..self.directions.nrows()).map(plane).collect()
    }

    /// Largest weights of the sets that keep every plane within its own.
    pub fn limits(&self, of_planes: &[f64]) -> Vec<f64> {
        let sets_of = |row: usize| self.directions.row(row).iter().filter(|d| d.norm() > 0.0).count();
        let set = |k: usize| {
            let plane = |(row, limit): (usize, &f64)| {
                let part = self.directions[(row, k)].norm();
                if part > 0.0 { limit / part / sets_of(row) as f64 } else { f64::INFINITY }
            };
            of_planes.iter().enumerate().map(plane).fold(f64::INFINITY, f64::min)
        };
        (0..self.directions.ncols()).map(set).collect()
    }

    /// Whether every set was tried at some speed.
    pub fn are_tried(&self, fit: &TrialFit) -> bool {
        (0..self.runs.len()).all(|k| fit.coefficients.iter().any(|c| c.per_weight[k].norm() > 0.0))
    }

    /// What the sets mean for the answer.
    pub fn doubts(&self, fit: &TrialFit) -> Vec<String> {
        let mut doubts = vec![format!(
            "The trial weights are in fixed proportions over the planes, so the weights are those of {}, turned and scaled as a whole.",
            match &self.runs[..] {
                [one] => format!("the run \"{one}\""),
                all => format!(
                    "the runs {}",
                    all.iter().map(|r| format!("\"{r}\"")).collect::<Vec<_>>().join(" and ")
                ),
            }
        )];
        for (k, run) in self.runs.iter().enumerate() {
            let untried = fit.coefficients.iter().filter(|c| c.per_weight[k].norm() == 0.0);
            let mut speeds: Vec<String> = untried.map(|c| format!("{:.0}", c.speed_rpm)).collect();
            speeds.dedup();
            if !speeds.is_empty() {
                doubts.push(format!(
                    "The weights of the run \"{run}\" were not tried at {} rpm and are taken to change nothing there, as in modal \
                     balancing; measure that speed again with all weights.",
                    speeds.join(", ")
                ));
            }
        }
        doubts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balance::alone::stated::Weights;
    use crate::balance::alone::{Correction, CorrectionRequest, correct, runs};
    use crate::balance::wanted::Wanted;
    use crate::error::Error;
    use crate::measurement::{ProbeRecord, Reading};

    /// Effects of planes A and B at two probes at 1,000 rpm, where the rotor moves as one, and at 3,000 rpm, where its ends are
    /// opposed: a couple does nothing at the first, a static pair nothing at the second.
    const EFFECTS: [(f64, [[f64; 2]; 2]); 2] =
        [(1000.0, [[0.5, 0.5], [0.4, 0.4]]), (3000.0, [[0.3, -0.3], [-0.2, 0.2]])];
    const STATIC: &str = "S,A,10,0\nS,B,10,0\n";
    const COUPLE: &str = "K,A,10,90\nK,B,10,-90\n";

    fn own() -> [C; 2] {
        [C::from_polar(30.0, 0.7), C::from_polar(12.0, -1.7)]
    }

    /// Runs at speeds, of a machine with the stated weights.
    fn solved(
        table: &str,
        measured: &[(&str, usize)],
        request: &CorrectionRequest,
    ) -> Result<Correction, Error> {
        let text = format!("run,plane,magnitude_g_mm,angle_deg\n{table}");
        let weights = Weights::parse("w.csv", &text, false).unwrap();
        let reading = |(run, at): &(&str, usize)| {
            let (speed_rpm, effects) = EFFECTS[*at];
            let added = weights.of(run);
            let probe = |row: &[f64; 2]| {
                let y: C = row.iter().zip(own().iter().zip(&added)).map(|(a, (u, w))| (u + w) * *a).sum();
                Some(y * C::from_polar(1e-6, 0.4))
            };
            Reading {
                run: Some((*run).into()),
                speed_rpm,
                probes: effects.iter().map(probe).collect(),
                ..Reading::default()
            }
        };
        let series = ProbeRecord {
            unit: "um".into(),
            conditions: Vec::new(),
            probes: vec!["P".into(), "Q".into()],
            readings: measured.iter().map(reading).collect(),
        };
        correct(&runs::machine(&series, &weights, request)?, request)
    }

    fn request() -> CorrectionRequest {
        CorrectionRequest { same_speed: 0.01, ..CorrectionRequest::default() }
    }

    #[test]
    fn static_pair_alone_cancels_the_static_part() {
        let found = solved(STATIC, &[("base", 0), ("S", 0)], &request()).unwrap();
        let expected = -(own()[0] + own()[1]) / 2.0;
        for w in &found.weights {
            assert!(
                (w.wanted_g_mm - expected).norm() < 1e-9 && (w.filling.sum_g_mm() - expected).norm() < 1e-9
            );
        }
        assert!(found.left.iter().all(|l| l.after < 1e-9 * l.before));
        assert!(found.doubts.iter().any(|d| d.contains("fixed proportions")), "{:?}", found.doubts);
        let limits = vec![(Some("B".to_string()), 5.0)];
        let limited = CorrectionRequest { wanted: Wanted { limits, ..Wanted::default() }, ..request() };
        let found = solved(STATIC, &[("base", 0), ("S", 0)], &limited).unwrap();
        assert!((found.weights[1].wanted_g_mm.norm() - 5.0).abs() < 1e-5);
    }

    #[test]
    fn couple_pair_alone_cancels_the_couple() {
        let found = solved(COUPLE, &[("base", 1), ("K", 1)], &request()).unwrap();
        let expected = -(own()[0] - own()[1]) / 2.0;
        assert!((found.weights[0].wanted_g_mm - expected).norm() < 1e-9);
        assert!((found.weights[1].wanted_g_mm + expected).norm() < 1e-9);
    }

    #[test]
    fn modal_sets_each_at_own_speed_cancel_both_modes() {
        let table = format!("{STATIC}{COUPLE}");
        let measured = [("base", 0), ("base", 1), ("S", 0), ("K", 1)];
        let found = solved(&table, &measured, &request()).unwrap();
        for (w, own) in found.weights.iter().zip(own()) {
            assert!((w.wanted_g_mm + own).norm() < 1e-9, "{}", w.wanted_g_mm);
        }
        let told = found.doubts.join(" ");
        assert!(
            told.contains("\"S\" were not tried at 3000 rpm")
                && told.contains("\"K\" were not tried at 1000 rpm")
        );
    }

    #[test]
    fn modal_sets_go_onto_the_run_that_holds_the_first() {
        // the first mode is balanced, and the second set is tried on top
        let table = "S,A,10,0\nS,B,10,0\nC,A,4,0\nC,B,4,0\nK,A,4,0\nK,B,4,0\nK,A,10,90\nK,B,10,-90\n";
        let on = CorrectionRequest { onto: Some("C".into()), ..request() };
        let found = solved(table, &[("C", 1), ("K", 1)], &on);
        let found = found.unwrap_or_else(|why| panic!("{why}"));
        let expected = -(own()[0] - own()[1]) / 2.0;
        assert!((found.weights[0].wanted_g_mm - expected).norm() < 1e-9, "{}", found.weights[0].wanted_g_mm);
    }

    #[test]
    fn runs_that_share_no_speed_are_refused_as_before() {
        let why = solved("S,A,10,0\nS,B,10,0\n", &[("base", 0), ("S", 1)], &request()).unwrap_err();
        assert!(matches!(why, Error::TooFewRuns { .. }), "{why}");
    }
}
