//! Speeds of several runs that are one speed of measurement.
//!
//! No machine is held at a speed to the last rpm. Speeds are joined smallest distance first, until a group would span more than is
//! allowed; two groups that both hold every run are two speeds of a run-up, however near.

use std::collections::BTreeSet;

#[derive(Debug, Clone, Default, PartialEq)]
pub struct Speeds {
    /// Number of the speed of each reading.
    pub of: Vec<usize>,
    /// Mean of each speed's readings, rpm, ascending.
    pub mean_rpm: Vec<f64>,
    /// Slowest and fastest of each speed's readings, rpm.
    pub ends_rpm: Vec<[f64; 2]>,
    /// Widest span that was allowed, relative.
    pub same: f64,
}

impl Speeds {
    /// Of readings by run and speed in rpm.
    pub fn new(readings: &[(usize, f64)], same: f64) -> Self {
        let mut speeds = Self { of: vec![0; readings.len()], same, ..Self::default() };
        for (number, group) in groups(readings, same).into_iter().enumerate() {
            group.iter().for_each(|r| speeds.of[*r] = number);
            speeds.mean_rpm.push(group.iter().map(|r| readings[*r].1).sum::<f64>() / group.len() as f64);
            speeds.ends_rpm.push([group[0], group[group.len() - 1]].map(|r| readings[r].1));
        }
        speeds
    }
}

/// Groups of the numbers of readings (run, speed) that are of one speed, ascending; `same` is the widest span, relative.
fn groups(readings: &[(usize, f64)], same: f64) -> Vec<Vec<usize>> {
    let runs = readings.iter().map(|(run, _)| run).collect::<BTreeSet<_>>().len();
    let mut order: Vec<usize> = (0..readings.len()).collect();
    order.sort_by(|a, b| readings[*a].1.total_cmp(&readings[*b].1));
    let speed = |k: usize| readings[order[k]].1;
    // groups are stretches of the order; `start[k]` is where the one that ends before k begins
    let mut ends: BTreeSet<usize> = (1..=order.len()).collect();
    let mut gaps: Vec<usize> = (1..order.len()).collect();
    gaps.sort_by(|a, b| (speed(*a) / speed(*a - 1)).total_cmp(&(speed(*b) / speed(*b - 1))));
    for gap in gaps {
        let from = ends.range(..gap).next_back().copied().unwrap_or(0);
        let to = *ends.range(gap + 1..).next().expect("the last group ends at the end");
        let whole = |part: std::ops::Range<usize>| {
            order[part].iter().map(|r| readings[*r].0).collect::<BTreeSet<_>>().len() == runs
        };
        let equal = speed(gap) == speed(gap - 1);
        let near = speed(to - 1) <= speed(from) * (1.0 + same);
        if equal || near && !(whole(from..gap) && whole(gap..to)) {
            ends.remove(&gap);
        }
    }
    let mut from = 0;
    let stretch = |to: usize| {
        let group = order[from..to].to_vec();
        from = to;
        group
    };
    ends.into_iter().map(stretch).collect()
}

#[cfg(test)]
mod tests {
    use super::groups;

    #[test]
    fn nearby_run_speeds_form_one_group_and_run_up_steps_do_not() {
        let course = [(0, 1445.7), (1, 1453.9), (2, 1450.0)];
        assert_eq!(groups(&course, 0.01), [vec![0, 2, 1]]);
        assert_eq!(groups(&course, 0.005).len(), 2);
        // steps of 0.3 %, each held to 0.05 % by both runs
        let step = |k: usize| 3000.0 * 1.003_f64.powi(k as i32);
        let runup: Vec<(usize, f64)> = (0..20).flat_map(|k| [(0, step(k)), (1, step(k) * 1.0005)]).collect();
        let found = groups(&runup, 0.01);
        assert_eq!(found.len(), 20);
        assert!(found.iter().enumerate().all(|(k, group)| *group == [2 * k, 2 * k + 1]));
    }

    #[test]
    fn one_run_is_a_speed_a_reading_and_repeats_are_one() {
        assert_eq!(groups(&[(0, 100.0), (0, 100.0), (0, 100.2)], 0.01), [vec![0, 1], vec![2]]);
        assert!(groups(&[], 0.01).is_empty());
    }
}
