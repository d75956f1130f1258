//! Text and story of an answer of `simulate`.

use serde_json::Value;

use super::quantity::quantity;
use super::text::table;
use super::{Figure, Story};
use crate::answers::simulate::{SimulatedEffect, SimulatedProbe, SimulationAnswer, TruthAnswer};
use crate::scale::{number, rpm};

const COLUMNS: [&str; 4] = ["probe", "largest, µm pk-pk", "speed, rpm", "run"];

/// The whole answer on a terminal.
pub fn text(answer: &SimulationAnswer) -> String {
    let lines: Vec<String> = facts(answer).into_iter().map(|(_, line)| format!("{line}\n")).collect();
    let with_runs = if answer.runs.is_empty() { COLUMNS.len() - 1 } else { COLUMNS.len() };
    let rows: Vec<Vec<String>> = rows(answer).into_iter().map(|row| row[..with_runs].to_vec()).collect();
    format!("{}\n\n{}\n{}", held(answer), table(&COLUMNS[..with_runs], &rows), lines.concat())
}

/// What the file of readings holds.
pub fn held(answer: &SimulationAnswer) -> String {
    let speeds = answer.speeds_rpm.iter().copied();
    let (slowest, fastest) = speeds.fold((f64::INFINITY, 0.0_f64), |(l, h), s| (l.min(s), h.max(s)));
    let runs = match answer.runs.len() {
        0 | 1 => String::new(),
        many => format!(" in {many} runs"),
    };
    let range = match answer.speeds_rpm.len() {
        1 => format!("at {}", rpm(fastest)),
        many => format!("at {many} speeds from {} to {}", number(slowest, 0), rpm(fastest)),
    };
    format!(
        "{} holds {} simulated reading{} of {} probe{}, {range}{runs}.",
        answer.measured.display(),
        answer.readings,
        if answer.readings == 1 { "" } else { "s" },
        answer.probes.len(),
        if answer.probes.len() == 1 { "" } else { "s" },
    )
}

pub fn columns() -> Vec<String> {
    COLUMNS.map(String::from).to_vec()
}

/// One row a probe.
pub fn rows(answer: &SimulationAnswer) -> Vec<Vec<String>> {
    let row = |p: &SimulatedProbe| {
        vec![
            p.name.clone(),
            format!("{:.2}", 2.0 * p.largest_um),
            number(p.speed_rpm, 0),
            p.run.clone().unwrap_or_default(),
        ]
    };
    answer.probes.iter().map(row).collect()
}

/// The first screen of the page, beside the probe that moves most.
pub fn story(answer: &SimulationAnswer, probe: Option<Figure>, next: (String, Option<String>)) -> Story {
    let mut answers: Vec<(&'static str, String)> = Vec::new();
    for (question, sentence) in facts(answer) {
        match answers.last_mut().filter(|(last, _)| *last == question) {
            Some((_, said)) => *said += &format!(" {sentence}"),
            None => answers.push((question, sentence)),
        }
    }
    Story { verdict: held(answer), answers, next, beside: probe.into_iter().collect(), below: Vec::new() }
}

/// Noise, critical speeds, what the machine has in truth, remarks: sentences, and what each is about.
fn facts(answer: &SimulationAnswer) -> Vec<(&'static str, String)> {
    let noise = match (answer.noise.relative, answer.noise.floor_um) {
        (0.0, 0.0) => "The readings have no noise.".into(),
        (relative, floor_um) => format!(
            "Noise: standard deviation of each component {:.3} % of the amplitude and {floor_um:.4} µm 0-pk.",
            100.0 * relative
        ),
    };
    let critical: Vec<String> = answer.critical_speeds_rpm.iter().map(|c| number(*c, 0)).collect();
    let mut all = vec![("How noisy", noise)];
    if !critical.is_empty() {
        let critical = format!("Undamped critical speeds as drawn: {} rpm.", critical.join(", "));
        all.push(("Critical speeds", critical));
    }
    let in_truth = answer
        .truth
        .as_ref()
        .map_or_else(|| vec!["One effect is hidden, and told in the truth alone.".into()], of_truth);
    all.extend(in_truth.into_iter().map(|sentence| ("In truth", sentence)));
    all.extend(answer.remarks.iter().map(|remark| ("Remarks", remark.clone())));
    all
}

fn of_truth(truth: &TruthAnswer) -> Vec<String> {
    let planes: Vec<String> = (truth.unbalance.iter())
        .map(|u| match u.unbalance_g_mm {
            0.0 => format!("none in plane {}", u.name),
            size => {
                format!("{} at {:.0}° in plane {}", quantity(size * 1e-6, None, "kg·m"), u.angle_deg, u.name)
            }
        })
        .collect();
    let mut all = vec![format!("Unbalance: {}.", planes.join(", "))];
    all.extend(truth.effects.iter().map(|e| format!("Effect: {}.", effect(e))));
    let farthest = truth.drawing.iter().map(|d| d.deviations.abs()).fold(0.0, f64::max);
    if !truth.drawing.is_empty() {
        all.push(format!(
            "Drawing: {} of its numbers are off, by up to {farthest:.1} standard deviations of their tolerances.",
            truth.drawing.len()
        ));
    }
    all
}

/// An effect with its parameters.
fn effect(effect: &SimulatedEffect) -> String {
    let unit = |name: &str| effect.units.get(name).copied().unwrap_or_default();
    let parameters: Vec<String> = (effect.parameters.iter())
        .map(|(name, value)| format!("{name} = {}", written(value, unit(name))))
        .collect();
    match parameters.is_empty() {
        true => effect.label(),
        false => format!("{} with {}", effect.label(), parameters.join(", ")),
    }
}

/// A number, a phasor, or phasors.
fn written(value: &Value, unit: &str) -> String {
    let Value::Array(parts) = value else { return quantity(value.as_f64().unwrap_or(f64::NAN), None, unit) };
    match parts.iter().map(Value::as_f64).collect::<Option<Vec<f64>>>().as_deref() {
        Some(&[re, im]) => {
            let size = quantity(re.hypot(im), None, unit).replace("µm", "µm 0-pk");
            format!("{size} at {:.0}°", im.atan2(re).to_degrees())
        }
        _ => parts.iter().map(|part| written(part, unit)).collect::<Vec<_>>().join(" and "),
    }
}
