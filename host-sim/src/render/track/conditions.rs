//! Sentences on what conditions of operation change.

use crate::answers::track_conditions::{ConditionAnswer, RelativeChange};
use crate::scale::three_digits;
use rotor_edge_desktop::significance::percent;

/// One sentence for each bearing and plane that follows a condition, or that none does.
pub fn sentences(conditions: &[ConditionAnswer]) -> Vec<String> {
    conditions.iter().flat_map(of_one).collect()
}

fn of_one(condition: &ConditionAnswer) -> Vec<String> {
    let ConditionAnswer { name, unit, step, mean, .. } = condition;
    if !condition.used {
        return vec![format!("No effect of {name} is visible in these data.")];
    }
    let per = format!("per {step} {unit} of {name}");
    let bearings = condition.bearings.iter().map(|b| {
        let (stiffness, damping) = (change(b.stiffness), change(b.damping));
        format!("Bearing {}'s stiffness {stiffness} and its damping {damping} {per}.", b.name)
    });
    let planes = condition.planes.iter().map(|p| {
        let [added, half] = [p.change_g_mm, p.half_width_g_mm].map(three_digits);
        format!("Plane {}'s unbalance changes by {added} ± {half} g·mm at {:.0}° {per}.", p.name, p.angle_deg)
    });
    let mean = format!("Bearing constants are those at {mean:.1} {unit} of {name}.");
    let is_of_bearings = !condition.bearings.is_empty();
    let other = condition.other.map(|other| {
        let part = if other.part == "unbalance" { "the unbalance" } else { "other bearings" };
        format!(
            "It may instead be {part} that {name} changes ({} probable); the intervals allow for both.",
            percent(other.probability)
        )
    });
    bearings.chain(planes).chain(is_of_bearings.then_some(mean)).chain(other).collect()
}

fn change(change: RelativeChange) -> String {
    let way = if change.percent < 0.0 { "falls" } else { "rises" };
    format!("{way} by {:.1} ± {:.1} %", change.percent.abs(), change.half_width_percent)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answers::track_conditions::{BearingEffectAnswer, PlaneEffectAnswer};

    fn condition() -> ConditionAnswer {
        let of = |percent| RelativeChange { percent, half_width_percent: 0.4 };
        let bearing = BearingEffectAnswer {
            name: "16".into(),
            stiffness: of(-2.1),
            damping: of(3.0),
            coefficients: Vec::new(),
        };
        let plane = PlaneEffectAnswer {
            name: "1".into(),
            change_g_mm: 12.34,
            angle_deg: -30.0,
            half_width_g_mm: 2.0,
        };
        ConditionAnswer {
            name: "oil temperature".into(),
            unit: "°C",
            mean: 45.04,
            step: 10.0,
            used: true,
            log_evidence: 20.0,
            bearings: vec![bearing],
            planes: vec![plane],
            other: None,
        }
    }

    #[test]
    fn effects_of_conditions_are_told_with_their_intervals() {
        assert_eq!(
            sentences(&[condition()]),
            [
                "Bearing 16's stiffness falls by 2.1 ± 0.4 % and its damping rises by 3.0 ± 0.4 % per 10 °C of oil temperature.",
                "Plane 1's unbalance changes by 12.3 ± 2.00 g·mm at -30° per 10 °C of oil temperature.",
                "Bearing constants are those at 45.0 °C of oil temperature.",
            ]
        );
        let none = ConditionAnswer { used: false, ..condition() };
        assert_eq!(sentences(&[none]), ["No effect of oil temperature is visible in these data."]);
    }
}
