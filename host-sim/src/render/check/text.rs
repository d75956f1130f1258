//! An answer of `check` on a terminal: the answer in one sentence, then tables.

use std::fmt::Write as _;

use super::sentences::{
    between_resonances, failing_margins, headline, missing_peaks, no_critical_speed,
    no_damped_critical_speed, strongly_damped_caption, strongly_damped_critical, unbalance,
};
use super::tables::{
    BEARING_COLUMNS, CRITICAL_COLUMNS, DAMPED_COLUMNS, MODE_COLUMNS, PEAK_COLUMNS, REAL_COLUMNS,
    WITHOUT_COLUMNS, WITHOUT_RANGE, bearing_rows, critical_rows, damped_rows, mode_rows, part, peak_rows,
    real_rows, without_amplitude_rows,
};
use crate::answers::check::CheckAnswer;
use crate::render::text::table;
use crate::scale::{number, three_digits};

pub fn text(answer: &CheckAnswer) -> String {
    let mut text = format!("{}\n\n", headline(answer));
    text += &machine(answer);
    text += &critical_speeds(answer);
    let failing = failing_margins(answer);
    if !failing.is_empty() {
        text += "\nSeparation margins that fail (API 617)\n";
        failing.iter().for_each(|one| text += &format!("  {one}\n"));
    }
    text += &responses(answer);
    text += &modes(answer);
    text += &bearings(answer);
    if !answer.warnings.is_empty() {
        text += "\nNumbers to look at again\n";
        answer.warnings.iter().for_each(|warning| text += &format!("  {warning}\n"));
    }
    text
}

fn machine(answer: &CheckAnswer) -> String {
    let range = |speeds_rpm: [f64; 2]| match speeds_rpm {
        [from, to] if from == to => format!("{} rpm", number(to, 0)),
        [from, to] => format!("{} to {} rpm", number(from, 0), number(to, 0)),
    };
    let mut text = format!(
        "{}: {} kg, centre of gravity at {:.4} m\n",
        answer.name,
        three_digits(answer.mass_kg),
        answer.centre_of_gravity_m
    );
    match answer.running_range_rpm {
        Some(running) if running == answer.range_rpm => {
            let _ = writeln!(text, "running range: {}", range(running));
        }
        running => {
            let _ = writeln!(text, "speeds looked at: {}", range(answer.range_rpm));
            if let Some(running) = running {
                let _ = writeln!(text, "running range: {}", range(running));
            }
        }
    }
    if let Some(sag_m) = answer.largest_sag_m {
        let _ = writeln!(text, "largest sag on rigid bearings: {} µm", three_digits(sag_m * 1e6));
    }
    text
}

fn critical_speeds(answer: &CheckAnswer) -> String {
    let mut text = "\nCritical speeds of the damped modes\n".to_string();
    match no_damped_critical_speed(answer) {
        Some(why) => text += &format!("  {why}\n"),
        None => text += &table(&DAMPED_COLUMNS, &damped_rows(answer)),
    }
    if let Some(met) = strongly_damped_critical(answer) {
        text += &format!("  {met}\n");
    }
    let without = without_amplitude_rows(answer);
    if !without.is_empty() {
        text += "\nWithout amplitude: critical speeds of modes without damping\n";
        text += &match answer.running_range_rpm {
            Some(_) => table(&WITHOUT_COLUMNS, &without),
            None => table(&WITHOUT_COLUMNS[..2], &without.iter().map(|r| &r[..2]).collect::<Vec<_>>()),
        };
    }
    text += "\nUndamped critical speeds that unbalance excites\n";
    match no_critical_speed(answer) {
        Some(why) => text += &format!("  {why}\n"),
        None => text += &table(&CRITICAL_COLUMNS, &critical_rows(answer)),
    }
    text
}

fn responses(answer: &CheckAnswer) -> String {
    let mut text = String::new();
    for response in &answer.unbalance {
        let _ = writeln!(text, "\nUnbalance response, {}", response.trial);
        let _ = writeln!(text, "  {}", unbalance(answer, response));
        if let Some(why) = missing_peaks(answer, response) {
            let _ = writeln!(text, "  {why}");
        }
        let rows = peak_rows(response);
        if !rows.is_empty() {
            let shown = if answer.running_range_rpm.is_some() { PEAK_COLUMNS.len() } else { WITHOUT_RANGE };
            let rows: Vec<&[String]> = rows.iter().map(|r| &r[..shown]).collect();
            text += &table(&PEAK_COLUMNS[..shown], &rows);
            if let Some(sentence) = between_resonances(response) {
                let _ = writeln!(text, "  {sentence}");
            }
        }
    }
    text
}

fn modes(answer: &CheckAnswer) -> String {
    let to = number(answer.range_rpm[1], 0);
    let mut text = format!("\nDamped modes at {to} rpm\n");
    text += &table(&MODE_COLUMNS, &mode_rows(answer, true));
    let strong = mode_rows(answer, false);
    if !strong.is_empty() {
        let _ = writeln!(text, "\nStrongly damped modes at {to} rpm, {}", strongly_damped_caption());
        text += &table(&MODE_COLUMNS, &strong);
    }
    let real = real_rows(answer);
    if !real.is_empty() {
        let _ = writeln!(text, "\nOverdamped roots at {to} rpm: no oscillation");
        text += &table(&REAL_COLUMNS, &real);
    }
    text
}

fn bearings(answer: &CheckAnswer) -> String {
    let to = number(answer.range_rpm[1], 0);
    let rows = bearing_rows(answer);
    let mut text = String::new();
    let has_film = answer.bearings.iter().any(|b| b.eccentricity_ratio.is_some());
    let first = match has_film {
        true => ("Bearing loads; eccentricity over clearance ε and attitude", 1..4),
        false => ("Bearing loads", 1..2),
    };
    for (what, range) in [first, ("Bearing stiffness, N/m,", 4..8), ("Bearing damping, N·s/m,", 8..12)] {
        let (names, cells) = part(&BEARING_COLUMNS, &rows, range);
        let _ = writeln!(text, "\n{what} at {to} rpm");
        text += &table(&names, &cells);
    }
    text
}
