//! Damped modes over speed: the Campbell diagram, damped critical speeds, the threshold of instability.

use rayon::prelude::*;

use crate::check::modes::{Mode, Roots, follow, likeness, roots};
use crate::check::system::System;
use crate::error::Error;

/// Modes that are reported at least at every speed.
const FEWEST: usize = 4;
/// Two modes of neighbouring speeds are one branch if they are at least this alike.
const ALIKE: f64 = 0.5;
/// And if their frequencies differ by less than this.
const NEAR: f64 = 0.5;
/// Rounds in which a step of the speed is halved where a branch breaks off.
const REFINEMENTS: usize = 3;
/// A branch that breaks off matters where its frequency is within this factor of the speed.
const NEAR_SPEED: f64 = 1.5;
/// Halvings that find where a branch crosses a line.
const HALVINGS: usize = 50;

/// Damped modes at every speed.
pub struct Campbell {
    /// Speeds, ascending, rad/s.
    pub speeds_rad_s: Vec<f64>,
    /// Modes at each speed, by rising frequency.
    pub modes: Vec<Vec<Mode>>,
    /// Roots at each speed that do not oscillate, as rates of growth, rad/s.
    pub real_rad_s: Vec<Vec<f64>>,
    /// Branches: the first speed's number and the mode's number at it and the following speeds.
    pub branches: Vec<(usize, Vec<usize>)>,
}

/// Where the machine begins to be unstable.
#[derive(Debug, Clone, PartialEq)]
pub struct Threshold {
    /// First speed at which a root grows, rad/s.
    pub speed_rad_s: f64,
    /// Frequency at which the machine then whirls, rad/s; zero where it moves away without oscillation.
    pub frequency_rad_s: f64,
    /// Whether the machine is unstable from the first speed that was looked at on.
    pub from_the_first: bool,
}

