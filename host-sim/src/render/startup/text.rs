//! An answer of `startup` on a terminal.

use std::fmt::Write as _;

use super::story::verdict;
use super::tables::{
    ESTIMATE_COLUMNS, RUN_COLUMNS, estimate_caption, estimate_rows, model_lines, own_lines, pk_pk, run_rows,
    shift_lines, stage_columns, stage_rows,
};
use crate::answers::startup::{EvaluatedStartup, StartupAnswer};
use crate::render::findings;
use crate::render::text::table;

/// The whole answer; orbits come from the start-up that it is made from.
pub fn text(answer: &StartupAnswer, evaluated: &EvaluatedStartup) -> String {
    let mut text = format!("{}\n", verdict(answer));
    if let Some(improved) = &answer.improved {
        text += &format!("{}: {}\n", improved.verdict, improved.summary);
    }
    own_lines(answer).iter().for_each(|line| text += &format!("{line}\n"));
    answer.remarks.iter().for_each(|r| text += &format!("{r}\n"));
    text += "\n";
    for line in model_lines(answer) {
        text += &format!("{line}\n");
    }
    let _ = writeln!(text, "\n{}", estimate_caption(answer));
    text += &table(&ESTIMATE_COLUMNS, &estimate_rows(answer));
    text += "\nPeak and half-power points\n";
    text += &table(&RUN_COLUMNS, &run_rows(answer));
    text += "\nResonance and amplitude\n";
    for line in shift_lines(answer) {
        text += &format!("  {line}\n");
    }
    for speed in &evaluated.speeds_rpm {
        text += &errors(evaluated, *speed);
    }
    let _ = writeln!(
        text,
        "\nFrom the simple model to one that fits: largest error over all runs, % of the clearance ({:.0} µm)",
        answer.clearance_um
    );
    text += &table(&stage_columns(evaluated), &stage_rows(answer, &evaluated.bearings));
    if let Some(improved) = &answer.improved {
        text += &findings::fitted_text(&improved.bearings, &improved.dimensions, improved.model_adequate);
        for effect in &improved.effects {
            let _ = writeln!(text, "  {}", effect.fitted.label);
            for line in findings::parameters(&effect.fitted) {
                text += &format!("    {line}\n");
            }
        }
    }
    text
}

fn errors(evaluated: &EvaluatedStartup, speed_rpm: f64) -> String {
    let found = &evaluated.found;
    let errors = found.errors_at(&evaluated.readings, &evaluated.stages[0].motion, speed_rpm);
    let Some(first) = errors.first() else { return String::new() };
    let at = evaluated.readings[first.row].speed_rpm;
    let mut text = format!("\nTwo-degree model at {at:.0} rpm, µm pk-pk along the bearing's directions\n");
    text += "  run         bearing      measured          predicted      largest distance   % of clearance\n";
    for e in &errors {
        let _ = writeln!(
            text,
            "  {:<11} {:<8} {:>15} {:>18} {:>10.1} µm 0-pk {:>13.1} %",
            found.runs[e.run].label(),
            evaluated.bearings[e.bearing],
            pk_pk(&e.measured_m),
            pk_pk(&e.predicted_m),
            e.error_m * 1e6,
            evaluated.percent(e.error_m)
        );
    }
    text
}
