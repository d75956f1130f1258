//! Text and story of an answer of `replay`.

use std::fmt::Write as _;

use rotor_edge_desktop::units::SECONDS_A_DAY;

use super::text::{capital, table};
use super::{Figure, Story, findings, identify};
use crate::answers::replay::{
    BetterAnswer, FlagSummary, KnownUnbalance, LastUnbalance, ReplayAnswer, StateSummary,
};
use crate::replay::check::{EXCESS_LIMIT, FEATURE_LIMIT};
use crate::replay::fit::ModelFit;
use crate::watch::words::span;

/// Changes of state that are told.
const MOST_STATES: usize = 12;

/// The whole answer on a terminal.
pub fn text(answer: &ReplayAnswer) -> String {
    let mut text = format!("{}: {}\n", answer.job.rotor_name, verdict(answer));
    flags(answer).iter().for_each(|line| text += &format!("  {line}\n"));
    text += &answer.better.as_ref().map_or_else(String::new, better);
    text += &match &answer.unbalance {
        LastUnbalance::Known(known) => unbalance(known),
        LastUnbalance::Unknown { why } => format!("\nNo interval of the unbalance: {why}.\n"),
    };
    text += &states(&answer.states);
    text + &machine(answer) + &traffic(answer) + &equivalence(answer)
}

/// Whether the model fits, and since when it does or does not, in one sentence.
pub fn verdict(answer: &ReplayAnswer) -> String {
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let dates = answer.job.dates;
    match answer.fit {
        ModelFit::Throughout => format!(
            "The model fits: no flag in {} of {} readings that were evaluated.",
            answer.readings, answer.job.recorded
        ),
        ModelFit::StoppedOn { first_d, before, after } if before.is_finite() => format!(
            "The model stopped fitting on {}: the residual rose from {} to {} of the features.",
            dates.day(first_d),
            percent(before),
            percent(after)
        ),
        ModelFit::StoppedOn { first_d, after, .. } => format!(
            "The model has not fitted since the first day, {}: the residual is {} of the features.",
            dates.day(first_d).trim_start_matches("day "),
            percent(after)
        ),
        ModelFit::BeganOn { first_d, before, after } => format!(
            "The model began to fit on {}: the residual fell from {} to {} of the features.",
            dates.day(first_d),
            percent(before),
            percent(after)
        ),
    }
}

/// Every flag, a line each.
fn flags(answer: &ReplayAnswer) -> Vec<String> {
    let line = |flag: &FlagSummary| {
        let suspect =
            flag.suspect.as_deref().map_or("no suspect bearing".into(), |b| format!("suspect bearing {b}"));
        let day = answer.job.dates.day(flag.time_d);
        format!("Flag raised on {day}, up for {} readings; {suspect}.", flag.readings)
    };
    answer.flags.iter().map(line).collect()
}

/// The first screen of the page, beside the residual over time.
pub fn story(answer: &ReplayAnswer, residual: Figure, next: (String, Option<String>)) -> Story {
    let raised = flags(answer);
    let what = match &raised[..] {
        [] => "No flag was raised.".to_string(),
        [first] => first.clone(),
        [first, more @ ..] => format!("{first} {} more flags followed.", more.len()),
    };
    let mut answers = vec![("What happened", what)];
    answers.push((
        "Unbalance",
        match &answer.unbalance {
            LastUnbalance::Known(known) => {
                let planes = known.determined.planes.as_ref().map_or(0, Vec::len);
                let lines = findings::planes(&known.determined);
                let day = answer.job.dates.day(known.time_d);
                format!("On {day}. {}.", lines[..planes.min(lines.len())].join(". "))
            }
            LastUnbalance::Unknown { why } => format!("No interval: {why}."),
        },
    ));
    if let Some(better) = &answer.better {
        let [was, is] = better.flagged;
        answers.push((
            "How much better",
            format!(
                "{}: the residual falls from {:.1} to {:.1} % of the features, flagged readings from {was} to {is}.",
                capital(&better.label),
                100.0 * better.residual_ratio_before,
                100.0 * better.residual_ratio_after
            ),
        ));
    }
    let e = &answer.equivalence;
    answers.push((
        "How sure",
        format!(
            "The controller's core agrees with the desktop model: features to {:.0e} (allowed {FEATURE_LIMIT:.0e}), residual \
             to {:.0e} of the features (allowed {EXCESS_LIMIT:.0e}).",
            e.max_relative_feature_error, e.max_relative_excess
        ),
    ));
    Story { verdict: verdict(answer), answers, next, beside: vec![residual], below: Vec::new() }
}

