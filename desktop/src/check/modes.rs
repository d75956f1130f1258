//! Damped modes of a machine that turns: eigenvalues, shapes, sense of whirl.
//!
//! The eigenvalues of the state matrix are where the modes begin; each is then an inverse iteration in the
//! quadratic problem `T(λ) q = 0` itself (`newton`), which gives the shape, sheds what rounding in the larger state matrix left, and
//! follows a mode from one speed to the next.

use nalgebra::{Complex, DMatrix, DVector};

use crate::bearing::support::Dampers;
use crate::check::system::{System, SystemMatrices};
use crate::decomposition::eigen::{
    DefinitePencil, Eigenpair, MatrixFunction, NewtonLimits, newton, quadratic,
};
use crate::error::Error;
use crate::model::chain::eigenpair;

type C = Complex<f64>;

/// Newton's method on the quadratic problem, from any shape to the last digits.
const NEWTON: NewtonLimits = NewtonLimits { settled: 1e-13, farthest: f64::INFINITY, near: false };
/// A root whose imaginary part is a smaller share of it than this does not oscillate.
const OSCILLATES: f64 = 1e-6;
/// Growth or decay below this share of the eigenvalue is rounding.
const ROUNDING: f64 = 1e-9;
/// A mode that decays by less than this a radian needs more than 160,000 turns at its critical speed to build up the
/// amplitude of its peak, which is then of no machine.
const BUILDS_UP: f64 = 1e-6;
/// Log decrement of a damping ratio of 1/√2, from which on a mode has no resonance peak.
pub const STRONG_LOG_DECREMENT: f64 = std::f64::consts::TAU;
/// Two roots that differ by less than this are one, of which every mixture of the two shapes is a mode.
const ONE_ROOT: f64 = 1e-8;
/// Stations that move less than this share of the largest do not speak for the sense of whirl.
const MOVES: f64 = 0.05;
/// Orbits narrower than this (minor over major axis) have no sense.
const ROUND: f64 = 1e-6;

/// Sense in which the shaft runs through its orbits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Whirl {
    /// With the rotation everywhere.
    Forward,
    /// Against it everywhere.
    Backward,
    /// Forward at some places and backward at others, to and fro on a line, or of a shaft at rest.
    Mixed,
}

impl Whirl {
    pub fn name(self) -> &'static str {
        match self {
            Self::Forward => "forward",
            Self::Backward => "backward",
            Self::Mixed => "mixed",
        }
    }
}

/// A damped mode at a speed.
#[derive(Debug, Clone)]
pub struct Mode {
    pub speed_rad_s: f64,
    /// `λ = σ + iω`: the motion goes as `Re(q e^{λt})`, rad/s.
    pub eigenvalue: C,
    /// Motion of each station in x, the largest displacement of all being 1.
    pub x: Vec<C>,
    pub y: Vec<C>,
    pub whirl: Whirl,
    coordinates: DVector<C>,
}

impl Mode {
    /// Damped natural frequency, rad/s.
    pub fn frequency_rad_s(&self) -> f64 {
        self.eigenvalue.im
    }

    /// Logarithm of the ratio of successive amplitudes, `−2πσ/ω`; negative for a mode that grows, zero for an undamped
    /// one.
    pub fn log_decrement(&self) -> f64 {
        if self.is_undamped() {
            return 0.0;
        }
        -std::f64::consts::TAU * self.eigenvalue.re / self.eigenvalue.im
    }

    /// Whether its growth or decay is rounding.
    pub fn is_undamped(&self) -> bool {
        self.eigenvalue.re.abs() <= ROUNDING * self.eigenvalue.norm()
    }

    pub fn grows(&self) -> bool {
        self.eigenvalue.re > ROUNDING * self.eigenvalue.norm()
    }

    /// Whether it can have a resonance peak.
    pub fn can_resonate(&self) -> bool {
        self.log_decrement() < STRONG_LOG_DECREMENT
    }

    /// Whether a forced peak at it has an amplitude that the model can state.
    pub fn has_amplitude(&self) -> bool {
        self.eigenvalue.re.abs() >= BUILDS_UP * self.eigenvalue.norm()
    }

