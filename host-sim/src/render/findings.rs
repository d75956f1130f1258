//! Sentences and a section for what data determine besides the verdict.

use crate::answers::diagnose::FittedAnswer;
use crate::answers::findings::{DeterminedAnswer, DeterminedPlaneAnswer, NoiseAnswer, UnknownCauseAnswer};
use crate::render::Section;
use crate::render::quantity::quantity;

/// Label of a cause that no known effect is, among candidates.
pub const OUTSIDE: &str = "a cause outside the list";

/// The noise over what was stated, in one line.
pub fn noise(noise: &NoiseAnswer) -> String {
    let between = if noise.between_runs > 0.0 {
        format!(", and {:.2} % of the response from run to run", 100.0 * noise.between_runs)
    } else {
        String::new()
    };
    format!(
        "noise as found: {:.2} times what is stated, correlated from reading to reading by {:.2}{between}",
        noise.scale, noise.correlation
    )
}

/// Each plane with its 95 % interval, one line each.
pub fn planes(determined: &DeterminedAnswer) -> Vec<String> {
    let planes = determined.planes.as_deref().unwrap_or_default();
    let mut lines: Vec<String> = planes.iter().map(plane).collect();
    let Some([condition]) = determined.condition else { return lines };
    if determined.act_alike {
        lines.push(format!(
            "the planes act alike (condition {condition:.0}): one combination of them is known that much better than another"
        ));
    } else if planes.len() > 1 {
        lines.push(format!(
            "condition of the planes: {condition:.1} (how much better their best-seen combination is known than the worst)"
        ));
    }
    lines
}

fn plane(p: &DeterminedPlaneAnswer) -> String {
    let [low, high] = p.interval_95;
    let angle = if p.angle_95_deg < 90.0 {
        format!("{:.0}° ± {:.0}°", p.angle_deg, p.angle_95_deg)
    } else {
        "any angle".to_string()
    };
    format!(
        "unbalance of {}: {:.0} g·mm ({low:.0} to {high:.0} with 95 %) at {angle}",
        p.name, p.unbalance_g_mm
    )
}

/// A cause outside the list, in sentences.
pub fn unknown(cause: &UnknownCauseAnswer) -> String {
    let what = match (cause.acts_like, &cause.drawing) {
        (_, Some(drawing)) => format!(
            "the drawing is off by more than its tolerance ({:.0} % sure of that); most of all {drawing}",
            100.0 * cause.place_probability
        ),
        ("bearings", None) => acts(cause, "bearings that change with speed"),
        ("stiffness", None) => acts(cause, "a support that the model lacks"),
        _ => acts(cause, "a force"),
    };
    format!(
        "A cause outside the list, {:.0} % sure: {what}. What looks like that: {}.",
        100.0 * cause.probability,
        cause.looks_like
    )
}

fn acts(cause: &UnknownCauseAnswer, as_what: &str) -> String {
    format!(
        "what is missing acts like {as_what}, most near {:.3} m from the left end ({:.0} % sure of that): {} whirl, {}, \
         largest at {:.0} rpm with {:.3} N",
        cause.position_m,
        100.0 * cause.place_probability,
        cause.whirl.unwrap_or_default(),
        cause.growth.unwrap_or_default(),
        cause.speed_rpm.unwrap_or(f64::NAN),
        cause.force_n.unwrap_or(f64::NAN),
    )
}

/// Fitted parameters with their uncertainty, one line each.
pub fn parameters(fitted: &FittedAnswer) -> Vec<String> {
    let line = |p: &rotor_edge_desktop::diagnose::FittedParameter| match p.value.as_slice() {
        [re, im] => {
            let (size, angle) = (re.hypot(*im), im.atan2(*re).to_degrees());
            format!("{} = {} at {angle:.1}°", p.name, quantity(size, p.sd, p.unit))
        }
        other => {
            let value = other.first().copied().unwrap_or(f64::NAN);
            format!("{} = {}", p.name, quantity(value, p.sd, p.unit))
        }
    };
    let mut lines: Vec<String> = fitted.parameters.iter().map(line).collect();
    lines.extend(fitted.disqualified.clone());
    lines
}

/// All of it as a section of a page.
pub fn section(
    found: &NoiseAnswer,
    determined: &DeterminedAnswer,
    cause: Option<&UnknownCauseAnswer>,
) -> Section {
    let mut paragraphs: Vec<String> = cause.map(unknown).into_iter().collect();
    paragraphs.push(sentence(&noise(found)));
    paragraphs.extend(planes(determined).iter().map(|line| sentence(line)));
    Section { heading: "What the data say for sure".into(), paragraphs, ..Section::default() }
}

/// A line as a sentence of its own.
fn sentence(line: &str) -> String {
    let mut letters = line.chars();
    letters.next().map_or_else(String::new, |first| format!("{}{}.", first.to_uppercase(), letters.as_str()))
}
