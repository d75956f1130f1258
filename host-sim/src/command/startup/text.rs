//! What `startup` prints for people.

use rotor_edge_desktop::startup::UncertainValue;
use rotor_edge_desktop::startup::estimate::{AmplitudeShift, METHODS};
use rotor_edge_desktop::startup::refinement::ModelRefinement;
use rotor_edge_desktop::startup::series::ProbeDirection;
use rotor_edge_desktop::unbalance::{G_MM, g_mm_deg};
use rotor_edge_desktop::units::rpm;

use super::answer::Answer;
use crate::command::{diagnose, output};

/// A resonance changes if its slope over the amplitude squared is this many standard deviations from none.
const CHANGES_SIGMAS: f64 = 4.0;

pub fn print(answer: &Answer) {
    for line in model_lines(answer) {
        println!("{line}");
    }
    println!("\nThree ways, over all runs, ± one standard deviation");
    output::table(&ESTIMATE_COLUMNS, &estimate_rows(answer));
    println!("\nPeak and half-power points");
    output::table(&RUN_COLUMNS, &run_rows(answer));
    println!("\nResonance and amplitude");
    for line in shift_lines(answer) {
        println!("  {line}");
    }
    for speed in &answer.speeds_rpm {
        print_errors(answer, *speed);
    }
    print_stages(answer);
    if let Some(chain) = &answer.chain {
        println!("\n{}: {}", chain.outcome.verdict.name(), chain.outcome.summary);
        for step in &chain.outcome.steps {
            println!("  {}", step.added.label());
            diagnose::parameter_lines(&step.added).iter().for_each(|line| println!("    {line}"));
        }
    }
    for line in own_lines(answer) {
        println!("{line}");
    }
    if !answer.remarks.is_empty() {
        println!();
    }
    answer.remarks.iter().for_each(|r| println!("{r}"));
}

/// What the two-degree model is made of.
pub fn model_lines(answer: &Answer) -> Vec<String> {
    let (found, spring) = (&answer.found, &answer.found.spring);
    vec![
        format!(
            "Two-degree model: mass {:.3} kg on the shaft's {:.0} N/m (beam theory, at the disk).",
            found.mass_kg, spring.stiffness_n_m
        ),
        format!(
            "With the shaft's own share (Rayleigh) the mass would be {:.3} kg, and every stiffness and damping higher \
             in proportion: --mass-kg {0:.3}",
            spring.effective_mass_kg
        ),
    ]
}

/// A number with its uncertainty.
pub fn with_sd(v: UncertainValue, factor: f64, decimals: usize) -> String {
    format!("{:.decimals$} ± {:.decimals$}", v.value * factor, v.sd * factor)
}

/// Headings of the table of estimates.
pub const ESTIMATE_COLUMNS: [&str; 7] =
    ["direction", "method", "natural, rpm", "damping ratio", "c, N·s/m", "k, N/m", "bearings, N/m"];

/// Rows of the table of estimates.
pub fn estimate_rows(answer: &Answer) -> Vec<[String; 7]> {
    let mut rows = Vec::new();
    for (direction, combined) in answer.found.directions.iter().zip(&answer.found.combined) {
        for (name, estimate) in METHODS.iter().zip(&combined.by_method) {
            let Some(e) = estimate else { continue };
            let bearing = e.bearing_stiffness_n_m;
            rows.push([
                direction.label.clone(),
                name.replace('_', " "),
                with_sd(e.natural_rad_s, rpm(1.0), 1),
                with_sd(e.damping_ratio, 1.0, 4),
                with_sd(e.damping_n_s_m, 1.0, 2),
                with_sd(e.stiffness_n_m, 1.0, 0),
                bearing.map_or("shaft alone is softer".into(), |b| with_sd(b, 1.0, 0)),
            ]);
        }
    }
    rows
}

