//! Windows as readings, and what became of those that are none.

use rotor_edge_desktop::units::SECONDS_A_DAY;
use std::fmt;

use nalgebra::Complex;
use rotor_edge_core::extraction::Outcome;
use rotor_edge_desktop::measurement::Reading;

use super::mark::{Mark, intervals};
use super::settings::Settings;
use super::train::uneven_turns;
use super::windows::{ProbeWindow, Window};

/// Readings that are lost for one reason.
#[derive(Debug, Clone, PartialEq)]
pub struct Loss {
    pub why: &'static str,
    /// The probe that lost them; nothing where all did.
    pub probe: Option<String>,
    pub windows: usize,
    /// When the first of them ended, s from the beginning of the file.
    pub first_s: f64,
}

impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let of = self.probe.as_ref().map_or(String::new(), |probe| format!(" of probe {probe}"));
        let windows = if self.windows == 1 { "window" } else { "windows" };
        write!(f, "{} {windows}{of} ({}, first at {:.3} s)", self.windows, self.why, self.first_s)
    }
}

pub const OUT_OF_STEP: &str = "a mark came too early or too late";
pub const DRIFT: &str = "the speed changed too much within the window";
pub const TOO_FEW_SAMPLES: &str = "fewer than eight samples in a turn";
pub const NO_MARK: &str = "no mark for the longest turn";
pub const CLIPPED: &str = "clipped";
pub const OPEN: &str = "gap voltage out of range";

/// All losses, those of windows first.
pub fn losses(windows: &[Window], probes: &[String], rate_hz: f64) -> Vec<Loss> {
    let mut all: Vec<Loss> = Vec::new();
    let mut lose = |why: &'static str, probe: Option<&String>, sample: usize| match all
        .iter_mut()
        .find(|loss| loss.why == why && loss.probe.as_ref() == probe)
    {
        Some(loss) => loss.windows += 1,
        None => all.push(Loss { why, probe: probe.cloned(), windows: 1, first_s: sample as f64 / rate_hz }),
    };
    for window in windows {
        match window.outcome {
            Outcome::NoMark => lose(NO_MARK, None, window.sample),
            Outcome::Drift => lose(DRIFT, None, window.sample),
            Outcome::TooFewSamples => lose(TOO_FEW_SAMPLES, None, window.sample),
            Outcome::Measured => {
                for (probe, seen) in probes.iter().zip(&window.probes) {
                    if seen.is_clipped {
                        lose(CLIPPED, Some(probe), window.sample);
                    } else if seen.is_open {
                        lose(OPEN, Some(probe), window.sample);
                    }
                }
            }
            _ => lose(OUT_OF_STEP, None, window.sample),
        }
    }
    all.sort_by_key(|loss| loss.probe.is_some());
    all
}

/// What all readings of a file have in common.
pub struct RecordingContext<'a> {
    pub run: Option<&'a str>,
    /// When the file begins, s.
    pub begins_s: f64,
    pub rate_hz: f64,
    /// What no count stands for, V.
    pub zero_v: f64,
}

/// Windows whose speed changed too much.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriftedWindows {
    pub windows: usize,
    pub in_all: usize,
    /// The largest change in one of them, relative.
    pub largest: f64,
}

/// Those that are lost for drift, if any.
pub fn drifted(windows: &[Window]) -> Option<DriftedWindows> {
    let lost = windows.iter().filter(|w| w.outcome == Outcome::Drift);
    let changes: Vec<f64> = lost.map(|w| f64::from(w.drift.abs())).collect();
    let largest = changes.iter().copied().reduce(f64::max)?;
    Some(DriftedWindows { windows: changes.len(), in_all: windows.len(), largest })
}

/// Why windows are lost whose marks come unevenly: a shaft does not change its speed so, pulses are missing or false.
pub fn uneven(losses: &[Loss], marks: &[Mark]) -> Option<String> {
    let of_marks = losses.iter().filter(|loss| [OUT_OF_STEP, DRIFT].contains(&loss.why));
    let windows: usize = of_marks.map(|loss| loss.windows).sum();
    let (uneven, turns) = (uneven_turns(marks), marks.len().saturating_sub(1));
    // a false or a missing pulse spoils the window that it is in, or two
    (windows > 0 && 2 * uneven >= windows).then(|| {
        format!(
            "{uneven} of {turns} turns are unlike those beside them, so pulses are missing or false; expected another --threshold or \
             --hold-off, or a keyphasor with a clear pulse in each turn"
        )
    })
}

