//! Which further measurement decides between effects that a diagnosis could not tell apart, or which two do together.

use rayon::prelude::*;

use super::answer::{Decision, FurtherMeasurement};
use super::campaign::Campaign;
use super::further::{Addition, Further, SoughtEffect};
use super::smallest::PROBABLE;
use crate::error::Error;

/// Accuracy of predicted probabilities, as a plan is asked to have it: a smaller difference says nothing of which is larger.
const ACCURACY: f64 = 0.1;
/// Measurements of which each two are tried together, where none decides by itself.
const COMBINED: usize = 3;

impl Decision {
    /// Of several measurements that decide as probably, as far as a plan knows it, the one that tells most of all effects and of the
    /// unbalance; two together only where they decide more probably than each.
    ///
    /// # Errors
    /// If a plan looks for no such effect.
    pub fn between(
        labels: &[String],
        campaign: &Campaign,
        sizes: &[SoughtEffect],
        now: &Further,
        further: &[(Addition, FurtherMeasurement)],
    ) -> Result<Self, Error> {
        let known: Vec<String> = sizes.iter().map(|sought| sought.placed.label(&campaign.rotor)).collect();
        if let Some(unknown) = labels.iter().find(|label| !known.contains(label)) {
            let known = known.join(", ");
            return Err(Error::UnknownEffect(format!(
                "a plan does not look for \"{unknown}\" on this machine, expected one of {known}"
            )));
        }
        let singles: Vec<&FurtherMeasurement> = further.iter().map(|(_, m)| m).collect();
        let mut best = most_probable(&singles, labels).cloned();
        let of_best = |best: &Option<FurtherMeasurement>| {
            best.as_ref().map_or(0.0, |m| named_alone(&m.alone_of, labels))
        };
        let by_one = of_best(&best);
        if by_one < PROBABLE - ACCURACY {
            let mut ordered: Vec<&(Addition, FurtherMeasurement)> = further.iter().collect();
            ordered.sort_by(|(_, a), (_, b)| {
                named_alone(&b.alone_of, labels).total_cmp(&named_alone(&a.alone_of, labels))
            });
            ordered.truncate(COMBINED);
            let pairs = (0..ordered.len()).flat_map(|a| (a + 1..ordered.len()).map(move |b| [a, b]));
            let both = |[a, b]: [usize; 2]| {
                let [one, other] = [&ordered[a].0, &ordered[b].0];
                let name = format!("{}, together with {}", one.name(), other.name());
                Further::beyond(now, name, other.to(&one.to(campaign)), sizes)
            };
            let pairs: Vec<[usize; 2]> = pairs.collect();
            let tried: Vec<FurtherMeasurement> = pairs.into_par_iter().filter_map(both).collect();
            let by_two = most_probable(&tried.iter().collect::<Vec<_>>(), labels).cloned();
            if of_best(&by_two) > by_one + ACCURACY {
                best = by_two;
            }
        }
        Ok(Self {
            effects: labels.to_vec(),
            now: named_alone(&now.alone_of, labels),
            then: of_best(&best),
            measurement: best,
        })
    }
}

/// Of those that decide as probably as the best, as far as a plan knows it, the most informative.
fn most_probable<'m>(
    measurements: &[&'m FurtherMeasurement],
    labels: &[String],
) -> Option<&'m FurtherMeasurement> {
    let decides = |m: &FurtherMeasurement| named_alone(&m.alone_of, labels);
    let most = measurements.iter().map(|m| decides(m)).fold(0.0, f64::max);
    let equal = measurements.iter().copied().filter(|m| decides(m) >= most - ACCURACY);
    equal.max_by(|a, b| a.gain_bits.total_cmp(&b.gain_bits))
}

/// Average probability with which one of these effects is named alone.
fn named_alone(alone_of: &[(String, f64)], labels: &[String]) -> f64 {
    let of = |label: &String| alone_of.iter().find(|(l, _)| l == label).map(|(_, alone)| *alone);
    let all: Vec<f64> = labels.iter().filter_map(of).collect();
    all.iter().sum::<f64>() / all.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{PlanRequest, plan};
    use crate::testing::sample_rotor;

    #[test]
    fn most_informative_of_equally_decisive_measurements_is_best() {
        let speeds_rpm = (1..=7).map(|k| 500.0 * f64::from(k)).collect();
        let measured = plan(&sample_rotor(), &PlanRequest::at(speeds_rpm)).unwrap().next[0].clone();
        let label = "runout".to_string();
        let best = |gains_and_probabilities: &[(f64, f64)]| {
            let of = |(gain_bits, alone): &(f64, f64)| FurtherMeasurement {
                gain_bits: *gain_bits,
                alone_of: vec![(label.clone(), *alone)],
                ..measured.clone()
            };
            let all: Vec<FurtherMeasurement> = gains_and_probabilities.iter().map(of).collect();
            most_probable(&all.iter().collect::<Vec<_>>(), std::slice::from_ref(&label)).unwrap().gain_bits
        };
        assert_eq!(best(&[(3.0, 0.2), (2.0, 0.92), (1.0, 0.94)]), 2.0);
        assert_eq!(best(&[(3.0, 0.2), (2.0, 0.82), (1.0, 0.94)]), 1.0);
    }
}
