//! Text and story of an answer of `extract`.

use super::text::capital;
use super::{Figure, Story};
use crate::answers::extract::{ExtractedFileAnswer, ExtractedKeyphasor, ExtractionAnswer};
use crate::ingest::waveform::settings::Settings;
use crate::scale::three_digits;

/// The whole answer on a terminal.
pub fn text(answer: &ExtractionAnswer, settings: &Settings) -> String {
    let lines: String = account(answer, settings).iter().map(|line| format!("{line}\n")).collect();
    let also = answer.two_x.as_ref().map_or(String::new(), |path| format!(", 2x to {}", path.display()));
    format!("{lines}\nWritten to {}{also}.\n", answer.measured.display())
}

/// Losses and doubts that the first screen tells; a list further down holds all.
const MOST_TOLD: usize = 2;

/// The first screen of the page, beside the probe that moves most.
pub fn story(
    answer: &ExtractionAnswer,
    settings: &Settings,
    probe: Figure,
    next: (String, Option<String>),
) -> Story {
    let speeds = answer.files.iter().flat_map(|file| file.range_rpm).filter(|rpm| rpm.is_finite());
    let (lowest, highest) = speeds.fold((f64::INFINITY, 0.0_f64), |(l, h), rpm| (l.min(rpm), h.max(rpm)));
    let lost = match answer.lost {
        0 => String::new(),
        windows => format!("; {windows} windows gave none"),
    };
    let verdict = match answer.readings {
        0 => format!("No reading could be taken{lost}."),
        readings => format!("{readings} readings from {lowest:.0} to {highest:.0} rpm{lost}."),
    };
    let falls = settings.keyphasor.falling;
    let phase = answer.files.first().map(|file| ("Phase", format!("{}.", reference(file, falls))));
    let losses = answer.files.iter().flat_map(|file| &file.losses).map(|loss| loss.words.as_str());
    let doubts = answer.files.iter().flat_map(|file| &file.doubts).map(String::as_str);
    let advice = answer.files.iter().filter_map(|file| Some(file.drifted.as_ref()?.advice.as_str()));
    let lost = told(losses).unwrap_or_else(|| "No reading was lost.".into());
    let answers = phase
        .into_iter()
        .chain([("Lost", lost)])
        .chain(told(advice.take(1)).map(|advice| ("Remedy", advice)))
        .chain(told(doubts).map(|doubts| ("Doubts", doubts)));
    Story { verdict, answers: answers.collect(), next, beside: vec![probe], below: Vec::new() }
}

/// The first few as sentences; nothing if there are none.
fn told<'a>(all: impl Iterator<Item = &'a str>) -> Option<String> {
    let all: Vec<String> = all.map(|words| format!("{}.", capital(words.trim_end_matches('.')))).collect();
    let (first, more) = all.split_at(MOST_TOLD.min(all.len()));
    let more = (!more.is_empty()).then(|| format!("{} more are listed below.", more.len()));
    let sentences: Vec<&str> = first.iter().chain(&more).map(String::as_str).collect();
    (!sentences.is_empty()).then(|| sentences.join(" "))
}

/// What was done, in sentences; also the comment at the head of the readings.
pub fn account(answer: &ExtractionAnswer, settings: &Settings) -> Vec<String> {
    answer.files.iter().flat_map(|file| of_file(file, settings)).collect()
}

fn of_file(answer: &ExtractedFileAnswer, settings: &Settings) -> Vec<String> {
    let ExtractedFileAnswer { file, keyphasor, rate_hz, duration_s, .. } = answer;
    let [lowest, highest] = answer.range_rpm;
    let unit = if answer.unit.is_voltage() { "mV" } else { "of the unit" };
    let run = answer.run.as_ref().map_or(String::new(), |run| format!(", run {run}"));
    let mut lines = vec![
        format!("extracted from {file}{run}"),
        format!(
            "{} readings from {lowest:.1} to {highest:.1} rpm, {duration_s:.3} s at {rate_hz} Hz",
            answer.readings
        ),
        reference(answer, settings.keyphasor.falling),
        format!(
            "windows of {} turns; a count of the core's converter is {:.6} {unit}",
            answer.revolutions,
            answer.count * answer.unit.mv()
        ),
    ];
    let inverted: Vec<&str> =
        answer.channels.iter().filter(|c| c.is_inverted).map(|c| c.probe.as_str()).collect();
    if !inverted.is_empty() {
        lines.push(format!(
            "negative sensitivity of {}: right only where the channel is inverted, else its angles are 180° off",
            inverted.join(", ")
        ));
    }
    lines.extend(of_marks(keyphasor, settings));
    if let Some(done) = &answer.compensated {
        lines.push(format!(
            "{} of {} bins are as if their speed had been held; the largest change is {:.3} µm 0-pk at {:.0} rpm",
            done.bins - done.left,
            done.bins,
            done.largest_um,
            done.at_rpm
        ));
        if done.left > 0 {
            lines.push(format!("{} bins stay as measured: too few readings around them; fewer --revolutions or a larger --bin-rpm give more", done.left));
        }
    }
    lines.extend(answer.doubts.iter().map(|doubt| format!("doubtful: {doubt}")));
    lines.extend(answer.losses.iter().map(|loss| format!("lost: {}", loss.words)));
    lines.extend(answer.drifted.iter().map(|drifted| drifted.advice.clone()));
    lines
}

/// What phases are counted from, and which channel each probe is.
fn reference(answer: &ExtractedFileAnswer, is_falling: bool) -> String {
    let ExtractedKeyphasor { channel, threshold, samples_per_turn, .. } = &answer.keyphasor;
    let probes: Vec<String> =
        answer.channels.iter().map(|c| format!("{} is {}", c.probe, c.channel)).collect();
    let way = if is_falling { "falls" } else { "rises" };
    let zero = match samples_per_turn {
        Some(samples) => format!("t = 0 at the first of every {samples} samples, a turn"),
        None => format!("t = 0 where channel {channel} {way} through {}", three_digits(*threshold)),
    };
    format!("{zero}; probe {}", probes.join(", "))
}

/// What was made of the keyphasor's pulses.
fn of_marks(keyphasor: &ExtractedKeyphasor, settings: &Settings) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(pulses) = settings.keyphasor.pulses.filter(|pulses| *pulses > 1) {
        lines.push(match keyphasor.is_after_gap {
            true => format!("{pulses} pulses a turn, the first after the gap at t = 0"),
            false => format!(
                "{pulses} pulses a turn, the first of the file at t = 0: phases of two files cannot be compared"
            ),
        });
    }
    let told = [
        (keyphasor.missing_teeth, "teeth are missing in every turn"),
        (keyphasor.missed_pulses, "pulses of the tacho did not come"),
        (keyphasor.extra_marks, "marks came again within a turn and were left out"),
    ];
    lines.extend(
        told.iter().filter(|(number, _)| *number > 0).map(|(number, what)| format!("{number} {what}")),
    );
    if keyphasor.filled_marks > 0 {
        let (filled, in_all) = (keyphasor.filled_marks, keyphasor.marks);
        let percent = (100.0 * filled as f64 / in_all as f64).max(1.0);
        lines.push(format!(
            "{filled} of {in_all} marks ({percent:.0} %) were missing and were put in between their neighbours"
        ));
    }
    if let Some(at_s) = keyphasor.reference_lost_s {
        lines.push(format!("at {at_s:.3} s the tacho had paused for a turn: phases are unknown from there on, and no reading was taken"));
    }
    lines
}