/// Which option reads marks that come more rarely than the longest turn allows, if half of them do.
pub fn slow(losses: &[Loss], marks: &[Mark], rate_hz: f64, slowest_rpm: f64) -> Option<String> {
    let mut turns = intervals(marks);
    turns.sort_by(f64::total_cmp);
    let rpm = 60.0 * rate_hz / turns.get(turns.len() / 2)?;
    (losses.iter().any(|loss| loss.why == NO_MARK) && rpm < slowest_rpm).then(|| {
        format!("half of the marks show {rpm:.1} rpm or less, expected --slowest-rpm below the slowest speed")
    })
}

impl DriftedWindows {
    /// How many there are, and which option keeps them: a window of fewer turns changes less in proportion.
    pub fn advice(&self, revolutions: u16, largest_drift: f32) -> String {
        let Self { windows, in_all, largest } = self;
        let turns = (f64::from(revolutions) * f64::from(largest_drift) / self.largest).floor();
        let option = match turns >= 2.0 {
            true => format!("--revolutions {turns}"),
            false => format!("--largest-drift {}", (1e3 * self.largest).ceil() / 1e3),
        };
        let percent = 100.0 * largest;
        format!(
            "the speed changed by up to {percent:.1} % within {windows} of {in_all} windows; {option} keeps them"
        )
    }
}

/// The 1x vectors of the windows that show a probe at least, integrated to displacement, and their gap voltages.
pub fn readings(windows: &[Window], recorded: &RecordingContext, settings: &Settings) -> Vec<Reading> {
    let of_window = |window: &Window| {
        let speed_rpm = f64::from(window.speed_rpm);
        let gaps_v = match settings.has_gap() {
            true => window.probes.iter().map(|seen| gap_v(seen, recorded.zero_v)).collect(),
            false => Vec::new(),
        };
        (window.probes.iter().map(|seen| displacement_m(seen, speed_rpm, settings)).collect(), gaps_v)
    };
    shown(windows.iter().map(|window| (window, of_window(window))), recorded, settings)
}

/// The same of other vectors, µm, which go by window and probe.
pub fn readings_of(
    windows: &[Window],
    vectors_um: Vec<Vec<Option<Complex<f64>>>>,
    recorded: &RecordingContext,
    settings: &Settings,
) -> Vec<Reading> {
    let in_m = |vectors: Vec<Option<Complex<f64>>>| vectors.into_iter().map(|y| Some(1e-6 * y?)).collect();
    let each = windows.iter().zip(vectors_um).map(|(window, vectors)| (window, (in_m(vectors), Vec::new())));
    shown(each, recorded, settings)
}

/// Vectors of probes, m, and their gap voltages, V.
type Values = (Vec<Option<Complex<f64>>>, Vec<Option<f64>>);

/// Those that show a probe at least, at the time of the middle of their window.
fn shown<'a>(
    each: impl Iterator<Item = (&'a Window, Values)>,
    recorded: &RecordingContext,
    settings: &Settings,
) -> Vec<Reading> {
    let usable = each.filter(|(window, _)| window.outcome == Outcome::Measured);
    let each = usable.map(|(window, (probes, gaps_v))| {
        let speed_rpm = f64::from(window.speed_rpm);
        let half_s = 30.0 * f64::from(settings.revolutions) / speed_rpm;
        Reading {
            row: None,
            run: recorded.run.map(str::to_string),
            session: None,
            time_d: Some(
                (recorded.begins_s + window.sample as f64 / recorded.rate_hz - half_s) / SECONDS_A_DAY,
            ),
            speed_rpm,
            probes,
            gaps_v,
            conditions: Vec::new(),
        }
    });
    each.filter(|r| r.probes.iter().any(Option::is_some)).collect()
}

fn displacement_m(seen: &ProbeWindow, speed_rpm: f64, settings: &Settings) -> Option<Complex<f64>> {
    let vector = Some(seen.vector).filter(|v| v.is_finite())?;
    let phasor = Complex::new(f64::from(vector.cos_um), -f64::from(vector.sin_um));
    let um = settings.unit().integral(speed_rpm).map_or(phasor, |integral| phasor * integral);
    Some(um * 1e-6)
}