    /// Share of its motion that turns with the rotation, by displacement: unbalance excites no other.
    pub fn forward_share(&self) -> f64 {
        let i = C::new(0.0, 1.0);
        let part =
            |sign: f64| self.x.iter().zip(&self.y).map(|(x, y)| (x + i * sign * y).norm_sqr()).sum::<f64>();
        let (forward, backward) = (part(1.0), part(-1.0));
        forward / (forward + backward)
    }
}

/// Roots of the machine at a speed.
#[derive(Debug, Clone)]
pub struct Roots {
    /// Those that oscillate, by rising frequency.
    pub modes: Vec<Mode>,
    /// Those that do not, as rates of growth (negative: decay), the slowest first, rad/s.
    pub real_rad_s: Vec<f64>,
}

/// Every oscillating mode up to a frequency and at least the `fewest` lowest, by rising frequency.
///
/// # Errors
/// If the eigenvalues do not converge.
pub fn modes(
    system: &System,
    speed_rad_s: f64,
    highest_rad_s: f64,
    fewest: usize,
) -> Result<Vec<Mode>, Error> {
    roots(system, speed_rad_s, highest_rad_s, fewest).map(|found| found.modes)
}

/// The same with the real roots up to that rate.
///
/// # Errors
/// As [`modes`].
pub fn roots(system: &System, speed_rad_s: f64, highest_rad_s: f64, fewest: usize) -> Result<Roots, Error> {
    let matrices = system.at(speed_rad_s);
    let all = quadratic(&matrices.damping, &matrices.stiffness).unwrap_or_default();
    let (mut oscillating, mut real_rad_s) = (Vec::new(), Vec::new());
    // a shaft that nothing holds has roots at zero, which come out as the root of what rounding leaves
    let zero = OSCILLATES * matrices.stiffness.amax().sqrt();
    for v in all {
        if v.im > OSCILLATES * v.norm() {
            oscillating.push(v);
        } else if v.im.abs() <= OSCILLATES * v.norm() && (zero..=highest_rad_s).contains(&v.norm()) {
            real_rad_s.push(v.re);
        }
    }
    oscillating.sort_by(|a, b| a.im.total_cmp(&b.im));
    real_rad_s.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let many = oscillating.partition_point(|v| v.im <= highest_rad_s).max(fewest.min(oscillating.len()));
    let found = oscillating[..many].iter().enumerate().map(|(i, root)| {
        // each begins elsewhere, or two modes of one eigenvalue would come out as the same
        let start = DVector::from_fn(system.size(), |k, _| {
            let turn = 1.0 + (k * (2 * i + 3)) as f64;
            C::new(turn.sin(), (1.7 * turn).cos())
        });
        nearest(&matrices, *root, &start)
            .map(|(value, shape)| mode(system, speed_rad_s, value, shape))
            .ok_or_else(|| Error::ModesNotConverged { speed_rpm: crate::units::rpm(speed_rad_s) })
    });
    let mut modes: Vec<Mode> = found.collect::<Result<_, _>>()?;
    for i in 1..modes.len() {
        if let Some([one, other]) = by_sense(system, &modes[i - 1], &modes[i]) {
            (modes[i - 1], modes[i]) = (one, other);
        }
    }
    Ok(Roots { modes, real_rad_s })
}

/// Two modes of one root as the mixtures that turn backward and forward, where there are such; `None` for two roots.
fn by_sense(system: &System, a: &Mode, b: &Mode) -> Option<[Mode; 2]> {
    if (a.eigenvalue - b.eigenvalue).norm() > ONE_ROOT * a.eigenvalue.norm() {
        return None;
    }
    let n = system.model.structure.size();
    let backward = |m: &Mode| {
        let q = &m.coordinates;
        DVector::from_fn(n, |k, _| q[k] - C::new(0.0, 1.0) * q[n + k])
    };
    let whole = |m: &Mode| m.coordinates.rows(0, 2 * n).into_owned();
    let gram = |of: &dyn Fn(&Mode) -> DVector<C>| {
        let both = [of(a), of(b)];
        DMatrix::from_fn(2, 2, |i, j| both[i].dotc(&both[j]))
    };
    // |x − iy|² is twice |x|² + |y|² where all motion is backward
    let pencil = DefinitePencil::new(&gram(&backward), &gram(&whole).cholesky()?.l());
    let [forward, backward] = *pencil.ascending() else { return None };
    let pure = pencil.values[forward] < ROUNDING.sqrt() && pencil.values[backward] > 2.0 - ROUNDING.sqrt();
    pure.then(|| {
        [backward, forward].map(|number| {
            let share = pencil.vector(number);
            let coordinates = &a.coordinates * share[0] + &b.coordinates * share[1];
            mode(system, a.speed_rad_s, a.eigenvalue, coordinates)
        })
    })
}

