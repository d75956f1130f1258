//! What `startup --json` prints.

use rotor_edge_desktop::diagnose::Candidate;
use rotor_edge_desktop::startup::UncertainValue;
use rotor_edge_desktop::startup::refinement::ModelStage;
use rotor_edge_desktop::units::rpm;

use rotor_edge_desktop::startup::estimate::{
    AmplitudeTrend, CombinedEstimates, METHODS, OscillatorParameters, RunEstimates,
};
use rotor_edge_desktop::startup::series::{ProbeDirection, RunUp};
use rotor_edge_desktop::unbalance::{G_MM, g_mm_deg};
use serde_json::{Map, Value, json};

use super::answer::Answer;
use crate::command::diagnose;

pub fn of(answer: &Answer) -> Value {
    let found = &answer.found;
    let own = found.own_kg_m.map(|own| {
        let mut value = unbalance(own.unbalance_kg_m, own.sd_kg_m);
        value["modal_mass_kg"] = json!(own.modal_mass_kg);
        value
    });
    json!({
        "damping_ratio": by_direction(answer, |e| e.damping_ratio.value),
        "natural_rpm": by_direction(answer, |e| rpm(e.natural_rad_s.value)),
        "stiffness_n_m": by_direction(answer, |e| e.stiffness_n_m.value),
        "bearing_stiffness_n_m": by_direction(answer, |e| e.bearing_stiffness_n_m.map(|b| b.value)),
        "damping_n_s_m": by_direction(answer, |e| e.damping_n_s_m.value),
        "error_percent_of_clearance": errors(answer, &answer.stages[0]),
        "mass_kg": found.mass_kg,
        "effective_mass_kg": found.spring.effective_mass_kg,
        "shaft_stiffness_n_m": found.spring.stiffness_n_m,
        "clearance_um": answer.clearance_um,
        "clearance_assumed": answer.clearance_assumed,
        "estimates": estimates(answer),
        "runs": runs(answer),
        "own_unbalance_two_degree": own,
        "stages": answer.stages.iter().map(|s| stage(answer, s)).collect::<Vec<_>>(),
        "improved": improved(answer),
        "remarks": answer.remarks,
    })
}

/// One number a direction, of its best estimate.
fn by_direction<T: Into<Value>>(answer: &Answer, of: impl Fn(&OscillatorParameters) -> T) -> Value {
    let found = &answer.found;
    let value = |(d, c): (&ProbeDirection, &CombinedEstimates)| {
        (d.label.clone(), c.best().map_or(Value::Null, |(_, e)| of(e).into()))
    };
    Value::Object(found.directions.iter().zip(&found.combined).map(value).collect())
}

fn number(n: UncertainValue, factor: f64) -> Value {
    json!({ "value": n.value * factor, "sd": n.sd * factor })
}

fn estimate(e: &OscillatorParameters) -> Value {
    json!({
        "natural_rpm": number(e.natural_rad_s, rpm(1.0)),
        "damping_ratio": number(e.damping_ratio, 1.0),
        "damping_n_s_m": number(e.damping_n_s_m, 1.0),
        "stiffness_n_m": number(e.stiffness_n_m, 1.0),
        "bearing_stiffness_n_m": e.bearing_stiffness_n_m.map(|b| number(b, 1.0)),
    })
}

/// Every method's answer over all runs, by direction.
fn estimates(answer: &Answer) -> Value {
    let found = &answer.found;
    let direction = |d: usize| {
        let methods = METHODS.iter().zip(&found.combined[d].by_method);
        let all: Map<String, Value> = methods
            .map(|(name, e)| ((*name).to_string(), e.as_ref().map_or(Value::Null, estimate)))
            .collect();
        let line = |l: &AmplitudeTrend, factor: f64| {
            json!({
                "small_motion": number(l.at_rest, factor),
                "at_largest": l.at_largest * factor,
                "sigmas": l.sigmas,
            })
        };
        let shift = found.shifts[d].as_ref().map(|s| {
            json!({
                "natural_rpm": line(&s.natural_rad_s, rpm(1.0)),
                "damping_ratio": line(&s.damping_ratio, 1.0),
                "largest_um": s.largest_m * 1e6,
            })
        });
        (found.directions[d].label.clone(), json!({ "methods": all, "shift": shift }))
    };
    Value::Object((0..found.directions.len()).map(direction).collect())
}

