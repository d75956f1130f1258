//! Damped modes over speed: the Campbell diagram, damped critical speeds, the threshold of instability.

use rayon::prelude::*;

use crate::check::modes::{Mode, follow, likeness, modes};
use crate::check::system::System;
use crate::error::Error;

/// Modes that are reported at least at every speed.
const FEWEST: usize = 4;
/// Two modes of neighbouring speeds are one branch if they are at least this alike.
const ALIKE: f64 = 0.5;
/// And if their frequencies differ by less than this.
const NEAR: f64 = 0.5;
/// Growth below this share of the frequency is rounding.
const GROWS: f64 = 1e-9;
/// Halvings that find where a branch crosses a line.
const HALVINGS: usize = 50;

/// Damped modes at every speed.
pub struct Campbell {
    /// Speeds, ascending, rad/s.
    pub speeds_rad_s: Vec<f64>,
    /// Modes at each speed, by rising frequency.
    pub modes: Vec<Vec<Mode>>,
    /// Branches: the first speed's number and the mode's number at it and the following speeds.
    pub branches: Vec<(usize, Vec<usize>)>,
}

/// Where a mode begins to grow.
#[derive(Debug, Clone, PartialEq)]
pub struct Threshold {
    /// First speed at which a log decrement is negative, rad/s.
    pub speed_rad_s: f64,
    /// Frequency at which the machine then whirls, rad/s.
    pub frequency_rad_s: f64,
    /// Whether the machine is unstable from the first speed that was looked at on.
    pub from_the_first: bool,
}

impl Campbell {
    /// Modes up to a frequency at these ascending speeds.
    ///
    /// # Errors
    /// As [`modes`].
    pub fn new(system: &System, speeds_rad_s: &[f64], highest_rad_s: f64) -> Result<Self, Error> {
        let at = |speed: &f64| modes(system, *speed, highest_rad_s, FEWEST);
        let modes: Vec<Vec<Mode>> = speeds_rad_s.par_iter().map(at).collect::<Result<_, _>>()?;
        let mut branches: Vec<(usize, Vec<usize>)> = Vec::new();
        for (number, here) in modes.iter().enumerate() {
            let mut taken = vec![false; here.len()];
            if let Some(before) = number.checked_sub(1).map(|b| &modes[b]) {
                for (branch, mode) in pairs(before, here) {
                    let open = branches.iter_mut().find(|(first, along)| {
                        first + along.len() == number && along.last() == Some(&branch)
                    });
                    if let Some((_, along)) = open {
                        along.push(mode);
                        taken[mode] = true;
                    }
                }
            }
            branches.extend((0..here.len()).filter(|m| !taken[*m]).map(|m| (number, vec![m])));
        }
        Ok(Self { speeds_rad_s: speeds_rad_s.to_vec(), modes, branches })
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

    /// The first speed at which a mode grows.
    pub fn threshold(&self, system: &System) -> Option<Threshold> {
        let grows = |m: &Mode| m.eigenvalue.re > GROWS * m.eigenvalue.norm();
        let first = self.modes.iter().position(|here| here.iter().any(grows))?;
        let onset = |growing: &Mode| match first.checked_sub(1) {
            Some(before) => crossing(system, growing, self.speeds_rad_s[before], grows),
            None => Some(growing.clone()),
        };
        let growing = self.modes[first].iter().filter(|m| grows(m));
        let onsets = growing.map(|m| onset(m).unwrap_or_else(|| m.clone()));
        let earliest = onsets.min_by(|a, b| a.speed_rad_s.total_cmp(&b.speed_rad_s))?;
        Some(Threshold {
            speed_rad_s: earliest.speed_rad_s,
            frequency_rad_s: earliest.frequency_rad_s(),
            from_the_first: first == 0,
        })
    }
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
