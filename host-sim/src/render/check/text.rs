//! An answer of `check` on a terminal.

use std::fmt::Write as _;

use super::tables::{
    BEARING_COLUMNS, CRITICAL_COLUMNS, DAMPED_COLUMNS, MODE_COLUMNS, PEAK_COLUMNS, bearing_rows,
    critical_rows, damped_rows, mode_rows, no_critical_speed, no_damped_critical_speed, peak_rows, stability,
};
use crate::answers::check::CheckAnswer;
use crate::render::text::table;
use crate::scale::{number, three_digits};

/// The whole answer; `is_running_range` if the range is the one that the machine runs in.
pub fn text(answer: &CheckAnswer, is_running_range: bool) -> String {
    let [from, to] = answer.range_rpm.map(|s| number(s, 0));
    let mut text = format!(
        "{}: {} kg, centre of gravity at {:.4} m\n",
        answer.name,
        three_digits(answer.mass_kg),
        answer.centre_of_gravity_m
    );
    let said = if is_running_range { "running range" } else { "looked at" };
    let _ = writeln!(text, "{said}: {from} to {to} rpm");
    if let Some(sag_m) = answer.largest_sag_m {
        let _ = writeln!(text, "sags by {} µm at most between its bearings", three_digits(sag_m * 1e6));
    }
    let _ = writeln!(text, "\nBearings, coefficients at {to} rpm (N/m, N·s/m)");
    text += &table(&BEARING_COLUMNS, &bearing_rows(answer));
    text += "\nUndamped critical speeds\n";
    match no_critical_speed(answer) {
        Some(why) => text += &format!("  {why}\n"),
        None => text += &table(&CRITICAL_COLUMNS, &critical_rows(answer)),
    }
    text += "\nDamped critical speeds\n";
    match no_damped_critical_speed(answer) {
        Some(why) => text += &format!("  {why}\n"),
        None => text += &table(&DAMPED_COLUMNS, &damped_rows(answer)),
    }
    let _ = writeln!(text, "\nDamped modes at {to} rpm");
    text += &table(&MODE_COLUMNS, &mode_rows(answer));
    let _ = writeln!(text, "\n{}", stability(answer));
    text += &responses(answer);
    if !answer.warnings.is_empty() {
        text += "\nNumbers to look at again\n";
        answer.warnings.iter().for_each(|warning| text += &format!("  {warning}\n"));
    }
    text
}

fn responses(answer: &CheckAnswer) -> String {
    let mut text = String::new();
    for response in &answer.unbalance {
        let each = three_digits(response.each_g_mm());
        let _ =
            writeln!(text, "\nResponse to a trial unbalance, {}: {each} g·mm at each plane", response.trial);
        let rows = peak_rows(response);
        if rows.is_empty() {
            let _ = writeln!(text, "  no maximum up to {} rpm", number(1.3 * answer.range_rpm[1], 0));
        } else {
            text += &table(&PEAK_COLUMNS, &rows);
        }
    }
    text
}
