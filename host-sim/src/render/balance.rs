//! Text and section of an answer of `balance` with a rotor's file.

use nalgebra::Complex;
use rotor_edge_desktop::balance::places::Holes;

use super::text;
use super::trend::{Trend, trend};
use super::weights::{Weight, weights};
use super::{Figure, PageTable, Section, Story, identifier};
use crate::answers::balance::{
    AngleSense, BalanceAnswer, PieceAnswer, VibrationAtSpeed, WayAnswer, WeightAnswer,
};
use crate::scale::three_digits;

/// Least vibration that a sentence states, of that before.
const LEAST_LEFT: f64 = 1e-3;
/// Planes that one sentence lists before the last.
const MOST_IN_A_SENTENCE: usize = 2;

const COLUMNS: [&str; 5] = ["by", "plane", "unbalance to add, g·mm", "angle", "weight"];

/// The whole answer on a terminal.
pub fn text(answer: &BalanceAnswer) -> String {
    let mut text = format!("{}\n\n", verdict(answer));
    text += &format!(
        "Correction weights for the machine without trial weights; angles from the keyphasor mark, {}\n{}\n",
        answer.angles,
        text::table(&COLUMNS, &rows(answer))
    );
    effect_lines(answer).iter().for_each(|line| text += &format!("{line}\n"));
    text += &format!("{}\n", legend(answer));
    if !answer.remarks.is_empty() {
        text += "\n";
    }
    answer.remarks.iter().for_each(|remark| text += &format!("{remark}\n"));
    text
}

/// The way that the answer relies on: the first that describes the data, else the first.
fn relied_on(answer: &BalanceAnswer) -> &WayAnswer {
    answer.ways.iter().find(|way| way.model_adequate).unwrap_or(&answer.ways[0])
}

/// The weights and what they do, in one sentence.
fn verdict(answer: &BalanceAnswer) -> String {
    let way = relied_on(answer);
    let weight = |w: &WeightAnswer| format!("{} g·mm at {:.0}°", three_digits(w.unbalance_g_mm), w.angle_deg);
    let weights: Vec<(&str, String)> = way.weights.iter().map(|w| (w.plane.as_str(), weight(w))).collect();
    let vibration = &way.vibration_um;
    weights_in_a_sentence(&weights, [vibration.before, vibration.after], "µm 0-pk")
}

/// Weights by plane, and the vibration before and with them.
pub(super) fn weights_in_a_sentence(
    weights: &[(&str, String)],
    [before, after]: [f64; 2],
    unit: &str,
) -> String {
    let all: Vec<String> =
        weights.iter().map(|(plane, weight)| format!("{weight} in plane {plane}")).collect();
    let all = match &all[..] {
        [before @ .., last] if !before.is_empty() && before.len() <= MOST_IN_A_SENTENCE => {
            format!("{} and {last}", before.join(", "))
        }
        [only] => only.clone(),
        more => format!("weights in {} planes", more.len()),
    };
    // as many weights as probes leave rounding errors, which are no prediction
    let least = LEAST_LEFT * before;
    let b = three_digits(before);
    let a = if after < least { format!("under {}", three_digits(least)) } else { three_digits(after) };
    let less = match 100.0 * (1.0 - after / before) {
        less if less > 99.0 => "over 99".to_string(),
        less => format!("{less:.0}"),
    };
    match after < before {
        true => format!("Add {all}: the vibration falls from {b} to {a} {unit} ({less} % less)."),
        false => format!("No weight that is allowed reduces the vibration of {b} {unit}."),
    }
}

