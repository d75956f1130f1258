//! Sessions of measurement: runs between which the machine was not rebuilt and did not stand over night.

use super::mounting::Mountings;
use super::shift::SessionScatter;

/// A pause longer than this ends a session, days: the machine has cooled down, and another shift has come.
const PAUSE_D: f64 = 0.25;

/// Origin of the sessions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SessionSource {
    /// The measurement states them.
    Stated,
    /// Pauses between the times of the runs.
    Pauses,
    /// Blocks of consecutive runs with stated weights, in the order of the data.
    Blocks,
    /// Nothing tells them: the runs with stated weights are one session.
    Assumed,
}

/// The session of each run.
#[derive(Debug, Clone, PartialEq)]
pub struct Sessions {
    pub source: SessionSource,
    /// Number of the session of each run; `None` for a run of a session without a run with stated weights.
    pub of: Vec<Option<usize>>,
    /// Number of sessions with runs of stated weights.
    pub count: usize,
}

impl Sessions {
    /// Runs with stated weights and no stated session are one session where others state theirs. Blind runs are of a session of
    /// their own unless they state another.
    pub fn of(mountings: &Mountings) -> Self {
        let runs = &mountings.runs;
        let labelled = |k: &usize| runs[*k].stated.is_some();
        if runs.iter().any(|m| m.session.is_some()) {
            let known: Vec<Option<&str>> =
                runs.iter().map(|m| m.session.as_deref().or((m.stated.is_some()).then_some(""))).collect();
            return Self::numbered(SessionSource::Stated, &known, labelled);
        }
        if let Some(spells) = spells(mountings) {
            return Self::numbered(SessionSource::Pauses, &spells, labelled);
        }
        let one = runs.iter().map(|m| m.stated.as_ref().map(|_| 0)).collect();
        Self { source: SessionSource::Assumed, of: one, count: 1 }
    }

    /// Blocks of consecutive runs in place of one session that is assumed, each as long as there are blocks; `None` where these have
    /// no more runs than each has unknowns of its own.
    pub fn in_blocks(&self, planes: usize) -> Option<Self> {
        let all: Vec<usize> = (0..self.of.len()).filter(|k| self.of[*k].is_some()).collect();
        let count = (all.len() as f64).sqrt().round() as usize;
        if self.source != SessionSource::Assumed || count <= 1 + planes {
            return None;
        }
        let mut of = vec![None; self.of.len()];
        all.iter().enumerate().for_each(|(i, k)| of[*k] = Some(i * count / all.len()));
        Some(Self { source: SessionSource::Blocks, of, count })
    }

    /// Sessions by a key of each run, of which those with runs of stated weights count.
    fn numbered<T: PartialEq>(
        source: SessionSource,
        keys: &[Option<T>],
        labelled: impl Fn(&usize) -> bool,
    ) -> Self {
        let mut known: Vec<&T> = Vec::new();
        for key in (0..keys.len()).filter(labelled).filter_map(|k| keys[k].as_ref()) {
            if !known.contains(&key) {
                known.push(key);
            }
        }
        let number = |key: &Option<T>| known.iter().position(|k| Some(*k) == key.as_ref());
        Self { source, of: keys.iter().map(number).collect(), count: known.len() }
    }
}

/// Number of pauses before each run, where all runs have times.
fn spells(mountings: &Mountings) -> Option<Vec<Option<usize>>> {
    let times: Vec<[f64; 2]> = mountings.runs.iter().map(|m| m.times_d).collect::<Option<_>>()?;
    let mut order: Vec<usize> = (0..times.len()).collect();
    order.sort_by(|a, b| times[*a][0].total_cmp(&times[*b][0]));
    let mut spells = vec![None; times.len()];
    let (mut pauses, mut until) = (0, f64::INFINITY);
    for k in order {
        pauses += usize::from(times[k][0] > until + PAUSE_D);
        until = times[k][1].max(if until.is_finite() { until } else { times[k][1] });
        spells[k] = Some(pauses);
    }
    Some(spells)
}

/// Intervals that sessions widen by more than this, relative, are told.
const MATTERS: f64 = 0.1;

/// What sessions add to the intervals.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionReport {
    pub source: SessionSource,
    /// Number of runs of a session without a run of stated weights.
    pub new_runs: usize,
    pub between: SessionScatter,
    /// Mean 95 % half-width of these runs, g·mm, with the shift of their session and without it, as if they were of the session of
    /// the base run; `None` where there are no such runs.
    pub half_width_g_mm: Option<[f64; 2]>,
    /// One sentence each.
    pub words: Vec<String>,
}

