//! Text and section of an answer of `balance --trial-only`.

use rotor_edge_desktop::balance::places::Holes;

use super::balance::{around_the_shaft, weights_in_a_sentence};
use super::text;
use super::weights::Weight;
use super::{PageTable, Section, Story};
use crate::answers::balance::{AngleSense, LeftAnswer, TrialBalance, TrialWeight, VectorAnswer};
use crate::scale::{four_digits, three_digits};

const VIBRATION_COLUMNS: [&str; 5] = ["probe", "speed, rpm", "before", "after", "after, at most (95 %)"];
/// More rows than this say nothing to a reader; they are in the JSON and on the page.
const MOST_ROWS: usize = 40;

/// The whole answer on a terminal.
pub fn text(answer: &TrialBalance) -> String {
    let line = |line: &String| format!("{line}\n");
    let mut text = format!(
        "{}\n\n{}\n{}\n",
        verdict(answer),
        title(answer),
        text::table(&weight_columns(answer).each_ref().map(String::as_str), &weight_rows(answer))
    );
    text.extend(answer.weights.iter().map(|w| line(&w.text)));
    text += "\n";
    let rows = vibration_rows(answer);
    if rows.len() <= MOST_ROWS {
        text += &text::table(&VIBRATION_COLUMNS, &rows);
    }
    text.extend(lines(answer).iter().map(line));
    if !answer.doubts.is_empty() {
        text += "\n";
    }
    text.extend(answer.doubts.iter().map(line));
    text
}

/// The weights, and the vibration with and without them.
pub fn section(answer: &TrialBalance) -> Section {
    let table = |caption: String, columns: &[&str], rows: Vec<Vec<String>>| PageTable {
        caption,
        columns: columns.iter().map(|c| (*c).to_string()).collect(),
        rows,
    };
    let mut paragraphs: Vec<String> = answer.weights.iter().map(|w| w.text.clone()).collect();
    paragraphs.extend(lines(answer));
    paragraphs.extend(answer.doubts.iter().cloned());
    let vibration = format!("Vibration, {} 0-pk", unit(answer));
    Section {
        heading: "Weights".into(),
        paragraphs,
        tables: vec![
            table(
                title(answer),
                &weight_columns(answer).each_ref().map(String::as_str),
                weight_rows(answer).into_iter().map(Vec::from).collect(),
            ),
            table(vibration, &VIBRATION_COLUMNS, vibration_rows(answer).into_iter().map(Vec::from).collect()),
        ],
        figures: Vec::new(),
    }
}

/// The weights and what they do, in one sentence; with a criterion of the largest vibration by that.
fn verdict(answer: &TrialBalance) -> String {
    let weight = |w: &TrialWeight| {
        format!("{} {} at {:.0}°", three_digits(w.magnitude), answer.weight_unit, w.angle_deg)
    };
    let weights: Vec<(&str, String)> = answer.weights.iter().map(|w| (w.plane.as_str(), weight(w))).collect();
    weights_in_a_sentence(&weights, vibration(answer), &format!("{} 0-pk", unit(answer)))
}

/// Before and with the weights: of all probes and speeds the root mean square or the largest, as the criterion is.
fn vibration(answer: &TrialBalance) -> [f64; 2] {
    let of = |value: fn(&LeftAnswer) -> f64| match answer.criterion {
        "min_max" => most(answer, value),
        _ => rms(answer, value),
    };
    [of(|l| l.before), of(|l| l.after)]
}

fn rms(answer: &TrialBalance, of: fn(&LeftAnswer) -> f64) -> f64 {
    (answer.left.iter().map(|l| of(l).powi(2)).sum::<f64>() / answer.left.len() as f64).sqrt()
}

fn most(answer: &TrialBalance, of: fn(&LeftAnswer) -> f64) -> f64 {
    answer.left.iter().map(of).fold(0.0, f64::max)
}

/// The first screen of the page; `holes` are those that weights were placed in.
pub fn story(answer: &TrialBalance, holes: Option<&Holes>) -> Story {
    let drawn: Vec<Weight> = answer
        .weights
        .iter()
        .map(|w| Weight {
            plane: w.plane.clone(),
            wanted: w.wanted_g_mm,
            placed: w.placed.iter().map(|p| (p.unbalance_g_mm, p.hole)).collect(),
        })
        .collect();
    let at_most = answer.left.iter().filter_map(|l| l.after_at_most).reduce(f64::max);
    let sure = answer.weights.iter().filter_map(|w| {
        let ([low, high], half_deg) = w.magnitude_interval_95.zip(w.angle_95_deg)?;
        Some(format!(
            "{}: {} to {} {}, ± {half_deg:.1}° (95 %).",
            w.plane,
            four_digits(low),
            four_digits(high),
            answer.weight_unit
        ))
    });
    let sure: Vec<String> = sure.chain(lines(answer).pop()).collect();
    let mut answers = vec![
        ("Where", answer.weights.iter().map(|w| w.text.clone()).collect::<Vec<_>>().join(" ")),
        ("How sure", sure.join(" ")),
    ];
    answers.extend((!answer.doubts.is_empty()).then(|| ("Doubts", answer.doubts.join(" "))));
    let next = match at_most {
        Some(at_most) => format!(
            "Put the weights in and repeat the run. More than {} {} 0-pk means a wrong place or a changed machine.",
            four_digits(at_most),
            unit(answer)
        ),
        None => "Put the weights in and repeat the run before you rely on them.".into(),
    };
    Story {
        verdict: verdict(answer),
        answers,
        next: (next, None),
        beside: vec![around_the_shaft(&drawn, holes, answer.sense == AngleSense::AgainstRotation)],
        below: Vec::new(),
    }
}

