//! Influence coefficients as they are kept for a machine, so that one run is enough the next time.

use std::path::Path;

use nalgebra::{Complex, DMatrix};
use serde::{Deserialize, Serialize};

use super::runs::Means;
use super::weight_unit::WeightUnit;
use super::{Basis, CorrectionRequest, MachineInfluence, doubts};
use crate::balance::influence::InfluenceCoefficients;
use crate::error::Error;
use crate::measurement::{ProbeRecord, component_sd, text_of};

type C = Complex<f64>;

const SCHEMA: u32 = 1;

/// A complex number as `[real, imaginary]`.
type Pair = [f64; 2];

/// InfluenceCoefficients of a machine, `coefficients.toml`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Library {
    schema: u32,
    /// Unit of vibration, zero to peak, as columns of measurements have it.
    pub unit: String,
    /// Names of the planes; coefficients are per g·mm, angles from the keyphasor mark with the rotation.
    pub planes: Vec<String>,
    /// Unit in which weights are stated; coefficients are per this unit where it is one of mass.
    #[serde(default = "usual_unit", skip_serializing_if = "is_usual_unit")]
    weight_unit: String,
    /// Files that they were made from.
    pub made_from: Vec<String>,
    /// Real values that the covariances rest on; none where the noise was stated or is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    values: Option<usize>,
    coefficient: Vec<LibraryEntry>,
}

fn usual_unit() -> String {
    WeightUnit::default().name.into()
}

fn is_usual_unit(unit: &String) -> bool {
    *unit == usual_unit()
}

/// InfluenceCoefficients of one probe at one speed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LibraryEntry {
    probe: String,
    speed_rpm: f64,
    /// Vibration per g·mm in each plane, as phasors cos − i sin.
    per_g_mm: Vec<Pair>,
    /// Their covariance per component; empty if it is not known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    covariance: Vec<Vec<Pair>>,
}

impl Library {
    /// Of a machine; `made_from` are the files behind it.
    pub fn of(machine: &MachineInfluence, made_from: Vec<String>) -> Self {
        let pair = |y: &C| [y.re, y.im];
        let planes = machine.planes.len();
        let kept = |c: &InfluenceCoefficients| {
            let row = |i: usize| (0..planes).map(|j| pair(&c.covariance[(i + 1, j + 1)])).collect();
            LibraryEntry {
                probe: machine.probes[c.probe].clone(),
                speed_rpm: c.speed_rpm,
                per_g_mm: c.per_weight.iter().map(pair).collect(),
                covariance: if machine.basis == Basis::Unknown {
                    vec![]
                } else {
                    (0..planes).map(row).collect()
                },
            }
        };
        Self {
            schema: SCHEMA,
            unit: machine.unit.clone(),
            planes: machine.planes.clone(),
            weight_unit: machine.weight_unit.name.into(),
            made_from,
            values: machine.basis.values(),
            coefficient: machine.coefficients.iter().map(kept).collect(),
        }
    }

    /// The text of the file.
    ///
    /// # Errors
    /// If a number cannot be written.
    pub fn text(&self) -> Result<String, Error> {
        toml::to_string(self).map_err(|e| Error::Unsuitable(e.to_string()))
    }