impl SessionReport {
    /// `half_widths` with the shift and without it, of each such run and plane, g·mm.
    pub fn new(
        sessions: &Sessions,
        mountings: &Mountings,
        between: SessionScatter,
        half_widths: &[[f64; 2]],
    ) -> Self {
        let runs = mountings.runs.iter().zip(&sessions.of);
        let new: Vec<_> = runs.filter(|(_, session)| session.is_none()).map(|(m, _)| m).collect();
        let mean = |i: usize| half_widths.iter().map(|h| h[i]).sum::<f64>() / half_widths.len() as f64;
        let half_width_g_mm = (!half_widths.is_empty()).then(|| [mean(0), mean(1)]);
        let mut names: Vec<&str> = Vec::new();
        for name in new.iter().filter_map(|m| m.session.as_deref()) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        let unlabelled = |name: &&str| format!("Session {name} has no run with stated weights.");
        let mut words: Vec<String> = names.iter().map(unlabelled).collect();
        let widened = half_width_g_mm.filter(|[with, without]| *with > (1.0 + MATTERS) * without);
        if let Some([with, without]) = widened {
            let runs = match new.as_slice() {
                [one] => format!("Run {} counts as a new session", one.run),
                all => format!("{} runs count as new sessions", all.len()),
            };
            words.push(format!(
                "{runs}, whose base and scale may have shifted: ±{with:.1} g·mm (95 %), in the session of the base run \
                 ±{without:.1} g·mm."
            ));
            words.push(origin(sessions.source, &between));
            let state = match sessions.source {
                SessionSource::Blocks | SessionSource::Assumed => {
                    ", and state the sessions in a column session of the measurement"
                }
                SessionSource::Stated | SessionSource::Pauses => "",
            };
            words.push(format!("Measure one run with stated weights in the new session too{state}."));
        }
        Self { source: sessions.source, new_runs: new.len(), between, half_width_g_mm, words }
    }
}

/// The size of the shift, and where it comes from.
fn origin(source: SessionSource, between: &SessionScatter) -> String {
    let size = format!(
        "base {:.1} times the scatter between mountings, scale {:.0} % (standard deviations)",
        between.base,
        100.0 * between.scale
    );
    let count = between.sessions;
    match source {
        _ if count < 2 => {
            format!("One session only has stated weights, so the shift between sessions is assumed: {size}.")
        }
        SessionSource::Stated => format!("The shift is learned from {count} stated sessions: {size}."),
        SessionSource::Pauses => {
            format!("The shift is learned from {count} sessions between pauses: {size}.")
        }
        SessionSource::Blocks | SessionSource::Assumed => {
            format!(
                "No sessions are stated; the shift is learned from {count} blocks of consecutive runs: {size}."
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Complex, DVector};

    use super::super::mounting::Mounting;
    use super::*;

    /// Runs by whether their weights are stated, their session and their day.
    fn mountings(runs: &[(bool, Option<&str>, Option<f64>)]) -> Mountings {
        let run = |(k, (stated, session, day)): (usize, &(bool, Option<&str>, Option<f64>))| Mounting {
            run: format!("run {k}"),
            stated: stated.then(|| vec![Complex::from(0.0); 2]),
            session: session.map(String::from),
            times_d: day.map(|d| [d, d + 0.01]),
            phasors: vec![None],
            speeds_rad_s: vec![100.0],
            repeats: vec![0],
        };
        Mountings {
            runs: runs.iter().enumerate().map(run).collect(),
            base: 0,
            speeds_rad_s: vec![100.0],
            probes: 1,
            repeat_variance: DVector::zeros(1),
            remarks: Vec::new(),
        }
    }

    #[test]
    fn stated_sessions_count_where_they_have_stated_weights() {
        let all = [
            (true, Some("a"), None),
            (true, None, None),
            (false, Some("a"), None),
            (false, Some("b"), None),
            (false, None, None),
        ];
        let found = Sessions::of(&mountings(&all));
        assert_eq!((found.source, found.count), (SessionSource::Stated, 2));
        assert_eq!(found.of, [Some(0), Some(1), Some(0), None, None]);
        let report = SessionReport::new(&found, &mountings(&all), SessionScatter::GUESSED, &[]);
        assert_eq!(report.words, ["Session b has no run with stated weights."]);
    }

    #[test]
    fn pause_over_night_ends_a_session_in_order_of_time() {
        let all = [
            (true, None, Some(2.0)),
            (true, None, Some(1.0)),
            (false, None, Some(2.2)),
            (false, None, Some(3.0)),
        ];
        let found = Sessions::of(&mountings(&all));
        assert_eq!((found.source, found.count), (SessionSource::Pauses, 2));
        assert_eq!(found.of, [Some(0), Some(1), Some(0), None]);
        let mut one_without = all;
        one_without[0].2 = None;
        assert_eq!(Sessions::of(&mountings(&one_without)).source, SessionSource::Assumed);
    }

    #[test]
    fn blocks_are_as_long_as_there_are_and_few_runs_have_none() {
        let runs = |count: usize| vec![(true, None, None); count];
        let found = Sessions::of(&mountings(&runs(16))).in_blocks(2).unwrap();
        let blocks: Vec<usize> = found.of.iter().flatten().copied().collect();
        assert_eq!(blocks, [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3]);
        assert_eq!(Sessions::of(&mountings(&runs(9))).in_blocks(2), None);
    }
}
