//! Where, in which whirl and at which speeds an effect changes the response.

use crate::units::rpm;
use nalgebra::Complex;

use super::base::{BaseModel, CandidateFit};

type C = Complex<f64>;

/// A share above this is "mostly".
const MOSTLY: f64 = 0.75;

/// Change of one value by the effect, in noise units.
struct ValueChange {
    speed_rad_s: f64,
    probe: usize,
    change: C,
    amplitude_m: f64,
}

/// A sentence on the change of the response by the effect.
pub fn describe(base: &BaseModel, tried: &CandidateFit) -> String {
    let rows =
        base.fitter.data.rows.iter().flat_map(|row| row.values.iter().map(move |v| (row.speed_rad_s, v)));
    let predictions = base.fit.predicted_m.iter().zip(&tried.fit.predicted_m);
    let changes: Vec<ValueChange> = rows
        .zip(predictions)
        .map(|((speed_rad_s, v), (before, after))| ValueChange {
            speed_rad_s,
            probe: v.probe,
            change: (after - before) / v.sigma_m,
            amplitude_m: v.measured_m.norm(),
        })
        .collect();
    let seen = ResponseChange { all: energy(&changes, |_| true).max(f64::MIN_POSITIVE), changes };
    format!(
        "it changes the response {}, {}, {}.",
        where_seen(base, &seen),
        over_speed(&seen),
        whirl(base, &seen.changes)
    )
}

struct ResponseChange {
    changes: Vec<ValueChange>,
    all: f64,
}

impl ResponseChange {
    /// Share of the energy of the changes that `keep` selects.
    fn share(&self, keep: impl Fn(&ValueChange) -> bool) -> f64 {
        energy(&self.changes, keep) / self.all
    }
}

fn energy(changes: &[ValueChange], keep: impl Fn(&ValueChange) -> bool) -> f64 {
    changes.iter().filter(|c| keep(c)).map(|c| c.change.norm_sqr()).sum()
}

fn where_seen(base: &BaseModel, seen: &ResponseChange) -> String {
    let rotor = base.fitter.rotor;
    let beside = |b: usize| move |c: &ValueChange| rotor.bearing_of(&rotor.probe[c.probe]) == Some(b);
    let shares: Vec<f64> = (0..rotor.bearing.len()).map(|b| seen.share(beside(b))).collect();
    let probes = (0..rotor.probe.len()).map(|p| seen.share(|c| c.probe == p));
    if let Some((p, share)) = probes.enumerate().find(|(_, share)| *share > MOSTLY) {
        return format!("mostly at probe {} ({:.0} %)", rotor.probe[p].name, 100.0 * share);
    }
    match shares.iter().position(|s| *s > MOSTLY) {
        Some(b) => format!("mostly at bearing {} ({:.0} %)", rotor.bearing[b].name, 100.0 * shares[b]),
        None => "at both bearings".into(),
    }
}

fn over_speed(seen: &ResponseChange) -> String {
    let changes = &seen.changes;
    let largest = changes.iter().max_by(|a, b| a.amplitude_m.total_cmp(&b.amplitude_m));
    let fastest = changes.iter().map(|c| c.speed_rad_s).fold(0.0, f64::max);
    if let Some(peak) = largest
        && seen.share(|c| (c.speed_rad_s / peak.speed_rad_s - 1.0).abs() < 0.12) > MOSTLY
    {
        return format!("only near the resonance at {:.0} rpm", rpm(peak.speed_rad_s));
    }
    let third = |k: f64| {
        seen.share(|c| c.speed_rad_s > fastest * (k - 1.0) / 3.0 && c.speed_rad_s <= fastest * k / 3.0)
    };
    let thirds = [third(1.0), third(2.0), third(3.0)];
    let strongest = changes.iter().max_by(|a, b| a.change.norm().total_cmp(&b.change.norm()));
    let at = strongest.map_or(0.0, |c| rpm(c.speed_rad_s));
    if thirds[2] > MOSTLY {
        format!("growing with speed, most at {at:.0} rpm")
    } else if thirds[0] > MOSTLY {
        format!("at low speed, most at {at:.0} rpm")
    } else {
        format!("over the whole range, most at {at:.0} rpm")
    }
}

/// Forward and backward parts of the change at each bearing's pair of probes.
fn whirl(base: &BaseModel, changes: &[ValueChange]) -> String {
    let rotor = base.fitter.rotor;
    let (mut forward, mut backward) = (0.0, 0.0);
    for pair in changes.windows(2) {
        let [a, b] = pair else { continue };
        let (p, q) = (&rotor.probe[a.probe], &rotor.probe[b.probe]);
        if a.speed_rad_s != b.speed_rad_s || p.bearing != q.bearing {
            continue;
        }
        // a probe at α sees f e^{−iα} + b e^{iα}
        let (alpha, beta) = (p.angle_deg.to_radians(), q.angle_deg.to_radians());
        let det = C::from_polar(1.0, beta - alpha) - C::from_polar(1.0, alpha - beta);
        if det.norm() < 0.1 {
            continue;
        }
        let f = (a.change * C::from_polar(1.0, beta) - b.change * C::from_polar(1.0, alpha)) / det;
        let g = (b.change * C::from_polar(1.0, -alpha) - a.change * C::from_polar(1.0, -beta)) / det;
        forward += f.norm_sqr();
        backward += g.norm_sqr();
    }
    let share = forward / (forward + backward).max(f64::MIN_POSITIVE);
    match share {
        s if s > MOSTLY => format!("mostly in forward whirl ({:.0} %)", 100.0 * s),
        s if s < 1.0 - MOSTLY => format!("mostly in backward whirl ({:.0} %)", 100.0 * (1.0 - s)),
        s => format!("in forward and backward whirl ({:.0} % forward)", 100.0 * s),
    }
}