    /// Reads a file.
    ///
    /// # Errors
    /// One sentence with the file, the key and what was expected.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let (file, text) = text_of(path)?;
        Self::parse(&file, &text)
    }

    /// Parses the text of a file; `file` is for messages.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(file: &str, text: &str) -> Result<Self, Error> {
        let library: Self =
            toml::from_str(text).map_err(|e| Error::rotor(file, "coefficients", e.message()))?;
        let wrong = |key: &str, what: String| Err(Error::rotor(file, key, what));
        if library.schema != SCHEMA {
            return wrong("schema", format!("{}, expected {SCHEMA}", library.schema));
        }
        if WeightUnit::of(&library.weight_unit).is_none() {
            return wrong("weight_unit", format!("expected one of {}", WeightUnit::names()));
        }
        let planes = library.planes.len();
        for kept in &library.coefficient {
            let key = format!("[[coefficient]] of probe \"{}\" at {} rpm", kept.probe, kept.speed_rpm);
            let square = kept.covariance.iter().map(Vec::len).chain([kept.covariance.len()]);
            if kept.per_g_mm.len() != planes
                || !kept.covariance.is_empty() && square.clone().any(|n| n != planes)
            {
                return wrong(&key, format!("expected a coefficient for each of the {planes} planes"));
            }
            let numbers = kept.per_g_mm.iter().chain(kept.covariance.iter().flatten()).flatten();
            if !kept.speed_rpm.is_finite() || kept.speed_rpm <= 0.0 || numbers.clone().any(|v| !v.is_finite())
            {
                return wrong(&key, "expected a positive speed and finite numbers".into());
            }
        }
        match library.coefficient.is_empty() || planes == 0 {
            true => wrong("coefficient", "there is none, expected at least one".into()),
            false => Ok(library),
        }
    }

    /// The machine as measured now, by the coefficients that were kept of it.
    ///
    /// # Errors
    /// One sentence if probe, unit or speed of the measurement are not those of the coefficients.
    pub fn machine(
        &self,
        series: &ProbeRecord,
        request: &CorrectionRequest,
    ) -> Result<MachineInfluence, Error> {
        if series.unit != self.unit {
            return Err(Error::UnitMismatch { measured: series.unit.clone(), kept: self.unit.clone() });
        }
        let means = Means::of(&series.readings, series.probes.len(), request)?;
        let planes = request.planes_of(&self.planes)?;
        let sigma_um = |y: C, count: usize, level: f64| match (request.noise, means.within) {
            (Some([relative, floor]), _) => Some(component_sd(relative, floor, y) / (count as f64).sqrt()),
            (None, Some((variance, _))) => Some(level * (variance / count as f64).sqrt()),
            (None, None) => None,
        };
        let known = self.coefficient.iter().all(|k| !k.covariance.is_empty())
            && (request.noise.is_some() || means.within.is_some());
        let (mut coefficients, mut left_out) = (Vec::new(), Vec::new());
        for (speed, speed_rpm) in means.speeds.mean_rpm.iter().enumerate() {
            for (probe, name) in series.probes.iter().enumerate() {
                let Some((before, count)) = means.over_runs(speed, probe) else { continue };
                let off = |k: &LibraryEntry| (k.speed_rpm / speed_rpm - 1.0).abs();
                let of_probe = self.coefficient.iter().filter(|k| k.probe == *name);
                let Some(kept) = of_probe
                    .min_by(|a, b| off(a).total_cmp(&off(b)))
                    .filter(|k| off(k) <= request.same_speed)
                else {
                    left_out.push(format!("{name} at {speed_rpm:.0} rpm"));
                    continue;
                };
                let complex = |[re, im]: Pair| C::new(re, im);
                let size = 1 + planes.len();
                let mut covariance = DMatrix::zeros(size, size);
                if let (true, Some(sigma)) = (known, sigma_um(before, count, before.norm())) {
                    covariance[(0, 0)] = C::from(sigma * sigma);
                    for (i, a) in planes.iter().enumerate() {
                        for (j, b) in planes.iter().enumerate() {
                            covariance[(i + 1, j + 1)] = complex(kept.covariance[*a][*b]);
                        }
                    }
                }
                coefficients.push(InfluenceCoefficients {
                    probe,
                    speed_rpm: *speed_rpm,
                    before,
                    per_weight: planes.iter().map(|j| complex(kept.per_g_mm[*j])).collect(),
                    covariance,
                });
            }
        }
        if coefficients.is_empty() {
            return Err(Error::NoKeptSpeed { within: request.same_speed, known: self.what_there_is() });
        }
        let basis = match (known, self.values, means.within) {
            (false, ..) => Basis::Unknown,
            (true, Some(values), _) => Basis::Runs(values),
            (true, None, Some((_, values))) if request.noise.is_none() => Basis::Readings(values),
            (true, None, _) => Basis::Stated,
        };
        let mut told = vec![
            "The influence coefficients are from earlier runs: they hold only if the machine has not changed since."
                .to_string(),
        ];
        told.extend(doubts::of_basis(basis));
        if !left_out.is_empty() {
            told.push(format!("Left out, as there are no coefficients: {}.", left_out.join(", ")));
        }
        Ok(MachineInfluence {
            coefficients,
            probes: series.probes.clone(),
            planes: planes.iter().map(|j| self.planes[*j].clone()).collect(),
            sets: None,
            scatter: 0.0,
            unit: series.unit.clone(),
            weight_unit: WeightUnit::of(&self.weight_unit).unwrap_or_default(),
            basis,
            doubts: told,
        })
    }

    fn what_there_is(&self) -> String {
        const NAMED: usize = 4;
        let named = self.coefficient.iter().take(NAMED);
        let named: Vec<String> = named.map(|k| format!("{} at {:.0} rpm", k.probe, k.speed_rpm)).collect();
        let more = if self.coefficient.len() > NAMED { ", …" } else { "" };
        format!("{}{more}", named.join(", "))
    }
}
