//! Whether data determine what a model is used for: the unbalance of its planes.

use nalgebra::{Complex, DMatrix};

use super::base::Base;
use crate::decomposition::hermitian;
use crate::error::Error;
use crate::fit::hypothesis::Hypothesis;
use crate::fit::{Drawing, Fit};
use crate::unbalance::{G_MM, g_mm_deg};

/// Radius of a circle that holds 95 % of a two-dimensional normal law, in standard deviations: √χ²₂(0.95).
const RADIUS_95: f64 = 2.447_746_830_680_816;
/// Condition of the planes above which they act nearly alike: weights that the data can hardly tell apart are more than
/// ten times as large as what is left of them.
const ALIKE: f64 = 10.0;

/// What data say about the unbalance of one plane.
#[derive(Debug, Clone, PartialEq)]
pub struct DeterminedPlane {
    pub name: String,
    pub unbalance_g_mm: f64,
    /// From the keyphasor mark, in the direction of rotation, −180 to 180 degrees.
    pub angle_deg: f64,
    /// The magnitude lies between these with 95 %, g·mm.
    pub interval_95_g_mm: [f64; 2],
    /// The angle lies within this of what is stated with 95 %, degrees; 180 where any angle is possible.
    pub angle_95_deg: f64,
    /// Half axes, g·mm, and direction of the first, degrees, of the ellipse that holds 95 %.
    pub region: [f64; 3],
}

impl DeterminedPlane {
    /// From a phasor and the 2 × 2 covariance of its parts, kg·m.
    pub fn new(name: &str, unbalance_kg_m: Complex<f64>, covariance: &DMatrix<f64>) -> Self {
        let eigen = hermitian(covariance.clone());
        let first = usize::from(eigen.eigenvalues[1] > eigen.eigenvalues[0]);
        let axis = |i: usize| RADIUS_95 * G_MM * eigen.eigenvalues[i].max(0.0).sqrt();
        let direction = eigen.eigenvectors.column(first);
        let [unbalance_g_mm, angle_deg] = g_mm_deg(unbalance_kg_m);
        let along = unbalance_kg_m / unbalance_kg_m.norm().max(f64::MIN_POSITIVE);
        let spread = |u: Complex<f64>| {
            let v = [u.re, u.im];
            let variance: f64 = (0..2)
                .flat_map(|i| (0..2).map(move |j| (i, j)))
                .map(|(i, j)| v[i] * v[j] * covariance[(i, j)])
                .sum();
            RADIUS_95 * G_MM * variance.max(0.0).sqrt()
        };
        let (radial, across) = (spread(along), spread(along * Complex::i()));
        let angle_95_deg =
            if across < unbalance_g_mm { (across / unbalance_g_mm).asin().to_degrees() } else { 180.0 };
        Self {
            name: name.to_string(),
            unbalance_g_mm,
            angle_deg,
            interval_95_g_mm: [(unbalance_g_mm - radial).max(0.0), unbalance_g_mm + radial],
            angle_95_deg,
            region: [axis(first), axis(1 - first), direction[1].atan2(direction[0]).to_degrees()],
        }
    }

    /// Whether the region that holds it with 95 % holds this unbalance, kg·m.
    pub fn holds(&self, unbalance_kg_m: Complex<f64>) -> bool {
        let found_g_mm = Complex::from_polar(self.unbalance_g_mm, self.angle_deg.to_radians());
        let [first, second, direction_deg] = self.region;
        let off =
            (unbalance_kg_m * G_MM - found_g_mm) * Complex::from_polar(1.0, -direction_deg.to_radians());
        (off.re / first).hypot(off.im / second) <= 1.0
    }

    /// Whether the data say on which side of the shaft its unbalance is, and that there is one.
    pub fn is_determined(&self) -> bool {
        self.region[0] < self.unbalance_g_mm
    }
}

/// What data say about all planes.
#[derive(Debug, Clone, PartialEq)]
pub struct Determined {
    pub planes: Vec<DeterminedPlane>,
    /// How much better the best-seen combination of planes is known than the worst.
    pub condition: f64,
}