/// Unit of the vibration as people write it.
fn unit(answer: &TrialBalance) -> &str {
    match answer.unit.as_str() {
        "um" => "µm",
        "mm_s" => "mm/s",
        "m_s2" => "m/s²",
        "in_s" => "in/s",
        other => other,
    }
}

/// What the weights are for.
fn title(answer: &TrialBalance) -> String {
    let to = match (&answer.onto, answer.by_kept_coefficients) {
        (Some(run), _) => format!("to add to what run \"{run}\" has"),
        (None, true) => "to add to the machine as it was measured, by earlier coefficients".into(),
        (None, false) => "for the machine without trial weights".into(),
    };
    let least = match answer.criterion {
        "min_max" => "the largest vibration least",
        _ => "least squares",
    };
    format!("Correction weights {to}, {least}; angles from the keyphasor mark, {}", answer.angles)
}

fn weight_columns(answer: &TrialBalance) -> [String; 3] {
    let is_mass = answer.weights.iter().any(|w| w.magnitude_g_mm.is_none());
    let what = if is_mass { "weight" } else { "unbalance" };
    ["plane".into(), format!("{what} to add, {}", answer.weight_unit), "angle".into()]
}

fn weight_rows(answer: &TrialBalance) -> Vec<[String; 3]> {
    let row = |w: &TrialWeight| {
        let (size, angle_deg) = (four_digits(w.magnitude), w.angle_deg);
        match w.magnitude_interval_95.zip(w.angle_95_deg) {
            Some(([from, to], half_deg)) => [
                w.plane.clone(),
                format!("{size} ({} to {} with 95 %)", four_digits(from), four_digits(to)),
                match half_deg < 180.0 {
                    true => format!("{angle_deg:.1}° ± {half_deg:.1}°"),
                    false => format!("{angle_deg:.1}°, any with 95 %"),
                },
            ],
            None => [w.plane.clone(), size, format!("{angle_deg:.1}°")],
        }
    };
    answer.weights.iter().map(row).collect()
}

fn vibration_rows(answer: &TrialBalance) -> Vec<[String; 5]> {
    let row = |l: &LeftAnswer| {
        let at_most = l.after_at_most.map_or("–".into(), four_digits);
        [l.probe.clone(), format!("{:.0}", l.speed_rpm), four_digits(l.before), four_digits(l.after), at_most]
    };
    answer.left.iter().map(row).collect()
}

/// Static part and couple of two planes in words, and what the weights do.
fn lines(answer: &TrialBalance) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(parts) = &answer.static_couple {
        let phasor = |u: &VectorAnswer| {
            let size = four_digits(u.magnitude_g_mm / answer.weight_scale);
            format!("{size} {} at {:.1}°", answer.weight_unit, u.angle_deg)
        };
        lines.push(format!(
            "Static: {} in all. Couple: {} in plane {}, its opposite in plane {}.",
            phasor(&parts.static_unbalance),
            phasor(&parts.couple),
            answer.weights[0].plane,
            answer.weights[1].plane
        ));
    }
    let [rms, most] = [rms, most].map(|size| move |of: fn(&LeftAnswer) -> f64| four_digits(size(answer, of)));
    lines.push(format!(
        "Vibration with these weights, {} 0-pk: {} becomes {} root mean square, {} becomes {} at most.",
        unit(answer),
        rms(|l| l.before),
        rms(|l| l.after),
        most(|l| l.before),
        most(|l| l.after)
    ));
    let values = answer.noise_values.unwrap_or_default();
    lines.push(match answer.noise {
        "stated" => "Intervals (± is a 95 % half-width) from the stated noise.".into(),
        "runs" => {
            format!("Intervals from the scatter between the runs ({values} degrees of freedom).")
        }
        "readings" => format!("Intervals from repeated readings ({values} values)."),
        _ => "No intervals: the noise is not known.".into(),
    });
    lines
}
