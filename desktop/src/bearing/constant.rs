//! A bearing with eight coefficients, the same at every speed or learned over speed.

use nalgebra::Matrix2;
use serde::{Deserialize, Serialize};

use super::curve::Curve;
use super::dynamic_coefficients::DynamicCoefficients;
use super::law::{BearingLaw, COLUMNS, LawUnknown, PRIOR_LOG_SD, Role, STIFFEST_N_M, role, unit, within};
use super::support::SupportLaw;
use crate::statistics::scale::Scale;

/// Damping that a file states as zero is searched from this loss: `c = this · k` (a logarithm needs a number).
const LEAST_LOSS: f64 = 1e-6;
/// What a coefficient that is learned over speed may change per unit of `ln Ω`, relative to the direct ones at the
/// reference: between a stiffness that does not follow speed and a damping that falls with it (short bearing at
/// constant eccentricity: `c ∝ 1/Ω`).
const SLOPE_SD: f64 = 0.7;
/// And per unit of its square: a power of the speed with slope s, `1 + s L + s² L²/2 + …`, has half the square of it.
const CURVATURE_SD: f64 = 0.5 * SLOPE_SD * SLOPE_SD;

/// A 2×2 matrix of bearing coefficients; `xy` is the force in x per motion in y.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Coefficients {
    pub xx: f64,
    pub yy: f64,
    #[serde(default)]
    pub xy: f64,
    #[serde(default)]
    pub yx: f64,
}

impl Coefficients {
    /// Rows x, y; columns x, y.
    pub fn matrix(&self) -> Matrix2<f64> {
        Matrix2::new(self.xx, self.xy, self.yx, self.yy)
    }

    /// From rows x, y; columns x, y.
    pub fn of(m: &Matrix2<f64>) -> Self {
        Self { xx: m.m11, yy: m.m22, xy: m.m12, yx: m.m21 }
    }

    fn crosses(&self) -> bool {
        self.xy != 0.0 || self.yx != 0.0
    }

    /// Mean of the direct terms.
    fn direct(&self) -> f64 {
        0.5 * (self.xx + self.yy)
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Constant {
    pub stiffness_n_m: Coefficients,
    pub damping_n_s_m: Coefficients,
    /// Change with the logarithm of the speed, for a bearing whose coefficients follow it in a way nobody stated.
    pub learned: Option<SpeedTrend>,
}

/// How all eight coefficients change with the logarithm of the speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpeedTrend {
    /// Speed at which stiffness and damping are as stated, rpm.
    pub reference_rpm: f64,
    /// Change of the stiffness per unit of the speed's logarithm, N/m.
    #[serde(default)]
    pub stiffness_per_log_n_m: Coefficients,
    /// Change of the damping per unit of the speed's logarithm, N·s/m.
    #[serde(default)]
    pub damping_per_log_n_s_m: Coefficients,
    /// Change of the stiffness per unit of that logarithm's square, N/m.
    #[serde(default)]
    pub stiffness_per_log2_n_m: Coefficients,
    /// Change of the damping per unit of that logarithm's square, N·s/m.
    #[serde(default)]
    pub damping_per_log2_n_s_m: Coefficients,
}

impl SpeedTrend {
    fn reference_rad_s(&self) -> f64 {
        crate::units::rad_s(self.reference_rpm)
    }

    /// Change per unit of the logarithm, and of its square.
    fn terms(&self) -> [DynamicCoefficients; 2] {
        let pair = |k: &Coefficients, c: &Coefficients| DynamicCoefficients {
            stiffness: k.matrix(),
            damping: c.matrix(),
        };
        [
            pair(&self.stiffness_per_log_n_m, &self.damping_per_log_n_s_m),
            pair(&self.stiffness_per_log2_n_m, &self.damping_per_log2_n_s_m),
        ]
    }

    fn with_terms(self, [first, second]: [DynamicCoefficients; 2]) -> Self {
        Self {
            stiffness_per_log_n_m: Coefficients::of(&first.stiffness),
            damping_per_log_n_s_m: Coefficients::of(&first.damping),
            stiffness_per_log2_n_m: Coefficients::of(&second.stiffness),
            damping_per_log2_n_s_m: Coefficients::of(&second.damping),
            ..self
        }
    }
}

impl Constant {
    fn pair(&self) -> DynamicCoefficients {
        DynamicCoefficients { stiffness: self.stiffness_n_m.matrix(), damping: self.damping_n_s_m.matrix() }
    }

    /// What unknowns of a column are measured in: the mean direct term, a loss of one millionth at least.
    fn unit(&self, column: usize) -> f64 {
        let stiffness = self.stiffness_n_m.direct();
        if column < 4 { stiffness } else { self.damping_n_s_m.direct().max(LEAST_LOSS * stiffness) }
    }

