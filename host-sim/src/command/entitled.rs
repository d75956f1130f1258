//! What data entitle to, as commands say it: the noise as it was found, the planes with their intervals, a cause
//! that no known effect is, runs whose weights are not as stated.

use rotor_edge_desktop::diagnose::{
    Account, EquivalentForce, FoundWeight, Nature, PlaneUnbalances, RefutedRun, Scatter, UnknownCause,
};
use serde_json::{Value, json};

use crate::render::Section;

/// Label of a cause that no known effect is, among candidates.
pub const OUTSIDE: &str = "a cause outside the list";

/// The noise over what was stated, in one line.
pub fn noise(scatter: &Scatter) -> String {
    let between = if scatter.between_runs > 0.0 {
        format!(", and {:.2} % of the response from run to run", 100.0 * scatter.between_runs)
    } else {
        String::new()
    };
    format!(
        "noise as found: {:.2} times what is stated, correlated from reading to reading by {:.2}{between}",
        scatter.scale, scatter.correlation
    )
}

/// Each plane with its 95 % interval, one line each.
pub fn planes(determined: &PlaneUnbalances) -> Vec<String> {
    let line = |p: &rotor_edge_desktop::diagnose::PlaneUnbalance| {
        let [low, high] = p.interval_95_g_mm;
        let angle = if p.angle_95_deg < 90.0 {
            format!("{:.0}° ± {:.0}°", p.angle_deg, p.angle_95_deg)
        } else {
            "any angle".to_string()
        };
        format!(
            "unbalance of {}: {:.0} g·mm ({low:.0} to {high:.0} with 95 %) at {angle}",
            p.name, p.unbalance_g_mm
        )
    };
    let mut lines: Vec<String> = determined.planes.iter().map(line).collect();
    if determined.separation.acts_alike() {
        lines.push(format!(
            "the planes act alike (condition {:.0}): one combination of them is known that much better than another",
            determined.separation.condition
        ));
    } else if determined.planes.len() > 1 {
        lines.push(format!(
            "condition of the planes: {:.1} (how much better their best-seen combination is known than the worst)",
            determined.separation.condition
        ));
    }
    lines
}

/// A cause outside the list, in sentences.
pub fn unknown(cause: &UnknownCause) -> String {
    let acts = |as_what: &str, force: &EquivalentForce| {
        format!(
            "what is missing acts like {as_what}, most near {:.3} m from the left end ({:.0} % sure of that): {} whirl, {}, \
             largest at {:.0} rpm with {:.3} N",
            cause.position_m,
            100.0 * cause.place_probability,
            force.whirl(),
            force.growth_in_words(),
            force.speed_rpm,
            force.force_n,
        )
    };
    let what = match &cause.nature {
        Nature::Force(force) => acts("a force", force),
        Nature::Bearings(force) => acts("bearings that change with speed", force),
        Nature::Stiffness(force) => acts("a support that the model lacks", force),
        Nature::Drawing(what) => format!(
            "the drawing is off by more than its tolerance ({:.0} % sure of that); most of all {what}",
            100.0 * cause.place_probability
        ),
    };
    format!(
        "A cause outside the list, {:.0} % sure: {what}. What looks like that: {}.",
        100.0 * cause.probability,
        cause.looks_like()
    )
}

/// All of it as a section of a report.
pub fn section(scatter: &Scatter, determined: &PlaneUnbalances, cause: Option<&UnknownCause>) -> Section {
    let mut paragraphs: Vec<String> = cause.map(unknown).into_iter().collect();
    paragraphs.push(sentence(&noise(scatter)));
    paragraphs.extend(planes(determined).iter().map(|line| sentence(line)));
    Section { heading: "What the data say for sure".into(), paragraphs, ..Section::default() }
}

/// A line as a sentence of its own.
fn sentence(line: &str) -> String {
    let mut letters = line.chars();
    letters.next().map_or_else(String::new, |first| format!("{}{}.", first.to_uppercase(), letters.as_str()))
}

/// `noise` of the JSON answers.
pub fn noise_json(scatter: &Scatter) -> Value {
    json!({"scale": scatter.scale, "correlation": scatter.correlation, "between_runs": scatter.between_runs})
}

/// `determined` of the JSON answers.
pub fn determined_json(determined: &PlaneUnbalances) -> Value {
    let planes: Vec<Value> = (determined.planes.iter())
        .map(|p| {
            json!({
                "name": p.name,
                "unbalance_g_mm": p.unbalance_g_mm,
                "angle_deg": p.angle_deg,
                "interval_95": p.interval_95_g_mm,
                "angle_95_deg": p.angle_95_deg,
                "region": p.region.ellipse(),
                "determined": p.is_determined(),
            })
        })
        .collect();
    json!({"planes": planes, "condition": [determined.separation.condition]})
}

/// `refuted_runs` of the JSON answers.
pub fn refuted_json(refuted: &[RefutedRun]) -> Value {
    let stated = |w: &FoundWeight| {
        json!({
            "plane": w.found.name,
            "magnitude_g_mm": w.stated_g_mm.norm(),
            "angle_deg": w.stated_g_mm.arg().to_degrees(),
        })
    };
    let found = |w: &FoundWeight| {
        json!({
            "plane": w.found.name,
            "magnitude_g_mm": w.found.unbalance_g_mm,
            "angle_deg": w.found.angle_deg,
            "interval_95": w.found.interval_95_g_mm,
            "angle_95_deg": w.found.angle_95_deg,
            "account": w.account.map(Account::words),
        })
    };
    let run = |r: &RefutedRun| {
        json!({
            "run": r.run,
            "probability": r.probability,
            "stated": r.weights.iter().map(stated).collect::<Vec<_>>(),
            "found": r.weights.iter().map(found).collect::<Vec<_>>(),
        })
    };
    refuted.iter().map(run).collect()
}

/// `unknown` of the JSON answers.
pub fn unknown_json(cause: &UnknownCause) -> Value {
    let (acts_like, drawing) = match &cause.nature {
        Nature::Force(_) => ("force", None),
        Nature::Bearings(_) => ("bearings", None),
        Nature::Stiffness(_) => ("stiffness", None),
        Nature::Drawing(what) => ("drawing", Some(what)),
    };
    let force = cause.force();
    json!({
        "acts_like": acts_like,
        "drawing": drawing,
        "position_m": cause.position_m,
        "place_probability": cause.place_probability,
        "probability": cause.probability,
        "growth": force.map(EquivalentForce::growth_in_words),
        "whirl": force.map(EquivalentForce::whirl),
        "forward_share": force.map(|f| f.forward),
        "speed_rpm": force.map(|f| f.speed_rpm),
        "force_n": force.map(|f| f.force_n),
        "looks_like": cause.looks_like(),
    })
}