/// A voltage that nobody can believe is none.
fn gap_v(seen: &ProbeWindow, zero_v: f64) -> Option<f64> {
    (!seen.is_open && !seen.is_clipped).then_some(zero_v + f64::from(seen.gap_v))
}

/// Readings that follow one another within `bin_rpm` of the first of them.
pub fn bins(readings: &[Reading], bin_rpm: f64) -> Vec<&[Reading]> {
    let mut bins = Vec::new();
    let mut rest = readings;
    while let Some(first) = rest.first() {
        let is_near = |r: &&Reading| (r.speed_rpm - first.speed_rpm).abs() <= bin_rpm;
        let (bin, others) = rest.split_at(rest.iter().take_while(is_near).count());
        bins.push(bin);
        rest = others;
    }
    bins
}

/// Each probe's mean over the readings that show it.
pub fn mean_of(bin: &[Reading]) -> Reading {
    let first = &bin[0];
    let each = |values: &dyn Fn(&Reading) -> Option<f64>| {
        let (sum, number) = bin.iter().filter_map(values).fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
        (number > 0.0).then_some(sum / number)
    };
    let part = |probe: usize, of: fn(&Complex<f64>) -> f64| each(&|r| r.probes[probe].as_ref().map(of));
    Reading {
        row: None,
        run: first.run.clone(),
        session: first.session.clone(),
        time_d: each(&|r| r.time_d),
        speed_rpm: each(&|r| Some(r.speed_rpm)).unwrap_or(first.speed_rpm),
        probes: (0..first.probes.len())
            .map(|p| Some(Complex::new(part(p, |y| y.re)?, part(p, |y| y.im)?)))
            .collect(),
        gaps_v: (0..first.gaps_v.len()).map(|p| each(&|r| r.gaps_v[p])).collect(),
        conditions: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_pulses_are_named_and_a_change_of_speed_is_not() {
        let marks = |at: &dyn Fn(u32) -> f64| -> Vec<Mark> {
            (0..60).map(|k| Mark { sample: at(k).ceil() as usize, age: 0.0 }).collect()
        };
        let lost = |why| [Loss { why, probe: None, windows: 3, first_s: 0.0 }];
        let missing: Vec<Mark> =
            marks(&|k| 100.0 * f64::from(k)).into_iter().filter(|m| m.sample / 100 % 9 != 4).collect();
        let why = uneven(&lost(OUT_OF_STEP), &missing).unwrap();
        assert!(why.starts_with("7 of 52 turns are unlike those beside them"), "{why}");
        assert_eq!(uneven(&lost(CLIPPED), &missing), None);
        let run_up = marks(&|k| 1000.0 * f64::from(k + 1).sqrt());
        assert_eq!(uneven(&lost(DRIFT), &run_up[10..]), None);
    }

    #[test]
    fn bin_is_mean_per_probe_and_restarts_when_speed_leaves() {
        let reading = |speed_rpm: f64, y: Option<f64>| Reading {
            time_d: Some(speed_rpm / 1000.0),
            speed_rpm,
            probes: vec![y.map(|y| Complex::new(y, 2.0 * y)), Some(Complex::new(1.0, 0.0))],
            gaps_v: vec![Some(-y.unwrap_or(8.0)), None],
            ..Reading::default()
        };
        let all =
            [(1000.0, Some(1.0)), (1004.0, None), (1008.0, Some(3.0)), (1020.0, Some(5.0)), (1002.0, None)]
                .map(|(speed_rpm, y)| reading(speed_rpm, y));
        let bins: Vec<Reading> = bins(&all, 10.0).into_iter().map(mean_of).collect();
        let speeds: Vec<f64> = bins.iter().map(|bin| bin.speed_rpm).collect();
        assert_eq!(speeds, [1004.0, 1020.0, 1002.0]);
        assert_eq!(bins[0].probes, [Some(Complex::new(2.0, 4.0)), Some(Complex::new(1.0, 0.0))]);
        assert_eq!((bins[0].gaps_v[0], bins[0].time_d), (Some(-4.0), Some(1.004)));
        assert_eq!(bins[2].probes[0], None);
    }
}
