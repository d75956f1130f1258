//! Answers of `balance`, with a rotor's file and without.

use nalgebra::Complex;
use rotor_edge_desktop::balance::alone::weight_unit::WeightUnit;
use rotor_edge_desktop::balance::alone::{Basis, Correction, PlaneWeight, ProbeVibration};
use rotor_edge_desktop::balance::optimum::Criterion;
use rotor_edge_desktop::balance::places::{Filling, WeightPiece};
use rotor_edge_desktop::balance::{Balanced, SpeedVibration};
use rotor_edge_desktop::interval::{HALF_95, interval_95, size_and_angle_95};
use rotor_edge_desktop::unbalance::{G_MM, g_mm_deg, static_and_dynamic};
use serde::Serialize;

use super::shared::ZERO_TO_PEAK;
use crate::scale::four_digits;

/// A way whose misfit noise reaches less often than this is not relied on.
pub const LEAST_CHANCE: f64 = 1e-3;

/// An unbalance and where it is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct VectorAnswer {
    pub magnitude_g_mm: f64,
    pub angle_deg: f64,
}

/// A weight as it is put in.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PieceAnswer {
    /// None where weights are masses whose radius is not stated.
    pub magnitude_g_mm: Option<f64>,
    /// In the unit of the weights.
    pub magnitude: f64,
    pub angle_deg: f64,
    pub hole: Option<usize>,
    pub mass_g: Option<f64>,
    pub radius_mm: Option<f64>,
    /// The same as a phasor, with the rotation.
    #[serde(skip)]
    pub unbalance_g_mm: Complex<f64>,
}

/// A weight to add, wanted and as it can be placed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WeightAnswer {
    pub plane: String,
    pub unbalance_g_mm: f64,
    pub sd_g_mm: f64,
    pub angle_deg: f64,
    pub angle_sd_deg: f64,
    /// Least and most, g·mm; it holds where ``model_adequate``.
    pub interval_95: [f64; 2],
    /// The angle is known to so much either way.
    pub angle_95_deg: f64,
    /// Of one piece; None where a weight is split, or no radius is known.
    pub mass_g: Option<f64>,
    pub radius_mm: Option<f64>,
    pub placed_g_mm: f64,
    pub placed: Vec<PieceAnswer>,
}

/// Root mean square over probes and speeds, µm zero to peak.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VibrationAnswer {
    pub before: f64,
    pub after: f64,
    pub after_sd: f64,
    /// Least and most with the weights; it holds where ``model_adequate``.
    pub after_interval_95: [f64; 2],
    pub reduction: f64,
}

/// The same at a speed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VibrationAtSpeed {
    pub speed_rpm: f64,
    pub before_um: f64,
    pub after_um: f64,
    pub after_sd_um: f64,
}

/// Balance quality grade of ISO 21940-11, mm/s.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GradeAnswer {
    pub before: f64,
    pub after: f64,
    pub after_at_most: f64,
}

/// Weights by one way: the identified model, or trial runs alone.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WayAnswer {
    pub by: &'static str,
    pub weights: Vec<WeightAnswer>,
    pub vibration_um: VibrationAnswer,
    pub by_speed: Vec<VibrationAtSpeed>,
    pub grade_mm_s: GradeAnswer,
    pub chi2_per_value: Option<f64>,
    pub chance: Option<f64>,
    /// Whether noise explains the misfit; if not, no interval holds.
    pub model_adequate: bool,
}

/// Correction weights of a machine that has a file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BalanceAnswer {
    /// In which direction they count.
    pub angles: &'static str,
    pub range_rpm: [f64; 2],
    pub service_rpm: f64,
    /// What lengths in µm of the motion are: zero to peak.
    pub amplitude_convention: &'static str,
    pub ways: Vec<WayAnswer>,
    pub remarks: Vec<String>,
}

/// The weight of a plane; intervals in g·mm and degrees either way.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrialWeight {
    pub plane: String,
    /// None where weights are masses whose radius is not stated, as ``interval_95`` then is.
    pub magnitude_g_mm: Option<f64>,
    /// In the unit of the weights.
    pub magnitude: f64,
    pub magnitude_interval_95: Option<[f64; 2]>,
    pub angle_deg: f64,
    pub interval_95: Option<[f64; 2]>,
    pub angle_95_deg: Option<f64>,
    pub placed: Vec<PieceAnswer>,
    pub text: String,
    /// As a phasor, with the rotation.
    #[serde(skip)]
    pub wanted_g_mm: Complex<f64>,
}

/// Vibration of a probe at a speed; without a unit in the name it is in the unit of the data.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftAnswer {
    pub probe: String,
    pub speed_rpm: f64,
    pub before_um: Option<f64>,
    pub after_um: Option<f64>,
    pub after_at_most_um: Option<f64>,
    pub before: f64,
    pub after: f64,
    pub after_at_most: Option<f64>,
}

/// Static part and couple of the weights of two planes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StaticCouple {
    #[serde(rename = "static")]
    pub static_unbalance: VectorAnswer,
    pub couple: VectorAnswer,
}

