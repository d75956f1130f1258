//! A start-up as curves over speed: each run, along each direction that a bearing's probes see.

use nalgebra::Complex;

use crate::compare::probe_pairs;
use crate::machine::drawing::{Noise, Rotor};
use crate::measurement::{Reading, SortedRun};
use crate::unbalance::phasor_kg_m;

type C = Complex<f64>;

/// A direction in which the shaft is seen at a bearing.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbeDirection {
    /// `IB x`, or the probe's name where a bearing has one alone.
    pub label: String,
    pub bearing: usize,
    /// From +x, in the direction of rotation, rad.
    pub angle_rad: f64,
    /// The motion is the sum of these shares of these probes.
    shares: Vec<(usize, f64)>,
}

impl ProbeDirection {
    /// The motion along it, m, of what all probes show; `None` if one that it needs was lost.
    pub fn motion_m(&self, probes: &[Option<C>]) -> Option<C> {
        self.shares.iter().map(|(probe, share)| probes[*probe].map(|y| y * *share)).sum()
    }

    /// Standard deviation of each component of that motion, m.
    fn sigma_m(&self, probes: &[Option<C>], noise: &Noise) -> f64 {
        let of = |(probe, share): &(usize, f64)| {
            (share * noise.sigma_m(probes[*probe].unwrap_or_default())).powi(2)
        };
        self.shares.iter().map(of).sum::<f64>().sqrt()
    }

    /// A force that turns with the shaft, `F` in x, as it is felt along this direction.
    pub fn felt(&self, force: C) -> C {
        force * C::from_polar(1.0, -self.angle_rad)
    }
}

/// The directions of every bearing: x and y where two of its probes span the plane, whatever their
/// angles, and else the one that its first probe looks along.
pub fn directions(rotor: &Rotor) -> Vec<ProbeDirection> {
    let pairs = probe_pairs(rotor);
    let mut all = Vec::new();
    for (bearing, b) in rotor.bearing.iter().enumerate() {
        if let Some(pair) = pairs.iter().find(|p| p.bearing == bearing) {
            let units = [[1.0, 0.0], [0.0, 1.0]].map(|unit| pair.xy(unit.map(C::from)));
            for (axis, name) in ["x", "y"].into_iter().enumerate() {
                let share = |k: usize| (pair.probes[k], units[k][axis].re);
                // a probe along the other axis has no say here beyond rounding
                let shares = [share(0), share(1)].into_iter().filter(|(_, s)| s.abs() > 1e-9).collect();
                let angle_rad = axis as f64 * std::f64::consts::FRAC_PI_2;
                all.push(ProbeDirection { label: format!("{} {name}", b.name), bearing, angle_rad, shares });
            }
        } else if let Some(i) = (0..rotor.probe.len()).find(|i| rotor.probe[*i].bearing == b.name) {
            let probe = &rotor.probe[i];
            all.push(ProbeDirection {
                label: probe.name.clone(),
                bearing,
                angle_rad: probe.angle_deg.to_radians(),
                shares: vec![(i, 1.0)],
            });
        }
    }
    all
}

#[derive(Debug, Clone, PartialEq)]
pub struct RunUp {
    /// As in the file; `None` where it has no runs.
    pub name: Option<String>,
    /// Trial weights together, kg·m, all in the plane of the disk.
    pub added_kg_m: C,
    /// Rows of the measurement by ascending speed.
    pub rows: Vec<usize>,
}

impl RunUp {
    /// Every run in the order of the file.
    pub fn all(rotor: &Rotor, readings: &[Reading]) -> Vec<Self> {
        let with_weights = |SortedRun { name, rows }| {
            let stated = rotor.run.iter().find(|r| Some(&r.name) == name.as_ref());
            let weights = stated.iter().flat_map(|r| &r.added_unbalance);
            let added_kg_m = weights.map(|a| phasor_kg_m(a.magnitude_g_mm, a.angle_deg)).sum();
            Self { name, added_kg_m, rows }
        };
        SortedRun::all(readings).into_iter().map(with_weights).collect()
    }

    /// Its name, or what a file without runs is called.
    pub fn label(&self) -> &str {
        self.name.as_deref().unwrap_or("start-up")
    }

    /// The row measured nearest to a speed, and whether it is as near as the run's own steps allow.
    pub fn nearest(&self, readings: &[Reading], speed_rpm: f64) -> Option<usize> {
        let away = |row: &usize| (readings[*row].speed_rpm - speed_rpm).abs();
        let best = self.rows.iter().copied().min_by(|a, b| away(a).total_cmp(&away(b)))?;
        let steps = self.rows.windows(2).map(|w| readings[w[1]].speed_rpm - readings[w[0]].speed_rpm);
        let coarsest = steps.fold(1.0, f64::max);
        (away(&best) <= 0.51 * coarsest).then_some(best)
    }
}

/// A measured motion at one speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    pub speed_rad_s: f64,
    pub motion_m: C,
    /// Standard deviation of each component, m.
    pub sigma_m: f64,
}

/// A run along a direction, by ascending speed; lost readings left out.
pub fn series(readings: &[Reading], noise: &Noise, run: &RunUp, direction: &ProbeDirection) -> Vec<Point> {
    let point = |row: &usize| {
        let reading = &readings[*row];
        Some(Point {
            speed_rad_s: reading.speed_rad_s(),
            motion_m: direction.motion_m(&reading.probes)?,
            sigma_m: direction.sigma_m(&reading.probes, noise),
        })
    };
    run.rows.iter().filter_map(point).collect()
}
