//! Measured flexibility of a foundation over frequency, as an impact test gives it.

use nalgebra::{Complex, DMatrix};
use serde::{Deserialize, Serialize};

type C = Complex<f64>;

/// One frequency response: the motion of a foot per force on another, or on itself, at one frequency.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlexibilityRow {
    pub frequency_hz: f64,
    /// What moves: the bearing's name and a direction, as in `A.x`.
    pub response: String,
    /// Where the force acts, written like `response`.
    pub force: String,
    /// In phase with the force, m/N.
    pub real_m_n: f64,
    /// Ahead of the force by a quarter of a turn, m/N: what is damped has it negative.
    pub imaginary_m_n: f64,
}

/// Flexibility between the feet of bearings, x and y of each in turn, over frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct FlexibilityTable {
    rad_s: Vec<f64>,
    flexibility_m_n: Vec<DMatrix<C>>,
}

impl FlexibilityTable {
    /// From its rows, in any order, for these bearings. What was measured one way is taken the other way too (Maxwell); what
    /// was measured neither way is rigid.
    ///
    /// # Errors
    /// The number of the row, from 1, and what is wrong with it; row 0 is all of them.
    pub fn new(rows: &[FlexibilityRow], bearings: &[String]) -> Result<Self, (usize, String)> {
        let place = |name: &str| {
            let (bearing, axis) = name.rsplit_once('.')?;
            let foot = bearings.iter().position(|b| b == bearing)?;
            Some(2 * foot + ["x", "y"].iter().position(|a| *a == axis)?)
        };
        let mut frequencies: Vec<f64> = rows.iter().map(|r| r.frequency_hz).collect();
        frequencies.sort_by(f64::total_cmp);
        frequencies.dedup();
        let size = 2 * bearings.len();
        let mut measured: Vec<DMatrix<Option<C>>> =
            frequencies.iter().map(|_| DMatrix::from_element(size, size, None)).collect();
        for (i, row) in rows.iter().enumerate() {
            let wrong = |what: String| (i + 1, what);
            if !(row.frequency_hz > 0.0
                && [row.frequency_hz, row.real_m_n, row.imaginary_m_n].iter().all(|v| v.is_finite()))
            {
                return Err(wrong("expected a positive frequency_hz, real_m_n and imaginary_m_n".into()));
            }
            let at = |name: &str| {
                place(name).ok_or_else(|| {
                    wrong(format!("\"{name}\" is no foot; expected a bearing's name with .x or .y"))
                })
            };
            let (to, from) = (at(&row.response)?, at(&row.force)?);
            let k = frequencies.iter().position(|f| *f == row.frequency_hz).unwrap_or(0);
            if measured[k][(to, from)].replace(C::new(row.real_m_n, row.imaginary_m_n)).is_some() {
                let what =
                    format!("{} per {} at {} Hz is given twice", row.response, row.force, row.frequency_hz);
                return Err(wrong(what));
            }
        }
        if frequencies.len() < 2 {
            return Err((0, format!("two frequencies are needed at least, {} given", frequencies.len())));
        }
        let both_ways = |m: &DMatrix<Option<C>>| {
            DMatrix::from_fn(size, size, |i, j| m[(i, j)].or(m[(j, i)]).unwrap_or_else(|| C::from(0.0)))
        };
        Ok(Self {
            rad_s: frequencies.iter().map(|f| std::f64::consts::TAU * f).collect(),
            flexibility_m_n: measured.iter().map(both_ways).collect(),
        })
    }

    /// At running speed: along a straight line between neighbouring frequencies, as at the nearest outside of them.
    pub fn at(&self, speed_rad_s: f64) -> DMatrix<C> {
        let above = self.rad_s.partition_point(|w| *w <= speed_rad_s).clamp(1, self.rad_s.len() - 1);
        let [from, to] = [above - 1, above].map(|k| self.rad_s[k]);
        let share = ((speed_rad_s - from) / (to - from)).clamp(0.0, 1.0);
        self.flexibility_m_n[above - 1].map(|v| v * (1.0 - share))
            + self.flexibility_m_n[above].map(|v| v * share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(frequency_hz: f64, response: &str, force: &str, real_m_n: f64) -> FlexibilityRow {
        FlexibilityRow {
            frequency_hz,
            response: response.into(),
            force: force.into(),
            real_m_n,
            imaginary_m_n: -1e-10,
        }
    }

    #[test]
    fn flexibility_between_frequencies_is_linear_and_symmetric() {
        let names = ["A".to_string(), "B".to_string()];
        let rows = [
            row(20.0, "A.y", "A.y", 4e-9),
            row(10.0, "A.y", "A.y", 2e-9),
            row(10.0, "B.y", "A.y", 1e-9),
            row(20.0, "B.y", "A.y", 1e-9),
        ];
        let table = FlexibilityTable::new(&rows, &names).unwrap();
        let at = |hz: f64| table.at(std::f64::consts::TAU * hz);
        for (hz, expected) in [(5.0, 2e-9), (10.0, 2e-9), (15.0, 3e-9), (20.0, 4e-9), (90.0, 4e-9)] {
            assert!((at(hz)[(1, 1)].re - expected).abs() < 1e-20, "{hz}");
        }
        assert_eq!(at(12.0)[(3, 1)], at(12.0)[(1, 3)]);
        assert_eq!(at(12.0)[(0, 0)], C::from(0.0));
    }

    #[test]
    fn rows_that_cannot_be_meant_are_told_by_number() {
        let names = ["A".to_string(), "B".to_string()];
        let refused = |rows: &[FlexibilityRow]| FlexibilityTable::new(rows, &names).unwrap_err();
        assert_eq!(refused(&[row(10.0, "A.y", "C.y", 1e-9)]).0, 1);
        assert_eq!(refused(&[row(10.0, "A.y", "A.y", 1e-9)]).0, 0);
        assert_eq!(refused(&[row(10.0, "A.y", "A.y", 1e-9), row(10.0, "A.y", "A.y", 1e-9)]).0, 2);
        assert_eq!(refused(&[row(f64::NAN, "A.y", "A.y", 1e-9)]).0, 1);
    }
}
