//! Does the residual at one speed know that at the next?

use nalgebra::Complex;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

use super::ratio;
use crate::machine::drawing::Rotor;
use crate::measurement::SortedRun;

/// Lag-one correlation of the standardised residuals of neighbouring speeds.
///
/// `r = Σ Re(ē_k e_{k+1}) / Σ |e_k|²`. For white Gaussian noise of any size its mean is 0 and its
/// variance `P / (N (N + 2))`, with N real values in P real pairs: 1/N, but for the ends.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Neighbours {
    /// Over all runs and probes.
    pub correlation: f64,
    /// The same over its standard deviation under noise.
    pub z_score: f64,
    /// Chance that noise alone makes a correlation this large.
    pub p_value: f64,
    pub series: Vec<SeriesNeighbours>,
}

/// The correlation in one run at one probe.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SeriesNeighbours {
    /// The run, if the measurement names them.
    pub run: Option<String>,
    pub probe: String,
    /// Lag-one correlation.
    pub correlation: f64,
    /// The same over its standard deviation under noise.
    pub z_score: f64,
}

impl Neighbours {
    pub(super) fn new(rotor: &Rotor, standardised: &[Vec<Option<Complex<f64>>>], runs: &[SortedRun]) -> Self {
        let mut all = Products::default();
        let mut series = Vec::new();
        for run in runs {
            for (i, probe) in rotor.probe.iter().enumerate() {
                let values: Vec<_> = run.rows.iter().filter_map(|row| standardised[*row][i]).collect();
                let products = Products::of(&values);
                series.push(SeriesNeighbours {
                    run: run.name.clone(),
                    probe: probe.name.clone(),
                    correlation: products.correlation(),
                    z_score: products.z_score(),
                });
                all.add(&products);
            }
        }
        let z_score = all.z_score();
        Self { correlation: all.correlation(), z_score, p_value: Normal::standard().sf(z_score), series }
    }
}

/// What the correlation is made of.
#[derive(Default)]
struct Products {
    lagged: f64,
    squares: f64,
    values: usize,
    pairs: usize,
}

impl Products {
    fn of(e: &[Complex<f64>]) -> Self {
        Self {
            lagged: e.windows(2).map(|w| (w[0].conj() * w[1]).re).sum(),
            squares: e.iter().map(|e| e.norm_sqr()).sum(),
            values: 2 * e.len(),
            pairs: 2 * e.len().saturating_sub(1),
        }
    }

    fn add(&mut self, other: &Self) {
        self.lagged += other.lagged;
        self.squares += other.squares;
        self.values += other.values;
        self.pairs += other.pairs;
    }

    fn correlation(&self) -> f64 {
        ratio(self.lagged, self.squares)
    }

    fn z_score(&self) -> f64 {
        let n = self.values as f64;
        self.correlation() * ratio(n * (n + 2.0), self.pairs as f64).sqrt()
    }
}
