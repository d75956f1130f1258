//! Text and section of an answer of `balance` with a rotor's file.

use super::text;
use super::trend::{Trend, trend};
use super::{Figure, PageTable, Section, identifier};
use crate::answers::balance::{BalanceAnswer, PieceAnswer, VibrationAtSpeed, WayAnswer, WeightAnswer};

const COLUMNS: [&str; 5] = ["by", "plane", "unbalance to add, g·mm", "angle", "weight"];

/// The whole answer on a terminal.
pub fn text(answer: &BalanceAnswer) -> String {
    let mut text = format!(
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
