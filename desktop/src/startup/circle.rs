//! The resonance by the circle that it draws.
//!
//! Divided by the speed, the response to an unbalance is the mobility of a mass on a spring and a
//! viscous damper, `1 / (1 + i q)` with `q = (Ω² − ω²) / 2ζωΩ`: a circle exactly, on which the angle at the
//! centre is `−2 atan q`. What other modes add near a resonance moves the centre and leaves the circle.

use nalgebra::{Complex, DVector, Matrix3, Vector3};

use super::Modal;
use super::half_power::peak;
use super::minimum::minimum;
use super::series::Point;

type C = Complex<f64>;

/// The part of the circle that is fitted: amplitudes above this share of its largest.
const NEAR: f64 = 0.5;
/// A circle has three unknowns, its sweep three more; two values a point.
const LEAST_POINTS: usize = 5;

/// The circle fit of a start-up.
///
/// # Errors
/// One sentence where there is no resonance, or too few readings are near it.
pub fn circle(points: &[Point]) -> Result<Modal, String> {
    let top = peak(points)?;
    let plane = |p: &Point| p.motion_m / p.speed_rad_s;
    let size = |i: &usize| plane(&points[*i]).norm();
    let near = |i: &usize| size(i) > NEAR * size(&top);
    let mut from = (0..top).rev().take_while(near).last().unwrap_or(top);
    let mut to = (top + 1..points.len()).take_while(near).last().unwrap_or(top);
    if points.len() < LEAST_POINTS {
        return Err(format!("{} readings are too few for a circle, measure at more speeds", points.len()));
    }
    // coarse steps leave few on the near side of it
    while to - from + 1 < LEAST_POINTS {
        let left_is_larger = from > 0 && (to + 1 == points.len() || size(&(from - 1)) > size(&(to + 1)));
        if left_is_larger { from -= 1 } else { to += 1 }
    }
    let arc = &points[from..=to];
    let scale = size(&top);
    let seen: Vec<C> = arc.iter().map(|p| plane(p) / scale).collect();
    let sigma: Vec<f64> = arc.iter().map(|p| p.sigma_m / p.speed_rad_s / scale).collect();
    let none = || "the readings near the resonance lie on no circle".to_string();
    let start = algebraic(&seen, &sigma).ok_or_else(none)?;
    let distances = |x: &DVector<f64>| {
        let centre = C::new(x[0], x[1]);
        DVector::from_iterator(
            seen.len(),
            seen.iter().zip(&sigma).map(|(z, s)| ((z - centre).norm() - x[2]) / s),
        )
    };
    let (at, _) = minimum(DVector::from_row_slice(&start), distances);
    let (centre, radius) = (C::new(at[0], at[1]), at[2].abs());
    let around: Vec<C> = seen.iter().map(|z| (z - centre) / radius).collect();
    let guess = points[top].speed_rad_s;
    let width = (arc[arc.len() - 1].speed_rad_s - arc[0].speed_rad_s) / (2.0 * 3.0_f64.sqrt() * guess);
    // from the angle of the peak; ω relative to the peak, and 2ζ, as logarithms
    let begin = DVector::from_row_slice(&[around[top - from].arg(), 0.0, width.ln()]);
    let angles = |x: &DVector<f64>| {
        let (natural, loss) = (guess * x[1].exp(), x[2].exp());
        let off = |((p, z), s): ((&Point, &C), &f64)| {
            let w = p.speed_rad_s;
            let q = (w * w - natural * natural) / (loss * natural * w);
            let turned = z * C::from_polar(1.0, 2.0 * q.atan() - x[0]);
            turned.arg() * radius / s
        };
        DVector::from_iterator(arc.len(), arc.iter().zip(&around).zip(&sigma).map(off))
    };
    let (at, _) = minimum(begin, angles);
    Ok(Modal { natural_rad_s: guess * at[1].exp(), damping_ratio: 0.5 * at[2].exp() })
}

/// Centre and radius that make `Σ (|z − c|² − r²)²` least: a linear problem.
fn algebraic(seen: &[C], sigma: &[f64]) -> Option<[f64; 3]> {
    let (mut gram, mut slope) = (Matrix3::zeros(), Vector3::zeros());
    for (z, s) in seen.iter().zip(sigma) {
        let row = Vector3::new(z.re, z.im, 1.0) / *s;
        gram += row * row.transpose();
        slope += row * (z.norm_sqr() / s);
    }
    let x = gram.cholesky()?.solve(&slope);
    let (re, im) = (0.5 * x[0], 0.5 * x[1]);
    let square = x[2] + re * re + im * im;
    (square > 0.0).then(|| [re, im, square.sqrt()])
}