impl Determined {
    /// From unbalances and the covariance of their real and imaginary parts, plane by plane, kg·m.
    pub fn new<'n>(
        names: impl IntoIterator<Item = &'n str>,
        unbalance_kg_m: &[Complex<f64>],
        covariance: &DMatrix<f64>,
    ) -> Self {
        let own = |i: usize| covariance.view((2 * i, 2 * i), (2, 2)).into_owned();
        let planes = names.into_iter().zip(unbalance_kg_m).enumerate();
        let planes = planes.map(|(i, (name, u))| DeterminedPlane::new(name, *u, &own(i))).collect();
        let variances = hermitian(covariance.clone()).eigenvalues;
        let (least, most) = (variances.min(), variances.max());
        let condition = if least > 0.0 { (most / least).sqrt() } else { f64::INFINITY };
        Self { planes, condition }
    }

    /// Of the planes of a fit.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn by(base: &Base, with: &Hypothesis, fit: &Fit, drawing: &Drawing) -> Result<Self, Error> {
        let planes = &base.fitter.rotor.plane;
        let count = 2 * planes.len();
        let covariance = base.fitter.covariance(with, fit, drawing)?;
        let unknown = || DMatrix::from_diagonal_element(count, count, f64::INFINITY);
        let covariance = covariance
            .map_or_else(unknown, |c| c.view((fit.x.len(), fit.x.len()), (count, count)).into_owned());
        Ok(Self::new(planes.iter().map(|p| p.name.as_str()), &fit.unknowns[..planes.len()], &covariance))
    }

    /// Whether the data hardly tell the planes apart.
    pub fn act_alike(&self) -> bool {
        self.planes.len() > 1 && self.condition > ALIKE
    }

    /// That the planes act nearly alike, in one clause; `None` if they do not.
    pub fn alike(&self) -> Option<String> {
        self.act_alike().then(|| {
            format!(
                "the planes are poorly determined, as they act nearly alike (condition {0:.0}: by as many percent a \
                 combination of them is off for each percent that the model is)",
                self.condition
            )
        })
    }

    /// Why the model is not fit to balance by, in one clause; `None` if it is.
    pub fn doubt(&self) -> Option<String> {
        let open = self.planes.iter().find(|p| !p.is_determined())?;
        let alike = self.alike().map(|alike| format!("; {alike}")).unwrap_or_default();
        Some(format!(
            "the unbalance of plane {} is {:.0} g·mm give or take {:.0}{alike}",
            open.name, open.unbalance_g_mm, open.region[0]
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ellipse_of_a_known_covariance_has_its_axes_and_direction() {
        // 2 and 1 g·mm standard deviation, the first at 30°
        let (c, s) = (30f64.to_radians().cos(), 30f64.to_radians().sin());
        let turn = DMatrix::from_row_slice(2, 2, &[c, -s, s, c]);
        let own = DMatrix::from_row_slice(2, 2, &[4e-12, 0.0, 0.0, 1e-12]);
        let covariance = &turn * own * turn.transpose();
        let u = Complex::from_polar(20e-6, 30f64.to_radians());
        let plane = DeterminedPlane::new("1", u, &covariance);
        assert!(
            (plane.region[0] - 2.0 * RADIUS_95).abs() < 1e-9 && (plane.region[1] - RADIUS_95).abs() < 1e-9
        );
        assert!((plane.region[2].rem_euclid(180.0) - 30.0).abs() < 1e-6);
        let half = plane.interval_95_g_mm[1] - plane.unbalance_g_mm;
        assert!((half - 2.0 * RADIUS_95).abs() < 1e-9, "along its own direction");
        assert!((plane.angle_95_deg - (RADIUS_95 / 20.0).asin().to_degrees()).abs() < 1e-9);
        assert!(plane.is_determined());
        let off =
            |along: f64, across: f64| plane.holds(u + Complex::new(along, across) * turn_of(30.0) * 1e-6);
        assert!(off(1.99 * RADIUS_95, 0.0) && !off(2.01 * RADIUS_95, 0.0));
        assert!(off(0.0, -0.99 * RADIUS_95) && !off(0.0, -1.01 * RADIUS_95));
    }

    fn turn_of(angle_deg: f64) -> Complex<f64> {
        Complex::from_polar(1.0, angle_deg.to_radians())
    }

    #[test]
    fn planes_with_same_effect_are_determined_by_their_sum() {
        // sum known to 1 g·mm, difference to 30
        let (sum, difference) = (0.5e-12, 450e-12);
        let covariance = DMatrix::from_fn(4, 4, |i, j| match (i % 2 == j % 2, i == j) {
            (false, _) => 0.0,
            (true, true) => 0.5 * (sum + difference),
            (true, false) => 0.5 * (sum - difference),
        });
        let u = [Complex::from(10e-6), Complex::from(12e-6)];
        let both = Determined::new(["1", "2"], &u, &covariance);
        assert!((both.condition - 30.0).abs() < 1e-6);
        let doubt = both.doubt().unwrap();
        assert!(doubt.contains("plane 1") && doubt.contains("nearly alike (condition 30:"), "{doubt}");
        let large = Determined::new(["1", "2"], &u.map(|u| 10.0 * u), &covariance);
        assert!(large.planes.iter().all(DeterminedPlane::is_determined), "by noise alone");
        assert!(
            large.doubt().is_none() && large.alike().unwrap().starts_with("the planes are poorly determined")
        );
    }
}