/// Correction weights of a machine that has no file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrialBalance {
    pub angles: &'static str,
    pub unit: String,
    /// What amplitudes are: zero to peak.
    pub amplitude_convention: &'static str,
    pub criterion: &'static str,
    /// Unit of the weights, as the file of trial weights states it.
    pub weight_unit: &'static str,
    pub onto: Option<String>,
    pub noise: &'static str,
    pub weights: Vec<TrialWeight>,
    pub static_couple: Option<StaticCouple>,
    pub left: Vec<LeftAnswer>,
    pub doubts: Vec<String>,
    #[serde(skip)]
    pub sense: AngleSense,
    /// Whether the influence coefficients are those of earlier runs.
    #[serde(skip)]
    pub by_kept_coefficients: bool,
    /// g·mm of one unit of the weights.
    #[serde(skip)]
    pub weight_scale: f64,
    /// Real values that the noise was estimated from, if it was.
    #[serde(skip)]
    pub noise_values: Option<usize>,
}

/// The sense in which angles count from the keyphasor mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AngleSense {
    WithRotation,
    AgainstRotation,
}

impl AngleSense {
    pub fn of(is_against_rotation: bool) -> Self {
        if is_against_rotation { Self::AgainstRotation } else { Self::WithRotation }
    }

    pub fn words(self) -> &'static str {
        match self {
            Self::WithRotation => "with the rotation",
            Self::AgainstRotation => "against the rotation",
        }
    }

    /// An angle of this sense, degrees from 0 to 360, from one with the rotation.
    fn degrees(self, with_deg: f64) -> f64 {
        let angle_deg = if self == Self::AgainstRotation { -with_deg } else { with_deg };
        // an angle of −1e-15 is 0, not 360
        (angle_deg.rem_euclid(360.0) * 1e9).round() / 1e9 % 360.0
    }

    /// The angle of a phasor.
    pub fn angle_deg(self, unbalance: Complex<f64>) -> f64 {
        self.degrees(unbalance.arg().to_degrees())
    }
}

impl PieceAnswer {
    fn all(filling: &Filling, sense: AngleSense, unit: WeightUnit) -> Vec<Self> {
        let one = |p: &WeightPiece| Self {
            magnitude_g_mm: (!unit.is_mass()).then_some(p.unbalance_g_mm.norm()),
            magnitude: p.unbalance_g_mm.norm() / unit.scale(),
            angle_deg: sense.angle_deg(p.unbalance_g_mm),
            hole: p.hole,
            mass_g: p.mass_and_radius.map(|[mass_g, _]| mass_g),
            radius_mm: p.mass_and_radius.map(|[_, radius_mm]| radius_mm),
            unbalance_g_mm: p.unbalance_g_mm,
        };
        filling.pieces.iter().map(one).collect()
    }

    /// The piece and its place, for whoever puts it in.
    fn words(&self, sense: AngleSense, unit: WeightUnit) -> String {
        let size = match self.mass_g.zip(self.radius_mm) {
            Some((mass_g, radius_mm)) => format!("{} g at {radius_mm} mm", plain(mass_g)),
            None => format!("{} {}", plain(self.magnitude), unit.symbol),
        };
        let hole = self.hole.map_or(String::new(), |hole| format!(" in hole {hole}"));
        format!("{size}{hole}, at {:.0}° {}", self.angle_deg, sense.words())
    }
}

/// What to do in a plane, in one line.
fn instruction(plane: &str, placed: &[PieceAnswer], sense: AngleSense, unit: WeightUnit) -> String {
    let kept = placed.iter().filter(|p| p.unbalance_g_mm.norm() > 0.0);
    let pieces: Vec<String> = kept.map(|p| p.words(sense, unit)).collect();
    match pieces.is_empty() {
        true => format!("{plane}: add nothing."),
        false => format!("{plane}: add {}.", pieces.join(", and ")),
    }
}

/// Four significant digits without zeros at the end.
fn plain(value: f64) -> String {
    let text = four_digits(value);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').into(),
        false => text,
    }
}

