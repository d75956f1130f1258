//! Undamped critical speeds: the speeds at which unbalance would meet no resistance if nothing were damped.
//!
//! What bearings dissipate is left out, and so is the part of their stiffness that does work on a closed orbit
//! (its antisymmetric part). Motion at running speed then obeys `(K + iΩ²G − Ω²M) q = 0`, a Hermitian pencil
//! `(M − iG) q = μ K q` with μ = 1/Ω²: every critical speed at once, where stiffness does not depend on speed.

use nalgebra::{Complex, DMatrix, DVector};

use crate::bearing::support::Dampers;
use crate::check::system::System;
use crate::decomposition::eigen::DefinitePencil;
use crate::model::chain::eigenpair;

type C = Complex<f64>;

/// A mode of which this share of the energy or less turns forward is not met by unbalance, which turns forward.
const EXCITED: f64 = 0.01;
/// Forward and backward whirl of one speed, as of a disk in the middle that does not tilt, are one critical speed:
/// their modes are any mixture of the two, and one of these turns forward altogether.
const ONE_ROOT: f64 = 1e-8;
/// Stiffnesses in the map, and the decades they span on either side of the bearings' own.
const STEPS: usize = 25;
const DECADES: f64 = 2.0;
const CURVES: usize = 4;
/// Speed-dependent bearings are met by this many rounds of the secant at most.
const ROUNDS: usize = 60;

/// An undamped critical speed.
#[derive(Debug, Clone, PartialEq)]
pub struct Critical {
    pub speed_rad_s: f64,
    /// Share of its mode that turns forward, by kinetic energy: 1 on bearings that are alike in all
    /// directions, about a half for motion to and fro.
    pub forward: f64,
}

/// One of the reduced system, with its shape.
struct CriticalMode {
    critical: Critical,
    /// Whether forward and backward whirl share the root.
    shared: bool,
    shape: DVector<C>,
}

impl CriticalMode {
    fn is_excited(&self) -> bool {
        self.critical.forward > EXCITED
    }

    fn is_one_root_with(&self, other: &Self) -> bool {
        let (own, others) = (self.critical.speed_rad_s, other.critical.speed_rad_s);
        (others - own).abs() < ONE_ROOT * own
    }
}

/// Forward critical speeds over the stiffness of all bearings, the same in both directions.
#[derive(Debug, Clone, PartialEq)]
pub struct CriticalMap {
    /// Stiffness of each bearing, N/m.
    pub stiffness_n_m: Vec<f64>,
    /// Critical speeds at each stiffness, ascending, rad/s.
    pub speed_rad_s: Vec<Vec<f64>>,
    /// Mean direct stiffness of the bearings as they are, N/m.
    pub own_n_m: f64,
}

/// Critical speeds of the machine on its own bearings that unbalance can excite, ascending, up to a speed and at
/// least `fewest`.
///
/// Where a bearing changes with speed, each is the speed at which the machine held as at this speed has it.
pub fn critical_speeds(system: &System, highest_rad_s: f64, fewest: usize) -> Vec<Critical> {
    let at = |speed_rad_s: f64| pencil(system, speed_rad_s);
    let mut found: Vec<CriticalMode> = Vec::new();
    // counted with those that unbalance does not excite: which these are changes with the speed bearings are held at
    for (order, guess) in at(highest_rad_s).iter().enumerate() {
        let Some(settled) = self_consistent(&at, order, guess) else { continue };
        if found.last().is_some_and(|last| last.is_one_root_with(&settled)) {
            continue;
        }
        let beyond = found.last().is_some_and(|last| last.critical.speed_rad_s > highest_rad_s);
        if beyond && found.iter().filter(|f| f.is_excited()).count() >= fewest {
            break;
        }
        found.push(settled);
    }
    let mut critical: Vec<Critical> =
        found.into_iter().filter(CriticalMode::is_excited).map(|f| exact(system, f)).collect();
    critical.sort_by(|a, b| a.speed_rad_s.total_cmp(&b.speed_rad_s));
    let within = critical.iter().filter(|c| c.speed_rad_s <= highest_rad_s).count();
    critical.truncate(within.max(fewest));
    critical
}

/// The `order`-th critical speed where the machine is held as at that very speed.
fn self_consistent(
    at: &impl Fn(f64) -> Vec<CriticalMode>,
    order: usize,
    guess: &CriticalMode,
) -> Option<CriticalMode> {
    let mut held = guess.critical.speed_rad_s;
    let mut last: Option<(f64, f64)> = None;
    for _ in 0..ROUNDS {
        let mut all = at(held);
        let now = all.get(order)?;
        let off = now.critical.speed_rad_s - held;
        if off.abs() < 1e-10 * held {
            let sharing = all.iter().filter(|f| f.is_one_root_with(now));
            let (count, forward) = sharing.fold((0, 0.0), |(n, sum), f| (n + 1, sum + f.critical.forward));
            let mut now = all.swap_remove(order);
            now.shared = count > 1;
            now.critical.forward = forward.min(1.0);
            return Some(now);
        }
        let next = match last {
            Some((before, off_before)) if (off - off_before).abs() > 0.0 => {
                held - off * (held - before) / (off - off_before)
            }
            _ => now.critical.speed_rad_s,
        };
        last = Some((held, off));
        held = if next > 0.2 * held && next < 5.0 * held { next } else { now.critical.speed_rad_s };
    }
    None
}