/// Whether the resonance changes with the amplitude, by direction and on the whole.
pub fn shift_lines(answer: &Answer) -> Vec<String> {
    let found = &answer.found;
    let known = || found.directions.iter().zip(&found.shifts).filter_map(|(d, s)| Some((d, s.as_ref()?)));
    let line = |(d, s): (&ProbeDirection, &AmplitudeShift)| {
        let (natural, ratio) = (&s.natural_rad_s, &s.damping_ratio);
        format!(
            "{}: from small motion to {:.0} µm the natural speed goes from {} to {:.1} rpm ({:+.1} σ), the damping ratio \
             from {} to {:.4} ({:+.1} σ)",
            d.label,
            s.largest_m * 1e6,
            with_sd(natural.at_rest, rpm(1.0), 1),
            rpm(natural.at_largest),
            natural.sigmas,
            with_sd(ratio.at_rest, 1.0, 4),
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
    let together = |of: fn(&AmplitudeShift) -> f64| {
        known().map(|(_, s)| of(s)).sum::<f64>() / (lines.len() as f64).sqrt()
    };
    let (natural, ratio) = (together(|s| s.natural_rad_s.sigmas), together(|s| s.damping_ratio.sigmas));
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
    ["run", "direction", "peak, µm", "at, rpm", "half-power points, rpm", "µm per g·mm"];

/// Rows of the table of runs: what is marked in the Bode plot, and the peak per unbalance where own and
/// added unbalance are known; a linear machine's is the same in every run.
pub fn run_rows(answer: &Answer) -> Vec<[String; 6]> {
    let found = &answer.found;
    let own = answer.own_kg_m();
    let mut rows = Vec::new();
    for (run, row) in found.runs.iter().zip(&found.seen) {
        for (direction, seen) in found.directions.iter().zip(row) {
            let Ok((marks, _)) = &seen.half_power else { continue };
            let [before, after] = marks.half_power_rad_s.map(rpm);
            let per_unbalance = own.filter(|_| answer.is_known(run)).map_or("–".into(), |own| {
                format!("{:.3}", marks.peak[1] * 1e6 / ((own + run.added_kg_m).norm() * G_MM))
            });
            rows.push([
                run.label().to_string(),
                direction.label.clone(),
                format!("{:.1}", marks.peak[1] * 1e6),
                format!("{:.1}", rpm(marks.peak[0])),
                format!("{before:.1} to {after:.1}"),
                per_unbalance,
            ]);
        }
    }
    rows
}

fn print_errors(answer: &Answer, speed_rpm: f64) {
    let found = &answer.found;
    let model = &answer.stages[0].motion;
    let errors = found.errors_at(&answer.readings, model, speed_rpm);
    if errors.is_empty() {
        return;
    }
    let at = answer.readings[errors[0].row].speed_rpm;
    println!("\nTwo-degree model at {at:.0} rpm, µm pk-pk along the bearing's directions");
    println!("  run         bearing      measured          predicted      largest distance   % of clearance");
    for e in &errors {
        println!(
            "  {:<11} {:<8} {:>15} {:>18} {:>15.1} µm {:>13.1} %",
            found.runs[e.run].label(),
            answer.bearings[e.bearing],
            pk_pk(&e.measured_m),
            pk_pk(&e.predicted_m),
            e.error_m * 1e6,
            answer.percent(e.error_m)
        );
    }
}

/// Amplitudes as the industry gives them.
pub fn pk_pk(sizes_m: &[f64]) -> String {
    sizes_m.iter().map(|s| format!("{:.1}", 2e6 * s)).collect::<Vec<_>>().join(" / ")
}

/// Headings of the table of models.
pub fn stage_columns(answer: &Answer) -> Vec<String> {
    let mut columns = vec!["model".to_string()];
    for speed in &answer.speeds_rpm {
        columns.extend(answer.bearings.iter().map(|b| format!("{b} at {speed:.0} rpm, %")));
    }
    let [from, to] = answer.range_rpm;
    columns.push(format!("largest, {from:.0} to {to:.0} rpm, %"));
    columns.push("χ² per value".into());
    columns
}

/// Rows of the table of models: the largest error over all runs, in percent of the clearance.
pub fn stage_rows(answer: &Answer) -> Vec<Vec<String>> {
    let row = |stage: &rotor_edge_desktop::startup::refinement::ModelStage| {
        let mut cells = vec![stage.label.clone()];
        for speed in &answer.speeds_rpm {
            let errors = answer.found.errors_at(&answer.readings, &stage.motion, *speed);
            for bearing in 0..2 {
                let here = errors.iter().filter(|e| e.bearing == bearing).map(|e| e.error_m);
                cells.push(here.reduce(f64::max).map_or("–".into(), |e| format!("{:.1}", answer.percent(e))));
            }
        }
        let worst = answer.found.worst_by_speed(&answer.readings, &stage.motion, answer.range_rpm);
        let largest = worst.iter().max_by(|a, b| a[1].total_cmp(&b[1]));
        cells.push(largest.map_or("–".into(), |[speed, error, noise]| {
            format!("{:.1} (at {speed:.0}; noise {:.1})", answer.percent(*error), answer.percent(*noise))
        }));
        cells.push(stage.chi2_per_value.map_or(String::new(), |c| format!("{c:.2}")));
        cells
    };
    answer.stages.iter().map(row).collect()
}

fn print_stages(answer: &Answer) {
    println!(
        "\nFrom the simple model to one that fits: largest error over all runs, % of {:.0} µm",
        answer.clearance_um
    );
    output::table(&stage_columns(answer), &stage_rows(answer));
}

/// Name of the bearing, resonance in rpm and its standard deviation, of every pedestal found.
pub fn pedestals(chain: &ModelRefinement) -> impl Iterator<Item = (String, f64, f64)> {
    chain.outcome.steps.iter().filter(|s| s.added.effect == "pedestal").filter_map(|s| {
        let of = |name: &str| s.added.parameters.iter().find(|p| p.name == name);
        let (k, m) = (of("k")?, of("m")?);
        let resonance = rpm((k.value[0] / m.value[0]).sqrt());
        // k and m move together in a fit, so this is a bound
        let relative = 0.5 * (k.sd? / k.value[0]).hypot(m.sd? / m.value[0]);
        Some((s.added.at.clone()?, resonance, resonance * relative))
    })
}

/// The disk's own unbalance by both models, pedestals, and what was said of a bow.
pub fn own_lines(answer: &Answer) -> Vec<String> {
    let mut lines = Vec::new();
    let stated = |u: nalgebra::Complex<f64>, sd: f64| {
        let [magnitude, angle] = g_mm_deg(u);
        let sd = sd * G_MM;
        format!(
            "{magnitude:.3} ± {sd:.3} g·mm at {angle:.2}° ± {:.2}° with rotation",
            (sd / magnitude).to_degrees()
        )
    };
    if let Some(own) = &answer.found.own_kg_m {
        lines.push(format!(
            "Own unbalance by the two-degree model: {}; the trial weights weigh a moving mass of {:.3} kg.",
            stated(own.unbalance_kg_m, own.sd_kg_m),
            own.modal_mass_kg
        ));
    }
    let Some(chain) = &answer.chain else { return lines };
    for (u, sd) in &chain.unbalance_kg_m {
        lines.push(format!("Own unbalance by the last model: {}.", stated(*u, *sd)));
    }
    for (at, resonance, sd) in pedestals(chain) {
        lines.push(format!("Pedestal {at} resonates at {resonance:.0} ± {sd:.0} rpm."));
    }
    if chain.outcome.steps.iter().any(|s| s.added.effect == "shaft_bow") {
        lines.push("A bow is there beside the own unbalance: its pull is the same at every speed, the other's grows with Ω².".into());
    } else if let Some(bow) = chain.bow() {
        lines.push(format!(
            "A shaft bow, which would pull the same at every speed where own unbalance grows with Ω², is not supported \
             (evidence {:+.1}, {:.1} % probable).",
            bow.support,
            100.0 * bow.probability
        ));
    }
    lines
}
