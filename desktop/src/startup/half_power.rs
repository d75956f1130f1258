//! The resonance by its peak and its half-power points.
//!
//! The response to an unbalance is `|Y|² ∝ 1 / ((s − 1)² + 4ζ²s)` with `s = (ω/Ω)²`, so that `1/|Y|²` is
//! a parabola in `u = 1/Ω²`: exactly, whatever the damping and however coarse the steps. Its lowest
//! point lies at `s = 1 − 2ζ²`, and it reaches twice that height at
//!
//! ```text
//!   s = (1 − 2ζ²) ± 2ζ √(1 − ζ²) = cos 2φ ± sin 2φ,   ζ = sin φ
//! ```
//!
//! so for half-power points `Ω₁ < Ω₂` the damping is `tan 2φ = (Ω₂² − Ω₁²) / (Ω₂² + Ω₁²)`, which for light
//! damping is the usual `(Ω₂ − Ω₁) / 2ω`. From `2φ = 45°`, ζ = 0.383, on, there is no upper half-power
//! point: high above its resonance the rotor moves by more than 71 % of the peak.

use nalgebra::{Matrix3, Vector3};

use super::Modal;
use super::series::Point;
use crate::units::rpm;

/// A rise or fall by this many standard deviations is none of the noise's.
const SURE: f64 = 5.0;
/// The top of a peak: amplitudes above this share of it.
const TOP: f64 = 0.8;
/// Its flank: amplitudes between these shares, around 1/√2.
const FLANK: [f64; 2] = [0.55, 0.87];

/// The resonance, with the points that an engineer marks in the plot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfPower {
    /// Natural speed and damping, exact for any damping.
    pub modal: Modal,
    /// `(Ω₂ − Ω₁) / 2Ω_peak`, which takes the damping for light.
    pub light_damping_ratio: f64,
    /// Speed and amplitude of the peak, rad/s and m.
    pub peak: [f64; 2],
    /// Speeds of the half-power points, rad/s.
    pub half_power_rad_s: [f64; 2],
}

/// The first resonance that a start-up passes: index of its largest amplitude.
///
/// # Errors
/// One sentence where the vibration has no peak in the range.
pub fn peak(points: &[Point]) -> Result<usize, String> {
    let size = |i: usize| points[i].motion_m.norm();
    let surely_below =
        |i: usize, top: usize| size(top) - size(i) > SURE * points[i].sigma_m.hypot(points[top].sigma_m);
    let (Some(first), Some(last)) = (points.first(), points.last()) else {
        return Err("there is no reading".into());
    };
    let mut top = 0;
    for i in 1..points.len() {
        if size(i) > size(top) {
            top = i;
        } else if top > 0
            && surely_below(i, top)
            && surely_below(0, top)
            && size(i) < size(top) * std::f64::consts::FRAC_1_SQRT_2
        {
            return Ok(top);
        }
    }
    if top > 0 && surely_below(0, top) && surely_below(points.len() - 1, top) {
        return Ok(top);
    }
    let (from, to) = (rpm(first.speed_rad_s), rpm(last.speed_rad_s));
    let why = if points.len() < 5 {
        format!("{} readings are too few to show a peak", points.len())
    } else if surely_below(0, top) {
        format!("the vibration still grows at {to:.0} rpm, run faster")
    } else {
        "no speed stands out of the noise".into()
    };
    Err(format!("no resonance between {from:.0} and {to:.0} rpm: {why}"))
}

/// Peak and half-power points of a start-up.
///
/// # Errors
/// One sentence where there is no peak, or a half-power point lies outside the data.
pub fn half_power(points: &[Point]) -> Result<HalfPower, String> {
    let top = peak(points)?;
    let largest = points[top].motion_m.norm();
    let size = |i: usize| points[i].motion_m.norm() / largest;
    // the top, and whatever neighbours a parabola needs
    let low = (0..top).rev().take_while(|i| size(*i) > TOP).last().unwrap_or(top).min(top.saturating_sub(1));
    let high = (top + 1..points.len()).take_while(|i| size(*i) > TOP).last().unwrap_or(top).max(top + 1);
    let high = high.min(points.len() - 1);
    let crown = if high - low < 2 && low > 0 { low - 1 } else { low };
    let outside = || "the peak lies at the edge of the data, start slower or run faster".to_string();
    let parabola = Parabola::through(&points[crown..=high]).ok_or_else(outside)?;
    let [a, b, c] = parabola.coefficients;
    let u = -0.5 * b / a;
    let height = c - 0.25 * b * b / a;
    if !(a > 0.0 && u > 0.0 && height > 0.0) {
        return Err("noise hides the top of the peak; repeat the run".into());
    }
    let lower = crossing(points, (0..top).rev(), top, largest, height)?;
    let upper = crossing(points, top + 1..points.len(), top, largest, height)?;
    let (before, after) = (lower.recip(), upper.recip());
    let double_phi = ((after - before) / (after + before)).atan();
    let damping_ratio = (0.5 * double_phi).sin();
    let peak_rad_s = u.sqrt().recip();
    let natural_rad_s = peak_rad_s * double_phi.cos().sqrt();
    let half_power_rad_s = [before.sqrt(), after.sqrt()];
    Ok(HalfPower {
        modal: Modal { natural_rad_s, damping_ratio },
        light_damping_ratio: (half_power_rad_s[1] - half_power_rad_s[0]) / (2.0 * peak_rad_s),
        peak: [peak_rad_s, height.sqrt().recip()],
        half_power_rad_s,
    })
}

