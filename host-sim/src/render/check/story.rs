//! The first screen of a page of `check`.

use rotor_edge_desktop::check::Check;
use rotor_edge_desktop::check::modes::Mode;
use rotor_edge_desktop::units::rpm;

use super::{sentences, tables};
use crate::answers::check::{CheckAnswer, ModeAnswer};
use crate::render::campbell::{Branch, CampbellMarks, CriticalMark, campbell};
use crate::render::text::capital;
use crate::render::{Figure, Story};
use crate::scale::{number, three_digits};

/// Critical speeds that the first screen lists at most.
const LISTED: usize = 4;

/// Stability, critical speeds and margins, beside the Campbell diagram; `found` is the check that the answer is made from.
pub fn story(answer: &CheckAnswer, found: &Check, next: (String, Option<String>)) -> Story {
    let mut answers = vec![("Critical speeds", critical_speeds(answer))];
    answers.extend(least_damped(answer).map(|line| ("Damping", line)));
    if answer.running_range_rpm.is_some() {
        let failing = sentences::failing_margins(answer);
        let margins = match (failing.is_empty(), sentences::margins(answer)) {
            (false, _) => failing.join(" "),
            (true, Some(kept)) => capital(&format!("{kept}.")),
            (true, None) => "An unstable machine has no separation margin.".into(),
        };
        answers.push(("Margins", margins));
    }
    let sure = "By the drawing alone: the damping is as good as the bearing coefficients in the file.";
    let doubts = match answer.warnings.len() {
        0 => sure.to_string(),
        1 => format!("{sure} {}", answer.warnings[0]),
        more => format!("{sure} {more} numbers of the file look unusual; they are listed below."),
    };
    answers.push(("How sure", doubts));
    Story {
        verdict: sentences::headline(answer),
        answers,
        next,
        beside: vec![diagram(answer, found)],
        below: Vec::new(),
    }
}

fn critical_speeds(answer: &CheckAnswer) -> String {
    if let Some(none) = sentences::no_damped_critical_speed(answer) {
        return none;
    }
    let all: Vec<&ModeAnswer> =
        tables::damped_critical(answer).into_iter().filter(|m| tables::resonates(m)).collect();
    let one = |m: &&ModeAnswer| format!("{} rpm ({})", number(m.speed_rpm, 0), m.whirl);
    let listed: Vec<String> = all.iter().take(LISTED).map(one).collect();
    let more = match all.len().saturating_sub(LISTED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    format!("{}{more}.", listed.join(", "))
}

/// The mode that is damped least.
fn least_damped(answer: &CheckAnswer) -> Option<String> {
    let least = answer.modes.iter().min_by(|a, b| a.log_decrement.total_cmp(&b.log_decrement))?;
    let grows = if least.log_decrement < 0.0 { "; a mode below zero grows" } else { "" };
    Some(format!(
        "Least log decrement {}, of the {} mode at {} rpm when the shaft turns at {} rpm{grows}.",
        three_digits(least.log_decrement),
        least.whirl,
        number(least.frequency_rpm, 0),
        number(least.speed_rpm, 0)
    ))
}

/// Natural frequencies with the running range, the unstable speeds and the margin of each critical speed.
fn diagram(answer: &CheckAnswer, found: &Check) -> Figure {
    let branches: Vec<Branch> = found
        .campbell
        .branches
        .iter()
        .map(|branch| {
            let point = |m: &Mode| (rpm(m.speed_rad_s), rpm(m.frequency_rad_s()), m.whirl, m.log_decrement());
            Branch { points: found.campbell.along(branch).map(point).collect() }
        })
        .collect();
    let margins = sentences::margins_by_critical(answer);
    let mark = |m: &ModeAnswer| {
        let near = |at: f64| (at / m.speed_rpm - 1.0).abs() < sentences::SAME_CRITICAL;
        let margin = margins.iter().find(|margin| near(margin.critical_rpm));
        CriticalMark {
            speed_rpm: m.speed_rpm,
            log_decrement: m.log_decrement,
            word: margin.map(sentences::margin_in_a_word),
            is_failing: margin.is_some_and(|margin| !margin.is_kept),
        }
    };
    let marks = CampbellMarks {
        running_rpm: answer.running_range_rpm,
        unstable_from_rpm: answer.stability_threshold.as_ref().map(|t| t.speed_rpm),
        critical: tables::damped_critical(answer).into_iter().map(mark).collect(),
    };
    let mut caption =
        String::from("Damped natural frequencies over speed; the straight line is the speed itself. ");
    caption += match answer.running_range_rpm {
        Some(_) => "Circles: damped critical speeds, with their margin and the margin that API 617 needs.",
        None => {
            "Circles: damped critical speeds. Their margins need a running range: --rpm, or [rated] in the file."
        }
    };
    Figure::new("Campbell diagram", caption, campbell(&branches, &marks))
}
