//! A bearing whose eight coefficients are stated over speed.

use std::sync::Arc;

use nalgebra::Matrix2;
use serde::{Deserialize, Serialize};

use super::curve::{Curve, Interpolation, Knots};
use super::dynamic_coefficients::DynamicCoefficients;
use super::law::{BearingLaw, COLUMNS, LawUnknown, PRIOR_LOG_SD, STIFFEST_N_M, role, within};
use super::support::SupportLaw;
use crate::statistics::scale::Scale;

/// Coefficients at one speed, as a file states them: N/m and N·s/m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableRow {
    pub speed_rpm: f64,
    /// Stiffness, force in x per motion in x, N/m.
    pub kxx: f64,
    /// Force in x per motion in y.
    #[serde(default)]
    pub kxy: f64,
    /// Force in y per motion in x.
    #[serde(default)]
    pub kyx: f64,
    /// Force in y per motion in y.
    pub kyy: f64,
    /// Damping, force in x per velocity in x, N·s/m.
    pub cxx: f64,
    /// Force in x per velocity in y.
    #[serde(default)]
    pub cxy: f64,
    /// Force in y per velocity in x.
    #[serde(default)]
    pub cyx: f64,
    /// Force in y per velocity in y.
    pub cyy: f64,
}

impl TableRow {
    fn pair(&self) -> DynamicCoefficients {
        DynamicCoefficients {
            stiffness: Matrix2::new(self.kxx, self.kxy, self.kyx, self.kyy),
            damping: Matrix2::new(self.cxx, self.cxy, self.cyx, self.cyy),
        }
    }

    /// The coefficients of a law at one speed.
    pub fn of(speed_rpm: f64, pair: &DynamicCoefficients) -> Self {
        let (k, c) = (&pair.stiffness, &pair.damping);
        Self {
            speed_rpm,
            kxx: k.m11,
            kxy: k.m12,
            kyx: k.m21,
            kyy: k.m22,
            cxx: c.m11,
            cxy: c.m12,
            cyx: c.m21,
            cyy: c.m22,
        }
    }

    /// Whether it may come after this row.
    pub(crate) fn follows(&self, before: &Self) -> Result<(), String> {
        if self.speed_rpm > before.speed_rpm {
            return Ok(());
        }
        Err(format!(
            "the speeds of a table must ascend, {} rpm is followed by {} rpm",
            before.speed_rpm, self.speed_rpm
        ))
    }

    /// The column that no bearing can have, and what is wrong with it.
    pub(crate) fn check(&self) -> Result<(), (String, String)> {
        within("speed_rpm", self.speed_rpm, [0.0, 1e6], "rpm")?;
        within("cxx", self.cxx, [0.0, 1e10], "N·s/m")?;
        within("cyy", self.cyy, [0.0, 1e10], "N·s/m")?;
        for (name, value) in [("kxx", self.kxx), ("kxy", self.kxy), ("kyx", self.kyx), ("kyy", self.kyy)] {
            within(name, value, [-STIFFEST_N_M, STIFFEST_N_M], "N/m")?;
        }
        for (name, value) in [("cxy", self.cxy), ("cyx", self.cyx)] {
            within(name, value, [-1e10, 1e10], "N·s/m")?;
        }
        Ok(())
    }

    fn speed_rad_s(&self) -> f64 {
        crate::units::rad_s(self.speed_rpm)
    }
}

/// Coefficients over speed; monotone between the rows, as at the nearest row outside of them.
#[derive(Debug, Clone, PartialEq)]
pub struct CoefficientTable {
    rows: Vec<TableRow>,
    knots: Arc<Knots>,
}

impl CoefficientTable {
    /// From its rows, which [`BearingLaw::check`] judges.
    ///
    /// # Errors
    /// If there are fewer than two, or their speeds do not ascend: then nothing lies between them.
    pub fn new(rows: Vec<TableRow>) -> Result<Self, String> {
        if rows.len() < 2 {
            return Err(format!("a table needs two speeds at least, {} given", rows.len()));
        }
        for pair in rows.windows(2) {
            pair[1].follows(&pair[0])?;
        }
        let speeds = rows.iter().map(TableRow::speed_rad_s).collect();
        let knots = Knots::new(speeds, rows.iter().map(TableRow::pair).collect(), Interpolation::Monotone);
        Ok(Self { rows, knots: Arc::new(knots) })
    }

    pub fn rows(&self) -> &[TableRow] {
        &self.rows
    }

    /// Whether anything of a column is stated.
    fn is_stated(&self, column: usize) -> bool {
        self.rows.iter().any(|r| r.pair().column(column) != 0.0)
    }

    fn open(&self) -> impl Iterator<Item = usize> {
        (0..COLUMNS.len()).filter(|c| self.is_stated(*c))
    }