/// The first screen of the page; `holes` are those that weights were placed in.
pub fn story(answer: &BalanceAnswer, holes: Option<&Holes>) -> Story {
    let way = relied_on(answer);
    let sense = match answer.angles == AngleSense::AgainstRotation.words() {
        true => -1.0,
        false => 1.0,
    };
    let place = |w: &WeightAnswer| match &w.placed[..] {
        [piece] if piece.hole.is_none() && piece.mass_g.is_none() => {
            format!("Plane {}, at {} {}.", w.plane, angle(way, w), answer.angles)
        }
        placed => format!("Plane {}, at {} {}: {}.", w.plane, angle(way, w), answer.angles, pieces(placed)),
    };
    let other = |other: &WayAnswer| {
        let weights = other.weights.iter().map(|w| {
            format!("{} g·mm at {:.0}° in plane {}", three_digits(w.unbalance_g_mm), w.angle_deg, w.plane)
        });
        format!("By the {}: {}.", other.by, weights.collect::<Vec<_>>().join(", "))
    };
    let others = answer.ways.iter().filter(|o| o.by != way.by).map(other);
    let [low, high] = way.vibration_um.after_interval_95;
    let sure = match way.model_adequate {
        true => format!(
            "By the {}: {} to {} µm 0-pk with the weights (95 %).",
            way.by,
            three_digits(low),
            three_digits(high)
        ),
        false => format!("By the {}, whose misfit noise does not explain, so no interval is stated.", way.by),
    };
    let grade = &way.grade_mm_s;
    let mut answers = vec![
        ("Where", way.weights.iter().map(place).collect::<Vec<_>>().join(" ")),
        ("How sure", std::iter::once(sure).chain(others).collect::<Vec<_>>().join(" ")),
        (
            "How much better",
            format!(
                "Balance grade G {} becomes G {} at {:.0} rpm.",
                three_digits(grade.before),
                // as in the first sentence
                three_digits(grade.after.max(LEAST_LEFT * grade.before)),
                answer.service_rpm
            ),
        ),
    ];
    answers.extend((!answer.remarks.is_empty()).then(|| ("Doubts", answer.remarks.join(" "))));
    let next = match way.model_adequate {
        true => format!(
            "Put the weights in and repeat the run. More than {} µm 0-pk means a wrong place or a changed machine.",
            three_digits(high)
        ),
        false => "Put the weights in and repeat the run before you rely on them.".into(),
    };
    let drawn: Vec<Weight> = way
        .weights
        .iter()
        .map(|w| Weight {
            plane: w.plane.clone(),
            wanted: Complex::from_polar(w.unbalance_g_mm, (sense * w.angle_deg).to_radians()),
            placed: w.placed.iter().map(|p| (p.unbalance_g_mm, p.hole)).collect(),
        })
        .collect();
    Story {
        verdict: verdict(answer),
        answers,
        next: (next, None),
        beside: vec![around_the_shaft(&drawn, holes, sense < 0.0)],
        below: Vec::new(),
    }
}

/// The weights on a polar plot.
pub(super) fn around_the_shaft(drawn: &[Weight], holes: Option<&Holes>, against_rotation: bool) -> Figure {
    let holes_are = if holes.is_some() { " Small circles on the rim: holes." } else { "" };
    Figure::new(
        "Weights around the shaft",
        format!("Lines: the unbalance to add in each plane; rings: the pieces that are put in.{holes_are}"),
        weights(drawn, holes, against_rotation),
    )
}

/// The weights, and the vibration with and without them.
pub fn section(answer: &BalanceAnswer) -> Section {
    let weights = PageTable {
        caption: format!(
            "Unbalance to add to the machine without trial weights; angles from the keyphasor mark, {}",
            answer.angles
        ),
        columns: COLUMNS.map(String::from).to_vec(),
        rows: rows(answer).into_iter().map(|r| r.to_vec()).collect(),
    };
    let line = |what: fn(&VibrationAtSpeed) -> f64, way: &WayAnswer| {
        way.by_speed.iter().map(|v| (v.speed_rpm, what(v))).collect::<Vec<_>>()
    };
    let mut curves = vec![("as found".to_string(), line(|v| v.before_um, &answer.ways[0]))];
    for way in &answer.ways {
        curves.push((format!("with weights by the {}", way.by), line(|v| v.after_um, way)));
    }
    let title = "Vibration by speed";
    let drawn = Trend { along: "speed, rpm".into(), quantity: "µm 0-pk".into(), curves, ..Trend::default() };
    let figure = Figure {
        id: identifier(title),
        drawing: trend(&drawn).into(),
        title: title.into(),
        caption: "Root mean square over the probes; with weights as predicted.".into(),
    };
    let mut paragraphs = effect_lines(answer);
    paragraphs.push(legend(answer));
    paragraphs.extend(answer.remarks.iter().cloned());
    Section { heading: "Weights".into(), paragraphs, tables: vec![weights], figures: vec![figure] }
}