/// Every run along every direction, as marked in the Bode plot.
fn runs(answer: &Answer) -> Value {
    let found = &answer.found;
    let one = |seen: &RunEstimates| match &seen.half_power {
        Ok((marks, own)) => json!({
            "natural_rpm": rpm(own.modal.natural_rad_s),
            "natural_rpm_sd": rpm(own.covariance[(0, 0)].sqrt()),
            "damping_ratio": own.modal.damping_ratio,
            "damping_ratio_sd": own.covariance[(1, 1)].sqrt(),
            "damping_ratio_taken_as_light": marks.light_damping_ratio,
            "peak_rpm": rpm(marks.peak[0]),
            "peak_um": marks.peak[1] * 1e6,
            "half_power_rpm": marks.half_power_rad_s.map(rpm),
        }),
        Err(why) => json!({ "why_not": why }),
    };
    let run = |(run, row): (&RunUp, &Vec<RunEstimates>)| {
        let directions: Map<String, Value> =
            found.directions.iter().zip(row).map(|(d, s)| (d.label.clone(), one(s))).collect();
        let [added_g_mm, _] = g_mm_deg(run.added_kg_m);
        json!({ "run": run.label(), "added_g_mm": added_g_mm, "half_power": directions })
    };
    found.runs.iter().zip(&found.seen).map(run).collect()
}

/// By speed, then bearing, then run: percent of the clearance.
fn errors(answer: &Answer, stage: &ModelStage) -> Value {
    let mut by_speed = Map::new();
    for speed in &answer.speeds_rpm {
        let mut by_bearing = Map::new();
        for e in answer.found.errors_at(&answer.readings, &stage.motion, *speed) {
            let runs = by_bearing.entry(answer.bearings[e.bearing].clone()).or_insert_with(|| json!({}));
            runs[answer.found.runs[e.run].label()] = json!(answer.percent(e.error_m));
        }
        by_speed.insert(format!("{speed}"), Value::Object(by_bearing));
    }
    Value::Object(by_speed)
}

fn stage(answer: &Answer, stage: &ModelStage) -> Value {
    let worst = answer.found.worst_by_speed(&answer.readings, &stage.motion, answer.range_rpm);
    let rows: Vec<Value> = worst
        .iter()
        .map(|[speed, error, noise]| {
            json!({
                "speed_rpm": speed,
                "error_percent_of_clearance": answer.percent(*error),
                "noise_percent_of_clearance": answer.percent(*noise),
            })
        })
        .collect();
    let largest = worst.iter().map(|w| answer.percent(w[1])).fold(0.0, f64::max);
    json!({
        "model": stage.label,
        "chi2_per_value": stage.chi2_per_value,
        "error_percent_of_clearance": errors(answer, stage),
        "largest_error_percent_of_clearance": largest,
        "by_speed": rows,
    })
}

fn improved(answer: &Answer) -> Option<Value> {
    let chain = answer.chain.as_ref()?;
    let outcome = &chain.outcome;
    let effect = |c: &Candidate| {
        let mut value = json!({ "effect": c.effect, "at": c.at });
        let all = diagnose::candidate_json(c);
        (value["parameters"], value["uncertainty"]) = (all["parameters"].clone(), all["uncertainty"].clone());
        value
    };
    let planes: Vec<Value> = chain.unbalance_kg_m.iter().map(|(u, sd)| unbalance(*u, *sd)).collect();
    let bow = chain.bow().map(|b| json!({ "delta_bic": b.support, "probability": b.probability }));
    Some(json!({
        "verdict": outcome.verdict.name(),
        "summary": outcome.summary,
        "effects": outcome.steps.iter().map(|s| effect(&s.added)).collect::<Vec<_>>(),
        "own_unbalance": planes,
        "pedestal_resonance_rpm": super::text::pedestals(chain).map(|(at, rpm, sd)| json!({ "at": at, "rpm": rpm, "sd": sd })).collect::<Vec<_>>(),
        "shaft_bow_not_added": bow,
    }))
}

fn unbalance(kg_m: nalgebra::Complex<f64>, sd_kg_m: f64) -> Value {
    let [magnitude, angle] = g_mm_deg(kg_m);
    let sd = sd_kg_m * G_MM;
    json!({ "g_mm": magnitude, "angle_deg": angle, "sd_g_mm": sd, "sd_deg": (sd / magnitude).to_degrees() })
}
