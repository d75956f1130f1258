//! Conditions of operation as covariates of a record.

use super::record::Day;
use crate::measurement::{Condition, ConditionUnit, Reading, values};

/// Prior standard deviation of the logarithm of a bearing coefficient or an unbalance for 10 °C. The viscosity of turbine oil
/// changes by a factor of six from 40 to 100 °C (ISO 3448, VG 32), and an oil film at most in proportion to it: ln 6 / 6.
const TEMPERATURE_SD: f64 = 0.3;
const TEMPERATURE_STEP_DEGC: f64 = 10.0;
/// The same for the whole of a load or of a pressure: film coefficients go with a power of the load below one.
const SHARE_SD: f64 = 0.5;

/// A condition over a record; its value of a day is (x − mean) / scale.
#[derive(Debug, Clone)]
pub struct Covariate {
    pub condition: Condition,
    /// Mean over the record, in its unit.
    pub mean: f64,
    /// Change that the prior is of, in its unit.
    pub scale: f64,
    /// Change that effects are told for, in its unit.
    pub step: f64,
    /// Prior standard deviation of a logarithm for one scale.
    pub effect_sd: f64,
}

/// The covariates of a record, with their values put into its days, and a sentence of each condition that is none. Lost values are
/// interpolated in time.
pub fn covariates(
    conditions: &[Condition],
    record: &[Reading],
    days: &mut [Day],
) -> (Vec<Covariate>, Vec<String>) {
    let (mut covariates, mut remarks) = (Vec::new(), Vec::new());
    for (c, condition) in conditions.iter().enumerate() {
        let all = values(record, c);
        let known: Vec<(f64, f64)> =
            days.iter().filter_map(|day| Some((day.time_d, all.get(day.row).copied().flatten()?))).collect();
        let first = known.first().map_or(0.0, |(_, x)| *x);
        let why = match () {
            () if 2 * known.len() < days.len() => {
                format!("has a value in {} of {} readings, expected at least half", known.len(), days.len())
            }
            () if known.iter().all(|(_, x)| *x == first) => "never changes".into(),
            () => {
                let covariate = Covariate::of(condition, &known);
                for day in days.iter_mut() {
                    day.conditions.push((at(&known, day.time_d) - covariate.mean) / covariate.scale);
                }
                covariates.push(covariate);
                continue;
            }
        };
        remarks.push(format!("The column {} is not used: it {why}.", condition.column()));
    }
    (covariates, remarks)
}

impl Covariate {
    /// Its value of a reading among the values of these conditions, centred and scaled; `None` where it was lost.
    pub fn of_reading(&self, conditions: &[Condition], reading: &Reading) -> Option<f64> {
        let c = conditions.iter().position(|condition| *condition == self.condition)?;
        let value = values(std::slice::from_ref(reading), c).first().copied().flatten()?;
        Some((value - self.mean) / self.scale)
    }

    fn of(condition: &Condition, known: &[(f64, f64)]) -> Self {
        let mean = known.iter().map(|(_, x)| x).sum::<f64>() / known.len() as f64;
        let condition = condition.clone();
        if condition.unit == ConditionUnit::DegreeCelsius {
            let step = TEMPERATURE_STEP_DEGC;
            return Self { condition, mean, scale: step, step, effect_sd: TEMPERATURE_SD };
        }
        let largest = known.iter().map(|(_, x)| x.abs()).fold(0.0, f64::max);
        let step = 10_f64.powf(largest.log10().floor());
        Self { condition, mean, scale: largest, step, effect_sd: SHARE_SD }
    }
}

/// A value at a time, between those known before and after it, or the nearest of them.
fn at(known: &[(f64, f64)], time_d: f64) -> f64 {
    let after = known.partition_point(|(t, _)| *t < time_d);
    match (after.checked_sub(1).map(|k| known[k]), known.get(after)) {
        (Some((t, x)), Some((later_d, later))) => x + (later - x) * (time_d - t) / (later_d - t),
        (Some((_, x)), None) | (None, Some(&(_, x))) => x,
        (None, None) => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lost_values_are_interpolated_in_time_and_held_at_the_ends() {
        let known = [(1.0, 40.0), (5.0, 48.0)];
        assert_eq!([0.0, 1.0, 2.0, 5.0, 9.0].map(|t| at(&known, t)), [40.0, 40.0, 42.0, 48.0, 48.0]);
    }

    #[test]
    fn steps_are_ten_degrees_or_a_power_of_ten() {
        let of = |unit, value: f64| {
            let condition = Condition { name: "c".into(), unit };
            Covariate::of(&condition, &[(0.0, 0.0), (1.0, value)])
        };
        assert_eq!(of(ConditionUnit::DegreeCelsius, 3.0).step, 10.0);
        assert!((of(ConditionUnit::Megawatt, 65.0).step - 10.0).abs() < 1e-12);
        assert!((of(ConditionUnit::Bar, 1.8).step - 1.0).abs() < 1e-12);
    }
}