impl WayAnswer {
    /// The weights of a way into `planes`, and what they do.
    pub fn of(by: &'static str, found: &Balanced, planes: &[String], sense: AngleSense) -> Self {
        let weight = |(((wanted, filling), sd), plane): (((&Complex<f64>, &Filling), &f64), &String)| {
            let [unbalance_g_mm, with_deg] = g_mm_deg(*wanted);
            let sd_g_mm = sd * G_MM;
            let (interval_95, angle_95_deg) = size_and_angle_95(unbalance_g_mm, HALF_95 * sd_g_mm);
            let placed = PieceAnswer::all(filling, sense, WeightUnit::default());
            let one = if let [one] = &placed[..] { Some(one) } else { None };
            WeightAnswer {
                plane: plane.clone(),
                unbalance_g_mm,
                sd_g_mm,
                angle_deg: sense.degrees(with_deg),
                angle_sd_deg: (sd_g_mm / unbalance_g_mm).atan().to_degrees(),
                interval_95,
                angle_95_deg,
                mass_g: one.and_then(|one| one.mass_g),
                radius_mm: one.and_then(|one| one.radius_mm),
                placed_g_mm: filling.sum_g_mm().norm(),
                placed,
            }
        };
        let at_speed = |v: &SpeedVibration| VibrationAtSpeed {
            speed_rpm: v.speed_rpm,
            before_um: v.before_m * 1e6,
            after_um: v.after_m * 1e6,
            after_sd_um: v.after_sd_m * 1e6,
        };
        let weights = found.wanted_kg_m.iter().zip(&found.placed).zip(&found.sd_kg_m).zip(planes);
        Self {
            by,
            weights: weights.map(weight).collect(),
            vibration_um: VibrationAnswer {
                before: found.overall.before_m * 1e6,
                after: found.overall.after_m * 1e6,
                after_sd: found.overall.after_sd_m * 1e6,
                after_interval_95: interval_95(found.overall.after_m * 1e6, found.overall.after_sd_m * 1e6)
                    .map(|end| end.max(0.0)),
                reduction: found.overall.reduction(),
            },
            by_speed: found.vibration.iter().map(at_speed).collect(),
            grade_mm_s: GradeAnswer {
                before: found.grade.before_mm_s,
                after: found.grade.after_mm_s,
                after_at_most: found.grade.after_at_most_mm_s,
            },
            chi2_per_value: found.misfit.map(|m| m.chi2_per_value),
            chance: found.misfit.map(|m| m.chance()),
            model_adequate: found.misfit.is_none_or(|m| m.chance() >= LEAST_CHANCE),
        }
    }
}

impl TrialBalance {
    /// Of a correction of what run `onto` has, or of the machine without trial weights.
    pub fn of(
        found: &Correction,
        criterion: Criterion,
        onto: Option<String>,
        sense: AngleSense,
        by_kept_coefficients: bool,
    ) -> Self {
        let unit = found.weight_unit;
        let weight = |w: &PlaneWeight| {
            let placed = PieceAnswer::all(&w.filling, sense, unit);
            let interval_95 = w.interval_95.map(|(magnitude, _)| magnitude);
            TrialWeight {
                plane: w.plane.clone(),
                magnitude_g_mm: (!unit.is_mass()).then_some(w.wanted_g_mm.norm()),
                magnitude: w.wanted_g_mm.norm() / unit.scale(),
                magnitude_interval_95: interval_95.map(|ends| ends.map(|end| end / unit.scale())),
                angle_deg: sense.angle_deg(w.wanted_g_mm),
                interval_95: interval_95.filter(|_| !unit.is_mass()),
                angle_95_deg: w.interval_95.map(|(_, half)| half),
                text: instruction(&w.plane, &placed, sense, unit),
                placed,
                wanted_g_mm: w.wanted_g_mm,
            }
        };
        let um = um_of(&found.unit);
        Self {
            angles: sense.words(),
            unit: found.unit.clone(),
            amplitude_convention: ZERO_TO_PEAK,
            criterion: match criterion {
                Criterion::LeastSquares => "least_squares",
                Criterion::MinMax => "min_max",
            },
            weight_unit: unit.symbol,
            onto,
            noise: match found.basis {
                Basis::Stated => "stated",
                Basis::Runs(_) => "runs",
                Basis::Readings(_) => "readings",
                Basis::Unknown => "unknown",
            },
            weights: found.weights.iter().map(weight).collect(),
            static_couple: StaticCouple::of(&found.weights, sense).filter(|_| !unit.is_mass()),
            weight_scale: unit.scale(),
            left: found.left.iter().map(|l| LeftAnswer::of(l, um)).collect(),
            doubts: found.doubts.clone(),
            sense,
            by_kept_coefficients,
            noise_values: match found.basis {
                Basis::Runs(values) | Basis::Readings(values) => Some(values),
                Basis::Stated | Basis::Unknown => None,
            },
        }
    }
}

impl StaticCouple {
    /// Of two planes; none of others.
    fn of(weights: &[PlaneWeight], sense: AngleSense) -> Option<Self> {
        let wanted: Vec<Complex<f64>> = weights.iter().map(|w| w.wanted_g_mm).collect();
        let vector =
            |u: Complex<f64>| VectorAnswer { magnitude_g_mm: u.norm(), angle_deg: sense.angle_deg(u) };
        (wanted.len() == 2).then(|| {
            let [all, couple] = static_and_dynamic(&[0.0, 1.0], &wanted);
            Self { static_unbalance: vector(all), couple: vector(couple) }
        })
    }
}

/// µm of the units of displacement.
fn um_of(unit: &str) -> Option<f64> {
    match unit {
        "um" => Some(1.0),
        "mil" => Some(25.4),
        "mm" => Some(1e3),
        "m" => Some(1e6),
        _ => None,
    }
}

impl LeftAnswer {
    fn of(l: &ProbeVibration, um: Option<f64>) -> Self {
        Self {
            probe: l.probe.clone(),
            speed_rpm: l.speed_rpm,
            before_um: um.map(|um| um * l.before),
            after_um: um.map(|um| um * l.after),
            after_at_most_um: um.zip(l.after_at_most).map(|(um, after)| um * after),
            before: l.before,
            after: l.after,
            after_at_most: l.after_at_most,
        }
    }
}