impl Campbell {
    /// Modes up to a frequency at these ascending speeds, and at others between them where a mode that may meet the
    /// speed cannot be followed.
    ///
    /// # Errors
    /// As [`roots`].
    pub fn new(system: &System, speeds_rad_s: &[f64], highest_rad_s: f64) -> Result<Self, Error> {
        let mut all = solved(system, speeds_rad_s, highest_rad_s)?;
        for _ in 0..REFINEMENTS {
            let more: Vec<f64> = all.windows(2).filter_map(broken).collect();
            if more.is_empty() {
                break;
            }
            all.extend(solved(system, &more, highest_rad_s)?);
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        let (mut speeds_rad_s, mut modes, mut real_rad_s) = (Vec::new(), Vec::new(), Vec::new());
        for (speed, found) in all {
            speeds_rad_s.push(speed);
            modes.push(found.modes);
            real_rad_s.push(found.real_rad_s);
        }
        Ok(Self { branches: branches(&modes), speeds_rad_s, modes, real_rad_s })
    }

    /// Number of a speed among those that were looked at.
    pub fn at(&self, speed_rad_s: f64) -> Option<usize> {
        self.speeds_rad_s.iter().position(|s| *s == speed_rad_s)
    }

    /// The modes of a branch from its first speed on.
    pub fn along<'a>(&'a self, branch: &'a (usize, Vec<usize>)) -> impl Iterator<Item = &'a Mode> {
        branch.1.iter().enumerate().map(|(k, m)| &self.modes[branch.0 + k][*m])
    }

    /// Damped critical speeds in the range: where a branch has the frequency of the rotation; ascending.
    pub fn damped_critical_speeds(&self, system: &System) -> Vec<Mode> {
        let mut found: Vec<Mode> = Vec::new();
        for branch in &self.branches {
            let along: Vec<&Mode> = self.along(branch).collect();
            for pair in along.windows(2) {
                let above = |m: &Mode| m.frequency_rad_s() > m.speed_rad_s;
                if above(pair[0]) != above(pair[1]) {
                    found.extend(crossing(system, pair[0], pair[1].speed_rad_s, above));
                }
            }
        }
        found.sort_by(|a, b| a.speed_rad_s.total_cmp(&b.speed_rad_s));
        found
    }

    /// The first speed, from the number `start` on, at which a root grows.
    pub fn threshold(&self, system: &System, start: usize) -> Option<Threshold> {
        let first = (start..self.modes.len()).find(|k| self.grows_at(*k))?;
        let from_the_first = first == start;
        if !self.modes[first].iter().any(Mode::grows) {
            let speed_rad_s = self.speeds_rad_s[first];
            return Some(Threshold { speed_rad_s, frequency_rad_s: 0.0, from_the_first });
        }
        let onset = |growing: &Mode| match from_the_first {
            false => crossing(system, growing, self.speeds_rad_s[first - 1], Mode::grows),
            true => Some(growing.clone()),
        };
        let growing = self.modes[first].iter().filter(|m| m.grows());
        let onsets = growing.map(|m| onset(m).unwrap_or_else(|| m.clone()));
        let earliest = onsets.min_by(|a, b| a.speed_rad_s.total_cmp(&b.speed_rad_s))?;
        Some(Threshold {
            speed_rad_s: earliest.speed_rad_s,
            frequency_rad_s: earliest.frequency_rad_s(),
            from_the_first,
        })
    }

    /// Whether no mode at any speed has enough damping to state an amplitude, and no root decays without oscillation.
    pub fn is_undamped(&self) -> bool {
        let has_amplitude = |here: &Vec<Mode>| here.iter().any(Mode::has_amplitude);
        !self.modes.iter().any(has_amplitude) && self.real_rad_s.iter().all(Vec::is_empty)
    }

    /// Whether a root grows at the speed of this number.
    fn grows_at(&self, number: usize) -> bool {
        self.modes[number].iter().any(Mode::grows) || self.real_rad_s[number].iter().any(|rate| *rate > 0.0)
    }

    /// Whether the machine has a steady response at a speed: before the threshold of instability, and where no root grows
    /// at the nearest speed that was looked at.
    pub fn is_steady(&self, speed_rad_s: f64, threshold: Option<&Threshold>) -> bool {
        let Some(threshold) = threshold else { return true };
        if !threshold.from_the_first && speed_rad_s < threshold.speed_rad_s {
            return true;
        }
        let distance = |k: &usize| (self.speeds_rad_s[*k] - speed_rad_s).abs();
        let nearest = (0..self.speeds_rad_s.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.is_some_and(|k| !self.grows_at(k))
    }
}

/// Roots at each speed.
fn solved(system: &System, speeds_rad_s: &[f64], highest_rad_s: f64) -> Result<Vec<(f64, Roots)>, Error> {
    let at = |speed: &f64| Ok((*speed, roots(system, *speed, highest_rad_s, FEWEST)?));
    speeds_rad_s.par_iter().map(at).collect()
}

/// The middle of a step of the speed over which a mode that may meet it cannot be followed.
fn broken(step: &[(f64, Roots)]) -> Option<f64> {
    let [(from, before), (to, after)] = step else { return None };
    let paired = pairs(&before.modes, &after.modes);
    let matters =
        |m: &Mode| m.can_resonate() && (from / NEAR_SPEED..to * NEAR_SPEED).contains(&m.frequency_rad_s());
    let lost = |modes: &[Mode], is_paired: &dyn Fn(usize) -> bool| {
        modes.iter().enumerate().any(|(i, m)| matters(m) && !is_paired(i))
    };
    let breaks = lost(&before.modes, &|i| paired.iter().any(|(a, _)| *a == i))
        || lost(&after.modes, &|i| paired.iter().any(|(_, b)| *b == i));
    breaks.then_some(0.5 * (from + to))
}

/// Modes of all speeds, followed from each to the next.
fn branches(modes: &[Vec<Mode>]) -> Vec<(usize, Vec<usize>)> {
    let mut branches: Vec<(usize, Vec<usize>)> = Vec::new();
    for (number, here) in modes.iter().enumerate() {
        let mut taken = vec![false; here.len()];
        if let Some(before) = number.checked_sub(1).map(|b| &modes[b]) {
            for (branch, mode) in pairs(before, here) {
                let open = branches
                    .iter_mut()
                    .find(|(first, along)| first + along.len() == number && along.last() == Some(&branch));
                if let Some((_, along)) = open {
                    along.push(mode);
                    taken[mode] = true;
                }
            }
        }
        branches.extend((0..here.len()).filter(|m| !taken[*m]).map(|m| (number, vec![m])));
    }
    branches
}

/// Which mode of one speed is which of the next: the most alike first, each once.
fn pairs(before: &[Mode], here: &[Mode]) -> Vec<(usize, usize)> {
    let mut all: Vec<(f64, usize, usize)> = Vec::new();
    for (i, a) in before.iter().enumerate() {
        for (j, b) in here.iter().enumerate() {
            let apart = (a.eigenvalue - b.eigenvalue).norm() / a.eigenvalue.norm().max(b.eigenvalue.norm());
            let alike = likeness(a, b);
            if alike > ALIKE && apart < NEAR {
                all.push((alike - apart, i, j));
            }
        }
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut chosen: Vec<(usize, usize)> = Vec::new();
    for (_, i, j) in all {
        if chosen.iter().all(|(a, b)| *a != i && *b != j) {
            chosen.push((i, j));
        }
    }
    chosen
}

/// The mode at the speed, between its own and `to_rad_s`, where a condition that holds or fails for `from`
/// changes.
fn crossing(system: &System, from: &Mode, to_rad_s: f64, condition: impl Fn(&Mode) -> bool) -> Option<Mode> {
    let start = condition(from);
    let (mut near, mut far) = (from.clone(), to_rad_s);
    if condition(&follow(system, from, to_rad_s)?) == start {
        return None;
    }
    for _ in 0..HALVINGS {
        let middle = follow(system, &near, 0.5 * (near.speed_rad_s + far))?;
        if condition(&middle) == start {
            near = middle;
        } else {
            far = middle.speed_rad_s;
        }
        if (near.speed_rad_s - far).abs() < 1e-10 * far.abs() {
            break;
        }
    }
    Some(near)
}