/// The record, and phase I.
fn machine(answer: &ReplayAnswer) -> String {
    let job = &answer.job;
    let [first, last] = job.days;
    let mut text = format!("\n{} readings, days {first:.0} to {last:.0}\n", job.recorded);
    if let Some((found, runup)) = &job.phase_one {
        let runup = runup.map_or(String::new(), |speeds| format!(" and a run-up of {speeds} speeds"));
        text += &format!("\nPhase I, from the first three days{runup}\n{}", identify::text(found));
    }
    text
}

/// The bus, and what became of the readings.
fn traffic(answer: &ReplayAnswer) -> String {
    let (frames, c, job) = (&answer.frames, &answer.counters, &answer.job);
    let age_limit_s = job.age_limit_s;
    let age_limit = match age_limit_s / SECONDS_A_DAY {
        days if days >= 1.0 => format!("{days:.1} d"),
        _ => span((age_limit_s * 1e6) as u64),
    };
    let mut text = format!(
        "\n{}\n  frames sent {}, received {}, lost {}\n",
        job.bus, frames.sent, frames.received, frames.lost
    );
    let _ = writeln!(
        text,
        "  readings evaluated {} ({} without all probes), skipped {}, lost {}, rejected {}, repeated {}, late {}",
        c.evaluated, c.partial, c.skipped, c.lost, c.rejected, c.repeated, c.late
    );
    let _ = writeln!(
        text,
        "  its clock is the record's; a verdict counts for {age_limit} (--age-limit-s {age_limit_s})"
    );
    for day in &job.power_cuts_d {
        let _ = writeln!(text, "  power lost before day {day}, back from what it had stored");
    }
    text
}

fn equivalence(answer: &ReplayAnswer) -> String {
    let e = &answer.equivalence;
    let row = |what: &str, measured: String, allowed: Option<f64>| {
        [what.to_string(), measured, allowed.map_or_else(String::new, |limit| format!("{limit:.0e}"))]
    };
    let ratio = |value: f64| format!("{value:.1e}");
    let difference =
        format!("{:.2} g·mm, {:.2}°", e.max_unbalance_difference_g_mm, e.max_angle_difference_deg);
    let rows = [
        row("features, of the reading's largest", ratio(e.max_relative_feature_error), Some(FEATURE_LIMIT)),
        row(
            "residual above the exact optimum, of the feature sum",
            ratio(e.max_relative_excess),
            Some(EXCESS_LIMIT),
        ),
        row("the same in µm", ratio(e.max_residual_excess_um), None),
        row(
            "largest gap that the core's own certificate leaves, of the feature sum",
            ratio(e.max_relative_gap),
            Some(EXCESS_LIMIT),
        ),
        row("unbalance against the exact optimum's", difference, None),
    ];
    let columns = ["largest difference", "measured", "allowed"];
    format!("\nThe core (f32, on the bus) against the desktop crate (f64)\n{}", table(&columns, &rows))
}

/// What the controller said of itself, as long as it is not too much.
fn states(changes: &[StateSummary]) -> String {
    let mut text = String::from("\nWhat the controller said of itself\n");
    for change in changes.iter().take(MOST_STATES) {
        let missing = match change.missing.is_empty() {
            true => String::new(),
            false => format!(", without {}", change.missing.join(", ")),
        };
        let StateSummary { time_d, state, reason, .. } = change;
        let _ = writeln!(text, "  from day {time_d:<10} {state}: {reason}{missing}");
    }
    if changes.len() > MOST_STATES {
        let _ = writeln!(text, "  and {} changes more (--json has all)", changes.len() - MOST_STATES);
    }
    text
}

fn unbalance(known: &KnownUnbalance) -> String {
    let mut text = format!("\nUnbalance on day {:.0}, from one reading\n", known.time_d);
    findings::planes(&known.determined).iter().for_each(|line| text += &format!("  {line}\n"));
    let bearings = if known.with_bearings {
        "and phase I's uncertainty of the bearings"
    } else {
        "alone: the bearings' uncertainty is not in the rotor's file"
    };
    let _ = writeln!(text, "  from the noise, {:.2} times what is stated, {bearings}", known.noise_scale);
    if known.outdated {
        text += "  Later readings have no interval: the model does not fit them.\n";
    }
    text
}

/// The days from the event on, before and after.
fn better(answer: &BetterAnswer) -> String {
    let [was, is] = answer.flagged;
    let mut text = format!(
        "\nThe controller from day {:.0} on                residual     readings flagged\n",
        answer.since_d
    );
    let _ = writeln!(
        text,
        "  the model as it was                     {:>6.1} % {was:>14}",
        answer.residual_ratio_before * 100.0
    );
    let _ = writeln!(text, "  {:<38}  {:>6.1} % {is:>14}", answer.label, answer.residual_ratio_after * 100.0);
    text
}