/// `1/Ω²` where `1/|Y|²` reaches twice `height`, going outwards from the peak.
fn crossing(
    points: &[Point],
    outwards: impl Iterator<Item = usize>,
    top: usize,
    largest: f64,
    height: f64,
) -> Result<f64, String> {
    let size = |i: usize| points[i].motion_m.norm() / largest;
    let level = (2.0 * height).sqrt().recip() / largest;
    let (mut chosen, mut crossed, mut last) = (Vec::new(), None, top);
    for i in outwards {
        let beyond = size(i) < level;
        if crossed.is_none() && beyond {
            crossed = Some((last, i));
        }
        if crossed.is_some() && size(i) < FLANK[0] {
            break;
        }
        if size(i) < FLANK[1] {
            chosen.push(i);
        }
        last = i;
    }
    let Some((inner, outer)) = crossed else {
        let at = rpm(points[last].speed_rad_s);
        let (side, what) = if last < top { ("lower", "start slower") } else { ("upper", "run faster") };
        return Err(format!(
            "the {side} half-power point lies outside the data: at {at:.0} rpm the vibration is still {:.0} % of the \
             peak; {what}, or damping is too high for half-power points",
            100.0 * size(last)
        ));
    };
    let next = if inner > outer { inner + 1 } else { inner.saturating_sub(1) };
    for i in [inner, outer, next.min(points.len() - 1)] {
        if !chosen.contains(&i) {
            chosen.push(i);
        }
    }
    chosen.sort_unstable();
    let flank: Vec<Point> = chosen.iter().map(|i| points[*i]).collect();
    let ends = [inner, outer].map(|i| points[i].speed_rad_s.powi(-2));
    let root = Parabola::through(&flank).and_then(|p| p.reaches(2.0 * height, ends));
    Ok(root.unwrap_or_else(|| {
        // a straight line between the two neighbours always crosses
        let h = |i: usize| points[i].motion_m.norm_sqr().recip();
        let share = (2.0 * height - h(inner)) / (h(outer) - h(inner));
        ends[0] + share * (ends[1] - ends[0])
    }))
}

/// `1/|Y|² = a u² + b u + c`, fitted with the weights of the noise.
struct Parabola {
    coefficients: [f64; 3],
}

impl Parabola {
    fn through(points: &[Point]) -> Option<Self> {
        if points.len() < 3 {
            return None;
        }
        let unit = points[0].speed_rad_s.powi(-2);
        let (mut gram, mut slope) = (Matrix3::zeros(), Vector3::zeros());
        for p in points {
            let u = p.speed_rad_s.powi(-2) / unit;
            let h = p.motion_m.norm_sqr().recip();
            let sigma = 2.0 * h * p.sigma_m / p.motion_m.norm();
            let row = Vector3::new(u * u, u, 1.0) / sigma;
            gram += row * row.transpose();
            slope += row * (h / sigma);
        }
        let solution = gram.cholesky()?.solve(&slope);
        Some(Self { coefficients: [solution[0] / (unit * unit), solution[1] / unit, solution[2]] })
    }

    /// Where it rises to this height on the way from an inner to an outer place, or a step beyond: noise
    /// may have moved the readings themselves across.
    fn reaches(&self, height: f64, [inner, outer]: [f64; 2]) -> Option<f64> {
        let [a, b, c] = self.coefficients;
        let lowest = -0.5 * b / a;
        let spread = (lowest * lowest - (c - height) / a).sqrt();
        let (step, middle) = ((outer - inner).abs(), 0.5 * (inner + outer));
        let root = lowest + spread * (outer - inner).signum();
        (a > 0.0 && (root - middle).abs() <= 1.5 * step).then_some(root)
    }
}