fn rows(answer: &BalanceAnswer) -> Vec<[String; 5]> {
    let mut rows = Vec::new();
    for way in &answer.ways {
        for weight in &way.weights {
            rows.push([
                way.by.to_string(),
                weight.plane.clone(),
                size(way, weight),
                angle(way, weight),
                pieces(&weight.placed),
            ]);
        }
    }
    rows
}

/// The unbalance to add, with its 95 % interval where the way has one.
fn size(way: &WayAnswer, weight: &WeightAnswer) -> String {
    let (size, [low, high]) = (weight.unbalance_g_mm, weight.interval_95);
    match (way.model_adequate, low > 0.0) {
        (false, _) => format!("{size:.3}"),
        (true, true) => format!("{size:.3} ± {:.3}", 0.5 * (high - low)),
        (true, false) => format!("{size:.3} (0 to {high:.3})"),
    }
}

fn angle(way: &WayAnswer, weight: &WeightAnswer) -> String {
    match (way.model_adequate, weight.angle_95_deg < 180.0) {
        (true, true) => format!("{:.1}° ± {:.1}°", weight.angle_deg, weight.angle_95_deg),
        (true, false) => format!("{:.1}°, any with 95 %", weight.angle_deg),
        (false, _) => format!("{:.1}°", weight.angle_deg),
    }
}

/// What is put in, in words.
fn pieces(placed: &[PieceAnswer]) -> String {
    let piece = |p: &PieceAnswer| {
        let mass = p.mass_g.zip(p.radius_mm);
        let mass = mass.map(|(mass_g, radius_mm)| format!("{mass_g:.3} g at {radius_mm} mm"));
        match (mass, p.hole) {
            (Some(mass), Some(hole)) => format!("{mass} in hole {hole}"),
            (Some(mass), None) => mass,
            (None, Some(hole)) => format!("{:.3} g·mm in hole {hole}", p.magnitude),
            (None, None) => "–".into(),
        }
    };
    match placed {
        [] => "nothing".into(),
        placed => placed.iter().map(piece).collect::<Vec<_>>().join(", "),
    }
}

/// What the weights do, one sentence a way.
fn effect_lines(answer: &BalanceAnswer) -> Vec<String> {
    let line = |way: &WayAnswer| {
        let (vibration, grade) = (&way.vibration_um, &way.grade_mm_s);
        let [low, high] = vibration.after_interval_95;
        let (interval, at_most) = match way.model_adequate {
            true => (
                format!(" ({low:.2} to {high:.2} with 95 %)"),
                format!(", at most G {:.2} with 95 %", grade.after_at_most),
            ),
            false => Default::default(),
        };
        let rejected = if way.model_adequate {
            ""
        } else {
            " No 95 % interval is stated, because noise does not explain its misfit."
        };
        format!(
            "By the {}: {:.2} µm 0-pk becomes {:.2} µm 0-pk{interval}, {:.1} % less; balance grade G {:.2} becomes \
             G {:.2}{at_most}.{rejected}",
            way.by,
            vibration.before,
            vibration.after,
            100.0 * vibration.reduction,
            grade.before,
            grade.after,
        )
    };
    answer.ways.iter().map(line).collect()
}

/// What the figures of [`effect_lines`] are.
fn legend(answer: &BalanceAnswer) -> String {
    let [from, to] = answer.range_rpm;
    format!(
        "± is a 95 % half-width. Amplitudes are 0-pk, root mean square over probes and speeds from {from:.0} to {to:.0} rpm; \
         grades are those of ISO 21940-11 at {:.0} rpm, in mm/s.",
        answer.service_rpm
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sentence_states_no_rounding_error_and_no_false_gain() {
        let weights = [("A", "30.0 g·mm at 220°".to_string()), ("B", "20.0 g·mm at 80°".to_string())];
        let said = |after| weights_in_a_sentence(&weights, [36.8, after], "µm 0-pk");
        let head = "Add 30.0 g·mm at 220° in plane A and 20.0 g·mm at 80° in plane B: the vibration falls from 36.8 to ";
        assert_eq!(said(8.7e-15), format!("{head}under 0.0368 µm 0-pk (over 99 % less)."));
        assert_eq!(said(9.2), format!("{head}9.20 µm 0-pk (75 % less)."));
        assert_eq!(said(40.0), "No weight that is allowed reduces the vibration of 36.8 µm 0-pk.");
    }
}
