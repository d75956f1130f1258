//! Text of an answer of `extract`.

use crate::answers::extract::{ExtractedFileAnswer, ExtractedKeyphasor, ExtractionAnswer};
use crate::ingest::waveform::settings::Settings;

/// The whole answer on a terminal.
pub fn text(answer: &ExtractionAnswer, settings: &Settings) -> String {
    let lines: String = account(answer, settings).iter().map(|line| format!("{line}\n")).collect();
    let also = answer.two_x.as_ref().map_or(String::new(), |path| format!(", 2x to {}", path.display()));
    format!("{lines}\nWritten to {}{also}.\n", answer.measured.display())
}

/// What was done, in sentences; also the comment at the head of the readings.
pub fn account(answer: &ExtractionAnswer, settings: &Settings) -> Vec<String> {
    answer.files.iter().flat_map(|file| of_file(file, settings)).collect()
}

fn of_file(answer: &ExtractedFileAnswer, settings: &Settings) -> Vec<String> {
    let ExtractedFileAnswer { file, keyphasor, rate_hz, duration_s, .. } = answer;
    let [lowest, highest] = answer.range_rpm;
    let probes: Vec<String> =
        answer.channels.iter().map(|c| format!("{} is {}", c.probe, c.channel)).collect();
    let way = if settings.keyphasor.falling { "falls" } else { "rises" };
    let unit = if answer.unit.is_voltage() { "mV" } else { "of the unit" };
    let run = answer.run.as_ref().map_or(String::new(), |run| format!(", run {run}"));
    let mut lines = vec![
        format!("extracted from {file}{run}"),
        format!(
            "{} readings from {lowest:.1} to {highest:.1} rpm, {duration_s:.3} s at {rate_hz} Hz",
            answer.readings
        ),
        match keyphasor.samples_per_turn {
            Some(samples) => {
                format!("t = 0 at the first of every {samples} samples, a turn; probe {}", probes.join(", "))
            }
            None => format!(
                "t = 0 where channel {} {way} through {:.6}; probe {}",
                keyphasor.channel,
                keyphasor.threshold,
                probes.join(", ")
            ),
        },
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
