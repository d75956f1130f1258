//! Text of an answer of `track`.

use std::fmt::Write as _;

use rotor_edge_desktop::interval::HALF_95;
use rotor_edge_desktop::significance::percent;

use super::conditions::sentences;
use super::sampling;
use super::story::verdict;
use super::{event_words, evidence, undiagnosed, when};
use crate::answers::track::{
    EstimateAnswer, JointAnswer, PlaneInterval, ReidentifiedAnswer, SecondSpeedAnswer, TrackAnswer,
};
use crate::ingest::dates::Dates;

/// Least probability at which a possible event is told in words.
const LEAST_TOLD: f64 = 0.1;

/// The whole answer on a terminal; `rotor` is its name.
pub fn text(rotor: &str, answer: &TrackAnswer, dates: Dates) -> String {
    let mut text = format!("{rotor}: {}\n\n", verdict(answer, dates));
    let _ = writeln!(text, "{} readings, method {}", answer.recorded, answer.method);
    for remark in &answer.remarks {
        let _ = writeln!(text, "  {remark}");
    }
    let conditions = answer.joint.as_ref().map_or(&[][..], |joint| &joint.conditions);
    for sentence in sentences(conditions) {
        let _ = writeln!(text, "  {sentence}");
    }
    text += "\nFlags\n";
    if answer.flags.is_empty() {
        let _ = writeln!(text, "  None in {} readings.", answer.estimates.len());
    }
    for flag in &answer.flags {
        let cause = match flag.cause {
            "model" => format!("the model stopped fitting; suspect bearing {}", flag.suspect),
            "instrument" => "an instrument changed, the machine did not".to_string(),
            _ => "the unbalance jumped, the model still fits".to_string(),
        };
        let _ = writeln!(text, "  {}, since day {:.0}: {cause}", dates.day(flag.time_d), flag.since_d);
    }
    answer.reidentified.iter().for_each(|r| text += &reidentified(r, dates));
    if let Some(open) = undiagnosed(answer, dates) {
        let _ = writeln!(text, "  {open}");
    }
    let _ = writeln!(text, "\nMean residual {:.3} µm 0-pk", answer.residual_um.mean);
    let percent = |r: Option<f64>| r.map_or("–".to_string(), |r| format!("{:.2} %", 100.0 * r));
    let _ = writeln!(
        text,
        "  less than with constant bearings by {} over the record, {} from the event on",
        percent(answer.reduction_against_fixed.whole),
        percent(answer.reduction_against_fixed.after_event)
    );
    text += &answer.sampling.as_ref().map_or_else(String::new, sampling::text);
    text += &answer.joint.as_ref().map_or_else(String::new, |joint| of_joint(joint, dates));
    text += &answer.estimates.last().map_or_else(String::new, |last| last_day(last, dates));
    let advice = answer.joint.as_ref().and_then(|joint| joint.second_speed.as_ref());
    text + &advice.map_or_else(String::new, second_speed)
}

fn reidentified(r: &ReidentifiedAnswer, dates: Dates) -> String {
    let mut text = format!("\nRe-identified on {}\n", dates.day(r.time_d));
    for c in &r.cases {
        let taken = if c.case == r.case { "   taken" } else { "" };
        let _ = writeln!(
            text,
            "  case {}: residual of its readings {:>7.3} µm 0-pk, {:>2} unknowns, criterion {:>6.1}{taken}",
            c.case, c.residual_um, c.unknowns, c.criterion
        );
    }
    text
}

/// What the joint method learned.
fn of_joint(joint: &JointAnswer, dates: Dates) -> String {
    let mut text = String::from("\nEvents\n");
    for e in &joint.events {
        let _ = writeln!(text, "  {}: {} (log evidence {})", when(e, dates), event_words(e), evidence(e));
    }
    if joint.events.is_empty() {
        text += "  None.\n";
    }
    for possible in joint.possible_events.iter().filter(|possible| possible.probability >= LEAST_TOLD) {
        let e = &possible.event;
        let chance = percent(possible.probability);
        let _ = writeln!(
            text,
            "  Possible, {}: {} ({chance} probable). The intervals allow for both.",
            when(e, dates),
            event_words(e)
        );
    }
    if !joint.effects.is_empty() {
        let _ = writeln!(text, "  The later run-up shows {}.", joint.effects.join(", "));
    }
    if !joint.left_out_d.is_empty() {
        let days: Vec<String> = joint.left_out_d.iter().map(|d| format!("{d:.0}")).collect();
        let _ = writeln!(text, "  Left out as passing disturbances: day {}.", days.join(", "));
    }
    let _ = writeln!(
        text,
        "\nBearings: constant part with its 95 % interval, and ± (95 %) of the fluctuation, which fades in {:.1} days",
        joint.wander_days
    );
    for state in &joint.states {
        let _ = writeln!(text, "  from {}", dates.day(state.since_d));
        for (c, (_, wander)) in state.bearings.iter().zip(joint.wander_relative_sd.iter()) {
            let origin = if c.from_data { "the data" } else { "its prior, the data do not tell" };
            let _ = writeln!(
                text,
                "    {:<12} {:>11.4e} ({:.3e} to {:.3e}), ± {:.1} %   {origin}",
                c.name,
                c.value,
                c.interval_95[0],
                c.interval_95[1],
                100.0 * HALF_95 * wander
            );
        }
    }
    text
}

/// The cheapest measurement that helps.
fn second_speed(advice: &SecondSpeedAnswer) -> String {
    format!(
        "\nA second reading a day at {:.0} rpm would make the unbalance known to ± {:.0} g·mm in {:.0} days, {:.0} g·mm \
         better than readings at one speed (95 %, each component, rms of the planes).\n",
        advice.speed_rpm, advice.half_width_g_mm, advice.days, advice.gain_g_mm
    )
}

fn plane_interval(plane: &PlaneInterval) -> String {
    let ([from, to], [first, last]) = (plane.unbalance_g_mm, plane.angle_deg);
    format!("   (95 %: {from:.1} to {to:.1}, {first:.0}° to {last:.0}°)")
}

/// The unbalance of the last day.
fn last_day(last: &EstimateAnswer, dates: Dates) -> String {
    let line = |what: &str, magnitude: f64, angle: f64, sure: String| {
        format!("  {what:<16} {magnitude:>8.1} g·mm at {angle:>6.1}°{sure}\n")
    };
    let mut text = format!("\nOn {}\n", dates.day(last.time_d));
    for (j, plane) in last.planes.iter().enumerate() {
        let interval = last.interval_95.as_ref().filter(|_| !last.flagged);
        let sure = interval.map_or(String::new(), |i| plane_interval(&i.planes[j]));
        text += &line(&format!("plane {}", plane.name), plane.unbalance_g_mm, plane.angle_deg, sure);
    }
    for (what, u) in [("static", last.static_unbalance), ("dynamic", last.dynamic)] {
        text += &line(what, u.unbalance_g_mm, u.angle_deg, String::new());
    }
    if last.interval_95.is_none() {
        text += "  This method states no interval; --method joint and bayes do.\n";
    } else if last.flagged {
        text += "  No interval is stated, because the model does not fit this reading.\n";
    }
    text
}
