//! Tables and sentences of an answer of `startup`, for terminal and page.

use crate::answers::shared::ByName;
use crate::answers::startup::{
    EvaluatedStartup, NumberAnswer, OwnUnbalance, ShiftAnswer, StageAnswer, StartupAnswer,
};

/// A resonance changes if its slope over the amplitude squared is this many standard deviations from none.
const CHANGES_SIGMAS: f64 = 4.0;

/// What the two-degree model is made of.
pub fn model_lines(answer: &StartupAnswer) -> Vec<String> {
    vec![
        format!(
            "Two-degree model: mass {:.3} kg on the shaft's {:.0} N/m (beam theory, at the disk).",
            answer.mass_kg, answer.shaft_stiffness_n_m
        ),
        format!(
            "With the shaft's own share (Rayleigh) the mass would be {:.3} kg, and every stiffness and damping higher \
             in proportion: --mass-kg {0:.3}",
            answer.effective_mass_kg
        ),
    ]
}

/// A number, with its 95 % half-width where the two-degree model has one.
fn with_half(v: NumberAnswer, decimals: usize, model_adequate: bool) -> String {
    let [low, high] = v.interval_95;
    match model_adequate {
        true => format!("{:.decimals$} ± {:.decimals$}", v.value, 0.5 * (high - low)),
        false => format!("{:.decimals$}", v.value),
    }
}

/// What the table of estimates shows, and how sure it is.
pub fn estimate_caption(answer: &StartupAnswer) -> String {
    let sure = match answer.two_degree_adequate {
        true => "± is a 95 % half-width".to_string(),
        false => {
            "no 95 % interval is stated, because noise does not explain what the two-degree model leaves"
                .into()
        }
    };
    format!("The two-degree model three ways, over all runs; {sure}")
}

/// Headings of the table of estimates.
pub const ESTIMATE_COLUMNS: [&str; 7] =
    ["direction", "method", "natural, rpm", "damping ratio", "c, N·s/m", "k, N/m", "bearings, N/m"];

/// Rows of the table of estimates.
pub fn estimate_rows(answer: &StartupAnswer) -> Vec<[String; 7]> {
    let number = |v: NumberAnswer, decimals: usize| with_half(v, decimals, answer.two_degree_adequate);
    let mut rows = Vec::new();
    for (direction, estimates) in answer.estimates.iter() {
        for (name, estimate) in estimates.methods.iter() {
            let Some(e) = estimate else { continue };
            let bearing = e.bearing_stiffness_n_m;
            rows.push([
                direction.to_string(),
                name.replace('_', " "),
                number(e.natural_rpm, 1),
                number(e.damping_ratio, 4),
                number(e.damping_n_s_m, 2),
                number(e.stiffness_n_m, 0),
                bearing.map_or("shaft alone is softer".into(), |b| number(b, 0)),
            ]);
        }
    }
    rows
}

/// Whether the resonance changes with the amplitude, by direction and on the whole.
pub fn shift_lines(answer: &StartupAnswer) -> Vec<String> {
    let known = || answer.estimates.iter().filter_map(|(d, e)| Some((d, e.shift.as_ref()?)));
    let number = |v: NumberAnswer, decimals: usize| with_half(v, decimals, answer.two_degree_adequate);
    let line = |(direction, s): (&str, &ShiftAnswer)| {
        let (natural, ratio) = (&s.natural_rpm, &s.damping_ratio);
        format!(
            "{direction}: from small motion to {:.0} µm 0-pk the natural speed goes from {} to {:.1} rpm ({:+.1} σ), the damping ratio \
             from {} to {:.4} ({:+.1} σ)",
            s.largest_um,
            number(natural.small_motion, 1),
            natural.at_largest,
            natural.sigmas,
            number(ratio.small_motion, 4),
            ratio.at_largest,
            ratio.sigmas
        )
    };
    let mut lines: Vec<String> = known().map(line).collect();
    if lines.is_empty() {
        return vec![
            "One run, or runs alike: whether the resonance changes with the amplitude cannot be seen.".into(),
        ];
    }
    // directions are measured apart, so their deviations add up like noise
    let together =
        |of: fn(&ShiftAnswer) -> f64| known().map(|(_, s)| of(s)).sum::<f64>() / (lines.len() as f64).sqrt();
    let (natural, ratio) = (together(|s| s.natural_rpm.sigmas), together(|s| s.damping_ratio.sigmas));
    let way = |z: f64| match z {
        z if z < -CHANGES_SIGMAS => "falls",
        z if z > CHANGES_SIGMAS => "rises",
        _ => "stays",
    };
    let meaning = if natural.abs().max(ratio.abs()) > CHANGES_SIGMAS {
        "a linear machine's do not change, so the stiffness depends on the amplitude"
    } else {
        "as a linear machine's do"
    };
    lines.push(format!(
        "As mass is added the natural speed {} ({natural:+.1} σ in all) and the damping ratio {} ({ratio:+.1} σ): {meaning}.",
        way(natural),
        way(ratio)
    ));
    lines
}

/// Headings of the table of runs.
pub const RUN_COLUMNS: [&str; 6] =
    ["run", "direction", "peak, µm 0-pk", "at, rpm", "half-power points, rpm", "µm 0-pk per g·mm"];