    /// Standard deviation of a cross-coupled term, in units of the direct ones. A file that states such terms states
    /// them as well as the direct ones; one that states none, or some that rounding of the direct ones hides, says that there are
    /// none, unless they are to be learned.
    fn cross_sd(&self, column: usize) -> f64 {
        let of = if column < 4 { &self.stiffness_n_m } else { &self.damping_n_s_m };
        let stated = PRIOR_LOG_SD * of.xy.abs().max(of.yx.abs()) / self.unit(column);
        match self.learned {
            Some(_) => stated.max(PRIOR_LOG_SD),
            None if stated > f64::EPSILON => stated,
            None => 0.0,
        }
    }

    /// Columns that data may decide.
    fn open(&self) -> impl Iterator<Item = usize> {
        let this = *self;
        (0..COLUMNS.len()).filter(move |c| COLUMNS[*c].1 || this.cross_sd(*c) > 0.0)
    }

    /// The coefficients, and how they are learned over speed, at these search coordinates.
    fn at(&self, x: &[f64]) -> (DynamicCoefficients, Option<SpeedTrend>) {
        let mut pair = self.pair();
        let mut values = x.iter();
        for column in self.open() {
            let Some(x) = values.next() else { continue };
            pair.set_column(column, self.scale(column).to_si(*x));
        }
        let learned = self.learned.map(|learned| {
            let mut terms = learned.terms();
            let places = (0..terms.len()).flat_map(|t| (0..COLUMNS.len()).map(move |column| (t, column)));
            for ((term, column), x) in places.zip(values) {
                terms[term].set_column(column, x * self.unit(column));
            }
            learned.with_terms(terms)
        });
        (pair, learned)
    }

    fn scale(&self, column: usize) -> Scale {
        if COLUMNS[column].1 { Scale::Logarithmic } else { Scale::Linear(self.unit(column)) }
    }
}

/// The support of these coefficients, learned over speed or not.
fn over_speed(at: DynamicCoefficients, learned: Option<SpeedTrend>) -> SupportLaw {
    let Some(learned) = learned else { return SupportLaw::linear(at.stiffness, at.damping) };
    let [first, second] = learned.terms();
    let curve = Curve::Logarithmic { terms: [at, first, second], reference_rad_s: learned.reference_rad_s() };
    SupportLaw { curve: Some(curve), ..SupportLaw::linear(Matrix2::zeros(), Matrix2::zeros()) }
}

impl BearingLaw for Constant {
    fn unknowns(&self) -> Vec<LawUnknown> {
        let pair = self.pair();
        let own = self.open().map(|column| {
            let (symbol, direct) = COLUMNS[column];
            let (value, scale) = (pair.column(column), self.scale(column));
            let least = if direct && column >= 4 { LEAST_LOSS * pair.column(column - 4) } else { f64::MIN };
            LawUnknown {
                symbol: symbol.into(),
                unit: unit(column),
                role: role(column),
                scale,
                stated: scale.from_si(value.max(least)),
                prior_sd: if direct { PRIOR_LOG_SD } else { self.cross_sd(column) },
            }
        });
        let mut all: Vec<LawUnknown> = own.collect();
        let terms = self.learned.iter().flat_map(SpeedTrend::terms);
        for (pair, (per, prior_sd)) in
            terms.zip([("per ln speed", SLOPE_SD), ("per ln² speed", CURVATURE_SD)])
        {
            all.extend((0..COLUMNS.len()).map(|column| {
                let scale = Scale::Linear(self.unit(column));
                LawUnknown {
                    symbol: format!("{} {per}", COLUMNS[column].0),
                    unit: unit(column),
                    role: Role::Other,
                    scale,
                    stated: scale.from_si(pair.column(column)),
                    prior_sd,
                }
            }));
        }
        all
    }

    fn support(&self, x: &[f64]) -> SupportLaw {
        let (at, learned) = self.at(x);
        over_speed(at, learned)
    }

    fn drawn(&self) -> SupportLaw {
        over_speed(self.pair(), self.learned)
    }

    fn assign(&mut self, x: &[f64]) {
        let (pair, learned) = self.at(x);
        self.stiffness_n_m = Coefficients::of(&pair.stiffness);
        self.damping_n_s_m = Coefficients::of(&pair.damping);
        self.learned = learned;
    }

    fn check(&self) -> Result<(), (String, String)> {
        for (name, m, [low, high], unit) in [
            ("stiffness_n_m", &self.stiffness_n_m, [1.0, STIFFEST_N_M], "N/m"),
            ("damping_n_s_m", &self.damping_n_s_m, [0.0, 1e10], "N·s/m"),
        ] {
            within(&format!("{name}.xx"), m.xx, [low, high], unit)?;
            within(&format!("{name}.yy"), m.yy, [low, high], unit)?;
            within(&format!("{name}.xy"), m.xy, [-STIFFEST_N_M, STIFFEST_N_M], "")?;
            within(&format!("{name}.yx"), m.yx, [-STIFFEST_N_M, STIFFEST_N_M], "")?;
        }
        let Some(learned) = &self.learned else { return Ok(()) };
        within("learned.reference_rpm", learned.reference_rpm, [1.0, 1e6], "rpm")?;
        for (name, m) in [
            ("stiffness_per_log_n_m", &learned.stiffness_per_log_n_m),
            ("damping_per_log_n_s_m", &learned.damping_per_log_n_s_m),
            ("stiffness_per_log2_n_m", &learned.stiffness_per_log2_n_m),
            ("damping_per_log2_n_s_m", &learned.damping_per_log2_n_s_m),
        ] {
            for (entry, value) in [("xx", m.xx), ("yy", m.yy), ("xy", m.xy), ("yx", m.yx)] {
                within(&format!("learned.{name}.{entry}"), value, [-STIFFEST_N_M, STIFFEST_N_M], "")?;
            }
        }
        Ok(())
    }

