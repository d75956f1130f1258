//! Whether the model fits the machine, and since when it does or does not.

use rotor_edge_desktop::measurement::Reading;

use super::{AnsweredReading, Flag, day};

/// What a replay says of the model over its record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ModelFit {
    /// No flag was raised.
    Throughout,
    /// From this day on it does not.
    StoppedOn { first_d: f64, before: f64, after: f64 },
    /// From this day on it does, and no flag is up.
    BeganOn { first_d: f64, before: f64, after: f64 },
}

impl ModelFit {
    /// Of a record; shares are the mean residual over the features, `before` is not a number where no reading is.
    /// Readings by which the model was not judged say nothing of it.
    pub fn of(record: &[Reading], answers: &[AnsweredReading], raised: &[Flag]) -> Self {
        let answers: Vec<AnsweredReading> = answers.iter().copied().filter(AnsweredReading::judged).collect();
        let Some(flag) = raised.first() else { return Self::Throughout };
        let ratio = |a: &AnsweredReading| f64::from(a.result.ratio);
        let mean = |some: &[AnsweredReading]| some.iter().map(ratio).sum::<f64>() / some.len() as f64;
        let is_over = answers.last().is_some_and(|last| !last.flagged() && !last.suspicious());
        let split = step(&answers.iter().map(|a| ratio(a).max(f64::MIN_POSITIVE).ln()).collect::<Vec<_>>());
        if let Some(split) = split.filter(|_| is_over) {
            let [before, after] = [&answers[..split], &answers[split..]];
            if mean(after) < mean(before) && !after.iter().any(AnsweredReading::flagged) {
                return Self::BeganOn {
                    first_d: day(record, answers[split].row),
                    before: mean(before),
                    after: mean(after),
                };
            }
        }
        let from = answers.partition_point(|a| day(record, a.row) < flag.since_d);
        Self::StoppedOn {
            first_d: flag.since_d,
            before: mean(&answers[..from]),
            after: mean(&answers[from..]),
        }
    }
}

/// Where a series is best cut into two constants, by least squares; `None` for fewer than two values.
fn step(values: &[f64]) -> Option<usize> {
    let total: f64 = values.iter().sum();
    let mut left = 0.0;
    // the sum of squares that two means explain; what they leave is the rest
    let explained = |k: usize, left: f64| {
        left * left / k as f64 + (total - left) * (total - left) / (values.len() - k) as f64
    };
    let mut best: Option<(f64, usize)> = None;
    for k in 1..values.len() {
        left += values[k - 1];
        let now = explained(k, left);
        if best.is_none_or(|(most, _)| now > most) {
            best = Some((now, k));
        }
    }
    best.map(|(_, k)| k)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rotor_edge_core::can::{FLAG_FLAGGED, MonitorResult};
    use rotor_edge_core::model::MAX_PLANES;
    use rotor_edge_core::state::Reason;

    fn answers(ratios: &[f32], flagged: std::ops::Range<usize>) -> Vec<AnsweredReading> {
        let answer = |(row, ratio): (usize, &f32)| {
            let result = MonitorResult {
                sequence: row as u16,
                flags: if flagged.contains(&row) { FLAG_FLAGGED } else { 0 },
                suspect: None,
                redundancy: 4,
                streak: 0,
                used_mask: 15,
                reason: Reason::None,
                planes: 2,
                unbalance_g_mm: [[0.0; 2]; MAX_PLANES],
                static_g_mm: [0.0; 2],
                dynamic_g_mm: [0.0; 2],
                e_um: *ratio,
                ratio: *ratio,
                floor_um: 0.0,
                level_um: 0.0,
            };
            AnsweredReading { row, result }
        };
        ratios.iter().enumerate().map(answer).collect()
    }

    fn fit(ratios: &[f32], flagged: std::ops::Range<usize>) -> ModelFit {
        let record: Vec<Reading> =
            (0..ratios.len()).map(|row| Reading { time_d: Some(row as f64), ..Reading::default() }).collect();
        let raised =
            Flag { since_d: flagged.start as f64, time_d: 0.0, suspect: None, readings: flagged.len() };
        let raised: Vec<Flag> = if flagged.is_empty() { vec![] } else { vec![raised] };
        ModelFit::of(&record, &answers(ratios, flagged), &raised)
    }

    #[test]
    fn model_fitting_from_a_day_on_began_and_otherwise_stopped() {
        let falls = [0.3, 0.35, 0.3, 0.03, 0.02, 0.03];
        assert!(matches!(fit(&falls, 1..3), ModelFit::BeganOn { first_d: 3.0, .. }));
        let rises = [0.03, 0.02, 0.03, 0.3, 0.35, 0.3];
        assert!(matches!(fit(&rises, 3..6), ModelFit::StoppedOn { first_d: 3.0, .. }));
        assert_eq!(fit(&rises, 0..0), ModelFit::Throughout);
        assert_eq!(step(&[1.0]), None);
    }
}
