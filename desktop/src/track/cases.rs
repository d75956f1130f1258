//! The four cases of a re-identification (Bera et al., Machines 2023, 11, 976): which unknowns an event
//! may have changed, each fitted to the readings that raised the flag.
//!
//! | case | unknown |
//! |---|---|
//! | 1 | the suspect bearing's stiffness and damping |
//! | 2 | the same, and the unbalance of its plane |
//! | 3 | all bearings' stiffness and damping |
//! | 4 | everything |
//!
//! The paper takes the case of least residual, found by a swarm. Here each case is fitted to its optimum,
//! and a case that contains another never has a larger residual: case 4 would always win, although a few
//! days at one speed hold eight numbers and it has twelve unknowns. So a case with more unknowns has to
//! earn them: the winner is the least by Schwarz's criterion for exponentially distributed errors. Of n
//! features with the density `exp(−|r|/b)/2b` the likelihood is greatest at `b = e/n`, and minus twice its
//! logarithm is there `2n ln(2e/n) + 2n`; what differs between cases is `2n ln e`, and k unknowns cost
//! `k ln n` (Schwarz 1978, Annals of Statistics 6, 461). All four residuals are reported.

use nalgebra::{Complex, DMatrix, DVector};

use super::coefficients::Logs;
use super::record::Day;
use crate::bearing::law::Role;
use crate::fit::descent::{Objective, Stop, descend};
use crate::track::coefficients::FollowedNumber;

type C = Complex<f64>;

const STOP: Stop = Stop::after(60, 1e-8);
/// Factors on the stiffness and on the damping of the free bearings from which a search starts.
const STARTS: [[f64; 2]; 7] =
    [[1.0, 1.0], [0.6, 1.0], [1.7, 1.0], [1.0, 0.6], [1.0, 1.7], [0.5, 0.5], [2.0, 2.0]];

#[derive(Debug, Clone, PartialEq)]
pub struct CaseFit {
    /// 1 to 4.
    pub case: u8,
    /// Σ|calculated − measured| over the readings, µm.
    pub residual_um: f64,
    pub unknowns: usize,
    /// Logarithms of the bearing coefficients.
    pub logs: Logs,
    /// Unbalance of each plane, kg·m.
    pub unbalance_kg_m: Vec<C>,
    /// `2n ln e + k ln n`, e in µm.
    pub criterion: f64,
}

/// State before the event, from which every case starts.
pub struct BeforeEvent<'a> {
    pub numbers: &'a [FollowedNumber],
    pub logs: &'a [f64],
    pub unbalance_kg_m: &'a [C],
    pub suspect: usize,
    /// Plane of the suspect bearing.
    pub plane: usize,
}

/// All four cases on these readings.
pub fn fit_all(days: &[&Day], before: &BeforeEvent) -> Vec<CaseFit> {
    let planes = before.unbalance_kg_m.len();
    let count = before.logs.len();
    let own: Vec<usize> = (0..count).filter(|i| before.numbers[*i].bearing == before.suspect).collect();
    let every: Vec<usize> = (0..count).collect();
    let all: Vec<usize> = (0..planes).collect();
    let cases: [(u8, &[usize], &[usize]); 4] =
        [(1, &own, &[]), (2, &own, &[before.plane]), (3, &every, &[]), (4, &every, &all)];
    cases.iter().filter_map(|(case, logs, planes)| fit(*case, days, before, logs, planes)).collect()
}

fn fit(case: u8, days: &[&Day], before: &BeforeEvent, logs: &[usize], planes: &[usize]) -> Option<CaseFit> {
    let mut best: Option<(f64, DVector<f64>)> = None;
    let mut at = CaseMisfit { days, before, logs, planes, x: DVector::zeros(logs.len() + 2 * planes.len()) };
    for [stiffness, damping] in STARTS {
        let mut start = DVector::zeros(at.x.len());
        for (k, i) in logs.iter().enumerate() {
            let by = match before.numbers[*i].law.role {
                Role::Stiffness => stiffness,
                Role::Damping => damping,
                Role::Other => 1.0,
            };
            start[k] = by.ln();
        }
        at.move_to(&start);
        descend(&mut at, STOP);
        let value = at.value();
        if value.is_finite() && best.as_ref().is_none_or(|(least, _)| value < *least) {
            best = Some((value, at.x.clone()));
        }
    }
    at.move_to(&best?.1);
    let (logs_found, unbalance_kg_m) = at.state();
    let shown = |d: &&Day| {
        let y = d.point.on(&logs_found)?.at(&unbalance_kg_m);
        Some(y.iter().zip(d.all_m()).map(|(y, m)| (y - m).l1_norm() * 1e6).sum::<f64>())
    };
    let residual_um = days.iter().map(shown).sum::<Option<f64>>()?;
    let values: usize = days.iter().map(|d| 2 * d.measured_m.len()).sum();
    let unknowns = at.x.len();
    let criterion = criterion(residual_um, values, unknowns);
    Some(CaseFit { case, residual_um, unknowns, logs: logs_found, unbalance_kg_m, criterion })
}

/// Schwarz's criterion but for what depends on the number of features alone.
fn criterion(residual_um: f64, features: usize, unknowns: usize) -> f64 {
    let n = features as f64;
    2.0 * n * residual_um.ln() + unknowns as f64 * n.ln()
}