/// The same mode at another speed near by; `None` where it cannot be followed.
pub fn follow(system: &System, from: &Mode, speed_rad_s: f64) -> Option<Mode> {
    let (value, shape) = nearest(&system.at(speed_rad_s), from.eigenvalue, &from.coordinates)?;
    Some(mode(system, speed_rad_s, value, shape))
}

/// How much two modes are one shape: 1 for the same, 0 for orthogonal ones.
pub fn likeness(a: &Mode, b: &Mode) -> f64 {
    a.coordinates.dotc(&b.coordinates).norm_sqr()
        / (a.coordinates.norm_squared() * b.coordinates.norm_squared())
}

impl MatrixFunction for SystemMatrices {
    fn slope(&self, lambda: C, v: &DVector<C>) -> DVector<C> {
        self.damping.map(C::from) * v + v * (lambda * 2.0)
    }

    fn solve(&self, lambda: C, f: &DVector<C>) -> Option<DVector<C>> {
        self.dynamic_stiffness(lambda).lu().solve(f)
    }
}

/// The eigenpair next to a guess.
fn nearest(matrices: &SystemMatrices, guess: C, start: &DVector<C>) -> Option<(C, DVector<C>)> {
    let Eigenpair { value, vector, .. } = newton(matrices, guess, start, &NEWTON)?;
    let residual = (matrices.dynamic_stiffness(value) * &vector).norm();
    // what rounding leaves of the stiffest part
    let rounding = 1e-12 * matrices.stiffness.amax();
    let found = residual < 1e-7 * value.norm_sqr() + rounding && (value - guess).norm() < 0.5 * guess.norm();
    found.then_some((value, vector))
}

/// A mode of the reduced system, made exact on all finite elements.
fn mode(system: &System, speed_rad_s: f64, found: C, coordinates: DVector<C>) -> Mode {
    let nodes = system.nodes(&coordinates);
    let exact = system.chain().and_then(|chain| {
        let at = |lambda: C| chain.at(lambda, speed_rad_s, Dampers::In);
        eigenpair(at, found, &nodes)
    });
    let (eigenvalue, nodes) = exact.unwrap_or((found, nodes));
    let (mut x, mut y): (Vec<C>, Vec<C>) = nodes.iter().map(|v| (v[0], v[2])).unzip();
    let largest =
        x.iter().chain(&y).copied().fold(C::from(0.0), |a, b| if b.norm() > a.norm() { b } else { a });
    if largest != C::from(0.0) {
        x.iter_mut().chain(&mut y).for_each(|v| *v /= largest);
    }
    let whirl = if speed_rad_s == 0.0 { Whirl::Mixed } else { sense(&x, &y) };
    Mode { speed_rad_s, eigenvalue, x, y, whirl, coordinates }
}

/// Twice the area of the orbit over the square of its size: 1 round and forward, −1 round and backward.
pub fn roundness(x: C, y: C) -> f64 {
    // Re(e^{iωt}) and Re(−i e^{iωt}) are cos and sin: with the rotation, which takes x into y
    2.0 * (x * y.conj()).im / (x.norm_sqr() + y.norm_sqr()).max(f64::MIN_POSITIVE)
}

fn sense(x: &[C], y: &[C]) -> Whirl {
    let size = |(x, y): (&C, &C)| (x.norm_sqr() + y.norm_sqr()).sqrt();
    let largest = x.iter().zip(y).map(size).fold(0.0, f64::max);
    let turns: Vec<f64> =
        x.iter().zip(y).filter(|at| size(*at) > MOVES * largest).map(|(x, y)| roundness(*x, *y)).collect();
    match () {
        () if turns.iter().all(|t| *t > ROUND) => Whirl::Forward,
        () if turns.iter().all(|t| *t < -ROUND) => Whirl::Backward,
        () => Whirl::Mixed,
    }
}
