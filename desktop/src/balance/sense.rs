//! Whether phases were entered as lag instead of lead: then the runs fit the conjugate of the readings.
//!
//! With as many runs as unknowns both fit, and with every weight at one angle or its opposite both fit alike. Only further
//! weights at other angles tell.

use nalgebra::{Complex, DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::error::Error;

type C = Complex<f64>;

/// Chance below which runs that agree so much better turned round do so for a reason.
pub(super) const CHANCE: f64 = 5e-3;
/// A probe is suspect if turning it round leaves less than this of its squares.
const BETTER: f64 = 0.25;
/// Weights that the conjugate design cannot follow by so much, relative, tell the two apart.
const TELLS: f64 = 0.05;

/// Squares that one probe's readings leave, as stated and turned round.
#[derive(Debug, Clone, Copy, Default)]
struct ProbeResiduals {
    stated: f64,
    turned: f64,
    squares: f64,
    /// Complex values beyond the unknowns.
    freedom: usize,
}

/// A run that contradicts the others where phases are turned round, of so many that were left out in turn.
#[derive(Debug, Clone)]
pub(super) struct ReversedWithRun {
    pub run: String,
    pub tried: usize,
}

/// Evidence of every probe, over all speeds.
#[derive(Debug, Clone)]
pub struct PhaseSense {
    left: Vec<ProbeResiduals>,
}

impl PhaseSense {
    /// Nothing known of so many probes.
    pub(super) fn new(probes: usize) -> Self {
        Self { left: vec![ProbeResiduals::default(); probes] }
    }

    /// Adds the runs of one probe at one speed: design and readings, both in standard deviations of the readings.
    pub(super) fn add(&mut self, probe: usize, design: &DMatrix<C>, measured: &DVector<C>) {
        let freedom = design.nrows() - design.ncols();
        let beyond = |of: &DMatrix<C>| {
            let basis = design.clone().qr().q();
            of - &basis * (basis.adjoint() * of)
        };
        let conjugate = design.map(|d| d.conj());
        if freedom == 0 || beyond(&conjugate).norm() < TELLS * conjugate.norm() {
            return;
        }
        let squares =
            |of: &DVector<C>| beyond(&DMatrix::from_column_slice(of.len(), 1, of.as_slice())).norm_squared();
        let left = &mut self.left[probe];
        left.stated += squares(measured);
        left.turned += squares(&measured.map(|y| y.conj()));
        left.squares += measured.norm_squared();
        left.freedom += freedom;
    }

    /// Whether the runs could tell.
    pub fn tells(&self) -> bool {
        self.left.iter().any(|left| left.freedom > 0)
    }

    /// Squares that the turned readings of all probes leave, and complex values beyond the unknowns.
    pub(super) fn turned(&self) -> (f64, usize) {
        (self.left.iter().map(|l| l.turned).sum(), self.left.iter().map(|l| l.freedom).sum())
    }

    /// The evidence of some runs as stated and of others, or the same, turned round.
    pub(super) fn of_both(stated: &Self, turned: &Self) -> Self {
        let both = |(s, t): (&ProbeResiduals, &ProbeResiduals)| ProbeResiduals {
            stated: s.stated * t.freedom as f64 / s.freedom.max(1) as f64,
            freedom: t.freedom,
            ..*t
        };
        Self { left: stated.left.iter().zip(&turned.left).map(both).collect() }
    }

    /// Refuses phases that are reversed; `names` are those of the probes, and `without` is the run that was left out of the turned
    /// readings.
    ///
    /// # Errors
    /// One sentence with the probes that are.
    pub(super) fn check(&self, names: &[String], without: Option<&ReversedWithRun>) -> Result<(), Error> {
        let all = self.left.iter().enumerate().filter(|(_, l)| l.freedom > 0);
        let suspects: Vec<usize> =
            all.filter(|(_, l)| l.turned < BETTER * l.stated).map(|(probe, _)| probe).collect();
        let sum =
            suspects.iter().map(|p| self.left[*p]).fold(ProbeResiduals::default(), |a, b| ProbeResiduals {
                stated: a.stated + b.stated,
                turned: a.turned + b.turned,
                squares: a.squares + b.squares,
                freedom: a.freedom + b.freedom,
            });
        let values = 2.0 * sum.freedom as f64;
        let ratio = sum.stated / sum.turned.max(f64::MIN_POSITIVE);
        let chance = FisherSnedecor::new(values, values).map_or(1.0, |f| f.sf(ratio.min(1e12)));
        let tried = without.map_or(1, |w| w.tried) as f64;
        // rounding alone favours neither
        if suspects.is_empty() || tried * chance > CHANCE || sum.stated < 1e-12 * sum.squares {
            return Ok(());
        }
        let told = self.left.iter().filter(|l| l.freedom > 0).count();
        let whose = match suspects.len() {
            n if n == told => "all probes".to_string(),
            _ => suspects.iter().map(|p| names[*p].as_str()).collect::<Vec<_>>().join(", "),
        };
        let percent = |squares: f64| 100.0 * (squares / sum.squares).sqrt();
        let (left_out, check) = without.map_or_else(Default::default, |w| {
            (
                format!(" without the run \"{}\"", w.run),
                format!(
                    "; the run \"{}\" contradicts the others also then, so check its weight and its readings",
                    w.run
                ),
            )
        });
        Err(Error::ReversedPhases(format!(
            "the phases of {whose} are reversed, lag entered as lead: the runs differ by {:.1} % of the vibration as stated, and by \
             {:.1} % with reversed phases{left_out}; change the sign of the _sin_ columns, or check the direction of rotation{check}",
            percent(sum.stated),
            percent(sum.turned)
        )))
    }
}