/// Refined on all finite elements; `found` unchanged where that fails.
fn exact(system: &System, found: CriticalMode) -> Critical {
    let on_line = system.chain().and_then(|chain| {
        // motion at running speed: λ = iΩ
        let at = |lambda: C| chain.at(lambda, lambda.im, Dampers::Out);
        let (lambda, nodes) =
            eigenpair(at, C::new(0.0, found.critical.speed_rad_s), &system.nodes(&found.shape))?;
        let forward = if found.shared { found.critical.forward } else { chain.forward_share(&nodes) };
        Some(Critical { speed_rad_s: lambda.im, forward })
    });
    on_line.unwrap_or(found.critical)
}

/// The map: each bearing replaced by one stiffness.
pub fn map(system: &System, speed_rad_s: f64) -> CriticalMap {
    let bearings: Vec<f64> = system
        .model
        .supports
        .iter()
        .map(|s| 0.5 * s.law.coefficients(speed_rad_s).stiffness.trace())
        .filter(|k| *k > 0.0)
        .collect();
    let own_n_m = (bearings.iter().map(|k| k.ln()).sum::<f64>() / bearings.len().max(1) as f64).exp();
    let stiffness_n_m: Vec<f64> = (0..STEPS)
        .map(|i| own_n_m * 10_f64.powf(DECADES * (2.0 * i as f64 / (STEPS - 1) as f64 - 1.0)))
        .collect();
    let curve = |k: &f64| forward(system, speed_rad_s, *k);
    CriticalMap { speed_rad_s: stiffness_n_m.iter().map(curve).collect(), stiffness_n_m, own_n_m }
}

/// Forward critical speeds of the shaft on isotropic bearings: the symmetric pencil `K − Ω² (M − G)`.
fn forward(system: &System, speed_rad_s: f64, stiffness_n_m: f64) -> Vec<f64> {
    let structure = &system.model.structure;
    let mut stiffness = structure.stiffness.clone();
    for s in &system.model.supports {
        let own = 0.5 * s.law.coefficients(speed_rad_s).stiffness.trace();
        let held = if own > 0.0 { stiffness_n_m } else { own };
        stiffness.ger(held, &s.shape, &s.shape, 1.0);
    }
    let n = structure.size();
    let inertia = DMatrix::<f64>::identity(n, n) - &structure.polar_inertia;
    let Some(factor) = stiffness.cholesky().map(|c| c.l()) else { return Vec::new() };
    let mu = DefinitePencil::new(&inertia, &factor).values;
    let mut speeds: Vec<f64> = mu.iter().filter(|mu| **mu > 0.0).map(|mu| mu.sqrt().recip()).collect();
    speeds.sort_by(f64::total_cmp);
    speeds.truncate(CURVES);
    speeds
}

/// Every critical speed of the machine held as at `speed_rad_s`, ascending.
fn pencil(system: &System, speed_rad_s: f64) -> Vec<CriticalMode> {
    let (n, size) = (system.model.structure.size(), system.size());
    let whole = system.at(speed_rad_s).stiffness;
    let stiffness = (&whole + whole.transpose()) * 0.5;
    let Some(factor) = stiffness.cholesky().map(|c| c.l().map(C::from)) else { return Vec::new() };
    let mut inertia = DMatrix::<C>::identity(size, size);
    let turning = system.model.structure.polar_inertia.map(|g| C::new(0.0, g));
    inertia.view_mut((0, n), (n, n)).copy_from(&-&turning);
    inertia.view_mut((n, 0), (n, n)).copy_from(&turning);
    let pencil = DefinitePencil::new(&inertia, &factor);
    let mut all: Vec<CriticalMode> = pencil
        .values
        .iter()
        .enumerate()
        .filter(|(_, mu)| **mu > 0.0)
        .map(|(k, mu)| {
            let q = pencil.vector(k);
            let critical = Critical { speed_rad_s: mu.sqrt().recip(), forward: forward_share(&q, n) };
            CriticalMode { critical, shared: false, shape: q }
        })
        .collect();
    all.sort_by(|a, b| a.critical.speed_rad_s.total_cmp(&b.critical.speed_rad_s));
    all
}

/// Share of `[x; y; …]`, n coordinates a plane, that turns with the rotation: y = −ix.
fn forward_share(q: &DVector<C>, n: usize) -> f64 {
    let i = C::new(0.0, 1.0);
    let part = |sign: f64| (0..n).map(|k| (q[k] + i * sign * q[n + k]).norm_sqr()).sum::<f64>();
    let (forward, backward) = (part(1.0), part(-1.0));
    forward / (forward + backward)
}