/// Rows of the table of runs: what is marked in the Bode plot, and the peak per unbalance where own and
/// added unbalance are known; a linear machine's is the same in every run.
pub fn run_rows(answer: &StartupAnswer) -> Vec<[String; 6]> {
    let mut rows = Vec::new();
    for run in &answer.runs {
        for (direction, seen) in run.half_power.iter() {
            let (Some(peak_um), Some(peak_rpm), Some([before, after])) =
                (seen.peak_um, seen.peak_rpm, seen.half_power_rpm)
            else {
                continue;
            };
            rows.push([
                run.run.clone(),
                direction.to_string(),
                format!("{peak_um:.1}"),
                format!("{peak_rpm:.1}"),
                format!("{before:.1} to {after:.1}"),
                seen.peak_um_per_g_mm.map_or("–".into(), |per| format!("{per:.3}")),
            ]);
        }
    }
    rows
}

/// Amplitudes as the industry gives them.
pub fn pk_pk(sizes_m: &[f64]) -> String {
    sizes_m.iter().map(|s| format!("{:.1}", 2e6 * s)).collect::<Vec<_>>().join(" / ")
}

/// Headings of the table of models.
pub fn stage_columns(evaluated: &EvaluatedStartup) -> Vec<String> {
    let mut columns = vec!["model".to_string()];
    for speed in &evaluated.speeds_rpm {
        columns.extend(evaluated.bearings.iter().map(|b| format!("{b} at {speed:.0} rpm, %")));
    }
    let [from, to] = evaluated.range_rpm;
    columns.push(format!("largest, {from:.0} to {to:.0} rpm, %"));
    columns.push("χ² per value".into());
    columns
}

/// Rows of the table of models: the largest error over all runs, in percent of the clearance.
pub fn stage_rows(answer: &StartupAnswer, bearings: &[String; 2]) -> Vec<Vec<String>> {
    let row = |stage: &StageAnswer| {
        let mut cells = vec![stage.model.clone()];
        for (_, by_bearing) in stage.error_percent_of_clearance.iter() {
            for bearing in bearings {
                let here = by_bearing.get(bearing).into_iter().flat_map(ByName::iter);
                let largest = here.map(|(_, percent)| *percent).reduce(f64::max);
                cells.push(largest.map_or("–".into(), |percent| format!("{percent:.1}")));
            }
        }
        let percent = |s: &&crate::answers::startup::StageAtSpeed| s.error_percent_of_clearance;
        let largest = stage.by_speed.iter().max_by(|a, b| percent(a).total_cmp(&percent(b)));
        cells.push(largest.map_or("–".into(), |s| {
            format!(
                "{:.1} (at {:.0}; noise {:.1})",
                s.error_percent_of_clearance, s.speed_rpm, s.noise_percent_of_clearance
            )
        }));
        cells.push(stage.chi2_per_value.map_or(String::new(), |c| format!("{c:.2}")));
        cells
    };
    answer.stages.iter().map(row).collect()
}

fn stated(own: &OwnUnbalance) -> String {
    let ([low, high], angle_deg) = (own.interval_95, own.angle_deg);
    match (own.model_adequate, own.angle_95_deg < 180.0) {
        (true, true) => format!(
            "{:.3} ± {:.3} g·mm at {angle_deg:.2}° ± {:.2}° with rotation",
            own.g_mm,
            0.5 * (high - low),
            own.angle_95_deg
        ),
        (true, false) => format!("{:.3} g·mm ({low:.3} to {high:.3} with 95 %) at any angle", own.g_mm),
        (false, _) => {
            format!(
                "{:.3} g·mm at {angle_deg:.2}° with rotation (no interval: the model does not fit)",
                own.g_mm
            )
        }
    }
}

/// The disk's own unbalance by both models, pedestals, and what was said of a bow.
pub fn own_lines(answer: &StartupAnswer) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(own) = &answer.own_unbalance_two_degree {
        lines.push(format!(
            "Own unbalance by the two-degree model: {}; the trial weights weigh a moving mass of {:.3} kg.",
            stated(own),
            own.modal_mass_kg.unwrap_or(f64::NAN)
        ));
    }
    let Some(improved) = &answer.improved else { return lines };
    for own in &improved.own_unbalance {
        lines.push(format!("Own unbalance by the last model: {}.", stated(own)));
    }
    for pedestal in &improved.pedestal_resonance_rpm {
        let [low, high] = pedestal.interval_95;
        let half = match improved.model_adequate {
            true => format!(" ± {:.0}", 0.5 * (high - low)),
            false => String::new(),
        };
        lines.push(format!("Pedestal {} resonates at {:.0}{half} rpm.", pedestal.at, pedestal.rpm));
    }
    if improved.effects.iter().any(|e| e.effect == "shaft_bow") {
        lines.push("A bow is there beside the own unbalance: its pull is the same at every speed, the other's grows with Ω².".into());
    } else if let Some(bow) = &improved.shaft_bow_not_added {
        lines.push(format!(
            "A shaft bow, which would pull the same at every speed where own unbalance grows with Ω², is not supported \
             (evidence {:+.1}, {:.1} % probable).",
            bow.twice_log_bayes_factor,
            100.0 * bow.probability
        ));
    }
    lines
}
