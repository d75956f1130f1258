//! The first screen of a page of `track`, and its first sentence on a terminal.

use super::conditions::sentences;
use super::{TrackPage, banded, event_words, undiagnosed, when};
use crate::answers::track::{EstimateAnswer, EventAnswer, FlagAnswer, TrackAnswer};
use crate::answers::track_curves::TrackCurves;
use crate::ingest::dates::Dates;
use crate::render::text::capital;
use crate::render::trend::Trend;
use crate::render::{Figure, Story};
use crate::scale::three_digits;

/// Events that the first screen lists.
const LISTED: usize = 4;

/// What changed, and the unbalance of the last day, in one sentence.
pub fn verdict(answer: &TrackAnswer, dates: Dates) -> String {
    let changed = match &happened(answer, dates)[..] {
        [] => format!("Nothing changed in {} readings", answer.estimates.len()),
        [only] => only.clone(),
        more => format!("{} changes, the last: {}", more.len(), more[more.len() - 1]),
    };
    let Some(last) = answer.estimates.last() else { return format!("{changed}.") };
    let planes = last.planes.iter().map(|p| {
        format!("{} g·mm at {:.0}° in plane {}", three_digits(p.unbalance_g_mm), p.angle_deg, p.name)
    });
    let planes: Vec<String> = planes.collect();
    format!("{changed}. Unbalance on {}: {}.", dates.day(last.time_d), planes.join(", "))
}

/// Events of a method that knows them; of the others each flag.
fn happened(answer: &TrackAnswer, dates: Dates) -> Vec<String> {
    let event = |e: &EventAnswer| format!("{} on {}", capital(&event_words(e)), when(e, dates));
    let flag = |f: &FlagAnswer| match f.cause {
        "model" => {
            format!("The model stopped fitting on {}, suspect bearing {}", dates.day(f.since_d), f.suspect)
        }
        "instrument" => format!("An instrument changed on {}", dates.day(f.since_d)),
        _ => format!("The unbalance jumped on {}", dates.day(f.since_d)),
    };
    match &answer.joint {
        Some(joint) => joint.events.iter().map(event).collect(),
        None => answer.flags.iter().map(flag).collect(),
    }
}

/// The first screen of the page.
pub fn story(
    answer: &TrackAnswer,
    curves: &TrackCurves,
    dates: Dates,
    next: (String, Option<String>),
) -> Story {
    let all = happened(answer, dates);
    let listed: Vec<String> = all.iter().take(LISTED).map(|one| format!("{one}.")).collect();
    let more = match all.len().saturating_sub(LISTED) {
        0 => String::new(),
        more => format!(" {more} more are listed below."),
    };
    let what = match all.is_empty() {
        true => format!("No event and no flag in {} readings.", answer.estimates.len()),
        false => format!("{}{more}", listed.join(" ")),
    };
    let mut answers = vec![("What happened", what)];
    answers.extend(answer.estimates.last().map(|last| ("How sure", sure(last))));
    let percent = |ratio: f64| format!("{:.1} %", 100.0 * ratio);
    let ratios = &answer.residual_ratio;
    let fit = match (ratios.before_event, ratios.after_event) {
        (Some(before), Some(after)) => format!(
            "Mean residual {} of the features before the change, {} after it.",
            percent(before),
            percent(after)
        ),
        (Some(one), None) | (None, Some(one)) => format!("Mean residual {} of the features.", percent(one)),
        (None, None) => format!("Mean residual {} µm 0-pk.", three_digits(answer.residual_um.mean)),
    };
    answers.push(("How well it fits", fit));
    let conditions = answer.joint.as_ref().map_or(&[][..], |joint| &joint.conditions);
    if !conditions.is_empty() {
        answers.push(("Load and temperature", sentences(conditions).join(" ")));
    }
    answers.extend(undiagnosed(answer, dates).map(|open| ("What is open", open)));
    Story {
        verdict: verdict(answer, dates),
        answers,
        next,
        beside: vec![planes(&TrackPage { answer, dates }, curves)],
        below: Vec::new(),
    }
}

/// The 95 % intervals of the last day, or why there are none.
fn sure(last: &EstimateAnswer) -> String {
    match &last.interval_95 {
        None => "This method states no interval; --method joint and bayes do.".into(),
        Some(_) if last.flagged => {
            "No interval is stated, because the model does not fit the last reading.".into()
        }
        Some(interval) => {
            let plane = |p: &crate::answers::track::PlaneInterval| {
                let ([low, high], [first, last]) = (p.unbalance_g_mm.map(three_digits), p.angle_deg);
                format!("Plane {}: {low} to {high} g·mm, {first:.0}° to {last:.0}° (95 %).", p.name)
            };
            interval.planes.iter().map(plane).collect::<Vec<_>>().join(" ")
        }
    }
}

/// The unbalance of every plane with its interval, what happened, and flags.
fn planes(page: &TrackPage, curves: &TrackCurves) -> Figure {
    let mut drawn = Trend::default();
    for plane in &curves.planes {
        let one = banded(&format!("plane {}", plane.name), &plane.size_g_mm);
        drawn.curves.extend(one.curves);
        let rows = one.bands.into_iter().map(|(_, rows)| rows).next().unwrap_or_default();
        drawn.bands.push((format!("95 %, plane {}", plane.name), rows));
    }
    let is_banded = drawn.bands.iter().any(|(_, rows)| !rows.is_empty());
    if !is_banded {
        drawn.bands.clear();
    }
    let caption = match is_banded {
        true => "Bands: 95 % intervals. Vertical lines: what happened then; triangles: flags.",
        false => "Vertical lines: what happened then; triangles: flags.",
    };
    page.figure("Unbalance by plane", "unbalance, g·mm", caption, drawn)
}