    fn opens_cross_terms(&self) -> bool {
        self.learned.is_some() || self.stiffness_n_m.crosses()
    }

    fn follows_speed(&self) -> bool {
        self.learned.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stated(law: &Constant) -> Vec<f64> {
        law.unknowns().iter().map(|u| u.stated).collect()
    }

    fn film() -> Constant {
        Constant {
            stiffness_n_m: Coefficients { xx: 2e8, yy: 3e8, xy: 1e8, yx: -1.5e8 },
            damping_n_s_m: Coefficients { xx: 4e5, yy: 6e5, xy: -1e5, yx: -1e5 },
            learned: Some(SpeedTrend {
                reference_rpm: 6000.0,
                stiffness_per_log_n_m: Coefficients { xx: 1e7, yy: -2e7, xy: 3e7, yx: -4e7 },
                damping_per_log_n_s_m: Coefficients { xx: -2e5, yy: -3e5, xy: 1e4, yx: 2e4 },
                stiffness_per_log2_n_m: Coefficients { xx: 4e6, yy: 3e6, xy: 2e6, yx: 1e6 },
                damping_per_log2_n_s_m: Coefficients { xx: 5e4, yy: 4e4, xy: 3e3, yx: 2e3 },
            }),
        }
    }

    #[test]
    fn free_coefficients_are_direct_only_without_cross_terms() {
        let direct = |k: f64| Coefficients { xx: k, yy: 2.0 * k, ..Coefficients::default() };
        let plain = Constant { stiffness_n_m: direct(1e7), damping_n_s_m: direct(1e3), learned: None };
        let symbols = |law: &Constant| law.unknowns().into_iter().map(|u| u.symbol).collect::<Vec<_>>();
        assert_eq!(symbols(&plain), ["k_xx", "k_yy", "c_xx", "c_yy"]);
        assert_eq!(symbols(&Constant { learned: None, ..film() }).len(), 8);
        assert_eq!(symbols(&film()).len(), 24);
    }

    #[test]
    fn cross_terms_below_rounding_of_direct_terms_stay_fixed() {
        let with = |yx: f64| Constant {
            stiffness_n_m: Coefficients { xx: 1e7, yy: 1e7, xy: 0.0, yx },
            damping_n_s_m: Coefficients { xx: 1e3, yy: 1e3, ..Coefficients::default() },
            learned: None,
        };
        assert_eq!(with(1e-300).unknowns().len(), 4);
        let seen = with(1.0).unknowns();
        assert_eq!(seen.len(), 6);
        assert!(seen.iter().all(|u| u.prior_sd.powi(-2).is_finite()));
    }

    #[test]
    fn support_at_stated_values_equals_file_at_every_speed() {
        for law in [film(), Constant { learned: None, ..film() }] {
            for speed in [300.0, 628.0, 1100.0] {
                let at = law.support(&stated(&law)).coefficients(speed);
                let log = (speed / (200.0 * std::f64::consts::PI)).ln();
                let log = law.learned.map_or(0.0, |_| log);
                assert!((at.stiffness.m12 - (1e8 + 3e7 * log + 2e6 * log * log)).abs() < 1.0);
                assert!((at.damping.m22 - (6e5 - 3e5 * log + 4e4 * log * log)).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn what_is_assigned_is_what_the_support_had() {
        let mut law = film();
        let x: Vec<f64> = stated(&law).iter().enumerate().map(|(i, v)| v + 0.1 * (i as f64).sin()).collect();
        let before = law.support(&x).coefficients(777.0);
        law.assign(&x);
        let after = law.coefficients(777.0);
        assert!((before.stiffness - after.stiffness).norm() < 1e-9 * before.stiffness.norm());
        assert!((before.damping - after.damping).norm() < 1e-9 * before.damping.norm());
    }

    #[test]
    fn undamped_bearing_is_drawn_undamped_and_searched_damped() {
        let direct = |k: f64| Coefficients { xx: k, yy: k, ..Coefficients::default() };
        let law = Constant { stiffness_n_m: direct(1e7), damping_n_s_m: direct(0.0), learned: None };
        assert_eq!(law.drawn().damping_n_s_m, Matrix2::zeros());
        assert!((law.support(&stated(&law)).damping_n_s_m.m11 - 10.0).abs() < 1e-9);
    }
}