/// Squared misfit in noise units with the weak prior on bearings; unknowns are changes of logarithms, then
/// of the planes' unbalance relative to the larger plane's.
struct CaseMisfit<'a> {
    days: &'a [&'a Day],
    before: &'a BeforeEvent<'a>,
    logs: &'a [usize],
    planes: &'a [usize],
    x: DVector<f64>,
}

impl CaseMisfit<'_> {
    fn unit_kg_m(&self) -> f64 {
        self.before.unbalance_kg_m.iter().map(|u| u.norm()).fold(f64::MIN_POSITIVE, f64::max)
    }

    fn prior_sd(&self, number: usize) -> f64 {
        self.before.numbers[number].law.prior_sd
    }

    fn state(&self) -> (Logs, Vec<C>) {
        let (mut logs, mut unbalance) = (self.before.logs.to_vec(), self.before.unbalance_kg_m.to_vec());
        for (k, i) in self.logs.iter().enumerate() {
            logs[*i] += self.x[k];
        }
        for (k, j) in self.planes.iter().enumerate() {
            let at = self.logs.len() + 2 * k;
            unbalance[*j] += C::new(self.x[at], self.x[at + 1]) * self.unit_kg_m();
        }
        (logs, unbalance)
    }

    /// Weighted residuals of one day, and their slopes if wanted.
    fn day(&self, day: &Day, with_slopes: bool) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let (logs, unbalance) = self.state();
        let motion = day.point.on(&logs)?;
        let shown = motion.at(&unbalance);
        let count = shown.len();
        let measured = day.all_m();
        let mut residual = DVector::zeros(2 * count);
        let mut jacobian = DMatrix::zeros(2 * count, if with_slopes { self.x.len() } else { 0 });
        for p in 0..count {
            let left = (shown[p] - measured[p]) / day.sigma_m[p];
            (residual[2 * p], residual[2 * p + 1]) = (left.re, left.im);
        }
        if with_slopes {
            let slopes = day.point.slopes(&logs, &motion, &unbalance);
            for p in 0..count {
                let mut set = |column: usize, y: C| {
                    let y = y / day.sigma_m[p];
                    (jacobian[(2 * p, column)], jacobian[(2 * p + 1, column)]) = (y.re, y.im);
                };
                for (k, i) in self.logs.iter().enumerate() {
                    set(k, slopes[(p, *i)]);
                }
                for (k, j) in self.planes.iter().enumerate() {
                    let per = motion.probes[j * count + p] * self.unit_kg_m();
                    set(self.logs.len() + 2 * k, per);
                    set(self.logs.len() + 2 * k + 1, C::i() * per);
                }
            }
        }
        Some((residual, jacobian))
    }
}

impl Objective for CaseMisfit<'_> {
    fn position(&self) -> DVector<f64> {
        self.x.clone()
    }

    fn move_to(&mut self, x: &DVector<f64>) {
        self.x = x.clone();
    }

    fn value(&self) -> f64 {
        let prior: f64 = self.logs.iter().zip(&self.x).map(|(i, x)| (x / self.prior_sd(*i)).powi(2)).sum();
        let misfit =
            self.days.iter().map(|d| Some(self.day(d, false)?.0.norm_squared())).sum::<Option<f64>>();
        misfit.map_or(f64::INFINITY, |misfit| misfit + prior)
    }

    fn normal_equations(&mut self) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let n = self.x.len();
        let (mut gram, mut slope) = (DMatrix::zeros(n, n), DVector::zeros(n));
        for day in self.days {
            let (residual, jacobian) = self.day(day, true)?;
            gram += jacobian.tr_mul(&jacobian);
            slope += jacobian.tr_mul(&residual);
        }
        for (k, i) in self.logs.iter().enumerate() {
            gram[(k, k)] += self.prior_sd(*i).powi(-2);
            slope[k] += self.x[k] * self.prior_sd(*i).powi(-2);
        }
        Some((gram, slope))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{Continuous, Laplace};

    #[test]
    fn criterion_ranks_as_maximum_laplace_likelihood() {
        // Schwarz's criterion of residuals, by the density at the best of many widths
        let by_density = |residuals_um: &[f64], unknowns: f64| {
            let minus_log = |width: f64| {
                let density = Laplace::new(0.0, width).unwrap();
                -residuals_um.iter().map(|r| density.ln_pdf(*r)).sum::<f64>()
            };
            let least = (1..4000).map(|k| minus_log(1e-3 * f64::from(k))).fold(f64::INFINITY, f64::min);
            2.0 * least + unknowns * (residuals_um.len() as f64).ln()
        };
        let residuals = |size: f64| -> Vec<f64> {
            (0..24).map(|k| size * (f64::from(k) * 1.7).sin() * (1.0 + f64::from(k % 5))).collect()
        };
        let [few, many] = [(residuals(0.8), 4), (residuals(0.5), 12)];
        let sum = |r: &[f64]| r.iter().map(|r| r.abs()).sum::<f64>();
        let ours = criterion(sum(&many.0), 24, many.1) - criterion(sum(&few.0), 24, few.1);
        let theirs = by_density(&many.0, 12.0) - by_density(&few.0, 4.0);
        assert!((ours - theirs).abs() < 1e-3, "{ours} {theirs}");
    }
}