    fn factors(&self, x: &[f64]) -> DynamicCoefficients {
        let mut factors = DynamicCoefficients::ones();
        for (column, x) in self.open().zip(x) {
            factors.set_column(column, scale(column).to_si(*x));
        }
        factors
    }
}

/// A factor on a direct column stays positive.
fn scale(column: usize) -> Scale {
    if COLUMNS[column].1 { Scale::Logarithmic } else { Scale::Linear(1.0) }
}

impl BearingLaw for CoefficientTable {
    fn unknowns(&self) -> Vec<LawUnknown> {
        let unknown = |column: usize| LawUnknown {
            symbol: format!("factor on {}", COLUMNS[column].0),
            unit: "",
            role: role(column),
            scale: scale(column),
            stated: scale(column).from_si(1.0),
            prior_sd: PRIOR_LOG_SD,
        };
        self.open().map(unknown).collect()
    }

    fn support(&self, x: &[f64]) -> SupportLaw {
        let curve = Curve::Knots { knots: self.knots.clone(), factors: self.factors(x) };
        SupportLaw { curve: Some(curve), ..SupportLaw::linear(Matrix2::zeros(), Matrix2::zeros()) }
    }

    fn assign(&mut self, x: &[f64]) {
        let curve = Curve::Knots { knots: self.knots.clone(), factors: self.factors(x) };
        let row = |r: &TableRow| TableRow::of(r.speed_rpm, &curve.at(r.speed_rad_s()));
        let rows: Vec<TableRow> = self.rows.iter().map(row).collect();
        let values = rows.iter().map(TableRow::pair).collect();
        self.knots =
            Arc::new(Knots::new(self.knots.speeds_rad_s().to_vec(), values, Interpolation::Monotone));
        self.rows = rows;
    }

    fn check(&self) -> Result<(), (String, String)> {
        for (i, r) in self.rows.iter().enumerate() {
            r.check().map_err(|(column, what)| (format!("table row {} {column}", i + 1), what))?;
        }
        Ok(())
    }

    fn opens_cross_terms(&self) -> bool {
        (1..3).any(|column| self.is_stated(column))
    }

    fn follows_speed(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(speed_rpm: f64) -> TableRow {
        let k = 1e7 * (1.0 + speed_rpm / 5000.0);
        TableRow {
            speed_rpm,
            kxx: k,
            kxy: 0.4 * k,
            kyx: -k,
            kyy: 2.0 * k,
            cxx: 1e5,
            cxy: 0.0,
            cyx: 0.0,
            cyy: 2e5,
        }
    }

    #[test]
    fn single_or_non_ascending_speeds_are_refused() {
        assert!(CoefficientTable::new(vec![row(1000.0)]).unwrap_err().contains("1 given"));
        let wrong = CoefficientTable::new(vec![row(1000.0), row(3000.0), row(2000.0)]).unwrap_err();
        assert!(wrong.contains("3000 rpm is followed by 2000 rpm"), "{wrong}");
        assert!(CoefficientTable::new(vec![row(1000.0), row(1000.0)]).is_err());
    }

    #[test]
    fn direct_stiffness_may_be_negative_but_not_endless() {
        let with = |kxx: f64| {
            CoefficientTable::new(vec![row(1000.0), TableRow { kxx, ..row(2000.0) }]).unwrap().check()
        };
        assert_eq!(with(-1.1 * row(2000.0).kyy), Ok(()), "a film across its load, a seal, a magnet");
        assert_eq!(with(-2.0 * STIFFEST_N_M).unwrap_err().0, "table row 2 kxx");
    }

    #[test]
    fn a_factor_acts_on_its_column_at_every_speed_and_is_taken_over() {
        let mut table = CoefficientTable::new(vec![row(1000.0), row(2500.0), row(6000.0)]).unwrap();
        let symbols: Vec<String> = table.unknowns().into_iter().map(|u| u.symbol).collect();
        assert_eq!(symbols.len(), 6, "columns that are zero stay zero: {symbols:?}");
        let speed = 400.0;
        let plain = table.coefficients(speed);
        let x = [0.2, 1.5, 1.0, -0.3, 0.1, 0.0];
        let changed = table.support(&x).coefficients(speed);
        assert!((changed.stiffness.m11 / plain.stiffness.m11 - 0.2_f64.exp()).abs() < 1e-12);
        assert!((changed.stiffness.m12 / plain.stiffness.m12 - 1.5).abs() < 1e-12);
        assert!((changed.damping.m11 / plain.damping.m11 - 0.1_f64.exp()).abs() < 1e-12);
        table.assign(&x);
        assert!(
            (table.coefficients(speed).stiffness - changed.stiffness).norm()
                < 1e-6 * changed.stiffness.norm()
        );
    }
}
