//! Whether data determine the unbalance of the planes.

use nalgebra::{Complex, DMatrix};

use super::base::BaseModel;
use crate::decomposition::hermitian;
use crate::fit::Fit;
use crate::unbalance::region::{KNOWN_NOISE, UnbalanceRegion};
use crate::unbalance::separation::PlaneSeparation;
use crate::unbalance::{G_MM, g_mm_deg};

/// The unbalance of one plane with its 95 % region.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneUnbalance {
    pub name: String,
    pub unbalance_g_mm: f64,
    /// From the keyphasor mark, in the direction of rotation, −180 to 180 degrees.
    pub angle_deg: f64,
    /// Least and largest magnitude of the region along the unbalance, g·mm.
    pub interval_95_g_mm: [f64; 2],
    /// Half-width of the region in angle, degrees; 180 where any angle is possible.
    pub angle_95_deg: f64,
    pub region: UnbalanceRegion,
}

impl PlaneUnbalance {
    /// From a phasor and the 2 × 2 covariance of its real and imaginary part, kg·m and kg²·m²; the noise scale counts as known.
    pub fn new(name: &str, unbalance_kg_m: Complex<f64>, covariance: &DMatrix<f64>) -> Self {
        let covariance_g2_mm2 = (covariance * (G_MM * G_MM)).fixed_view::<2, 2>(0, 0).into_owned();
        let region = UnbalanceRegion::new(unbalance_kg_m * G_MM, covariance_g2_mm2, KNOWN_NOISE);
        let [unbalance_g_mm, angle_deg] = g_mm_deg(unbalance_kg_m);
        let [radial, across] = region.extents_g_mm();
        let angle_95_deg =
            if across < unbalance_g_mm { (across / unbalance_g_mm).asin().to_degrees() } else { 180.0 };
        Self {
            name: name.to_string(),
            unbalance_g_mm,
            angle_deg,
            interval_95_g_mm: [(unbalance_g_mm - radial).max(0.0), unbalance_g_mm + radial],
            angle_95_deg,
            region,
        }
    }

    /// Whether the data show on which side of the shaft the unbalance is, and that it is not zero.
    pub fn is_determined(&self) -> bool {
        self.region.semi_axes_g_mm[0] < self.unbalance_g_mm
    }
}

/// The unbalances of all planes, and whether the data tell them apart.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneUnbalances {
    pub planes: Vec<PlaneUnbalance>,
    pub separation: PlaneSeparation,
}

impl PlaneUnbalances {
    /// From unbalances and the covariance of their real and imaginary parts, plane by plane, kg·m and kg²·m².
    pub fn new<'n>(
        names: impl IntoIterator<Item = &'n str>,
        unbalance_kg_m: &[Complex<f64>],
        covariance: &DMatrix<f64>,
    ) -> Self {
        let own = |i: usize| covariance.view((2 * i, 2 * i), (2, 2)).into_owned();
        let planes = names.into_iter().zip(unbalance_kg_m).enumerate();
        let planes: Vec<_> = planes.map(|(i, (name, u))| PlaneUnbalance::new(name, *u, &own(i))).collect();
        let variances = hermitian(covariance.clone()).eigenvalues;
        Self { separation: PlaneSeparation::of_eigenvalues(&variances, planes.len()), planes }
    }

    /// Of the planes of a fit with this covariance.
    pub fn by(base: &BaseModel, fit: &Fit, covariance: Option<&DMatrix<f64>>) -> Self {
        let planes = &base.fitter.rotor.plane;
        let count = 2 * planes.len();
        let unknown = || DMatrix::from_diagonal_element(count, count, f64::INFINITY);
        let covariance = covariance
            .map_or_else(unknown, |c| c.view((fit.x.len(), fit.x.len()), (count, count)).into_owned());
        Self::new(planes.iter().map(|p| p.name.as_str()), &fit.unknowns[..planes.len()], &covariance)
    }

    /// That the planes act nearly alike, in one sentence; `None` if they do not.
    pub fn alike(&self) -> Option<String> {
        self.separation.acts_alike().then(|| self.separation.words())
    }

    /// Why the model is not fit to balance by, in one or two sentences; `None` if it is.
    pub fn reason_undetermined(&self) -> Option<String> {
        let open = self.planes.iter().find(|p| !p.is_determined())?;
        let alike = self.alike().map(|alike| format!(" {alike}")).unwrap_or_default();
        Some(format!(
            "The unbalance of plane {} is {:.0} ± {:.0} g·mm (95 %).{alike}",
            open.name, open.unbalance_g_mm, open.region.semi_axes_g_mm[0]
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unbalance_in_kg_m_has_region_in_g_mm() {
        // 2 and 1 g·mm standard deviation
        let covariance = DMatrix::from_row_slice(2, 2, &[4e-12, 0.0, 0.0, 1e-12]);
        let plane = PlaneUnbalance::new("1", Complex::from(20e-6), &covariance);
        let radius = (-2.0 * 0.05_f64.ln()).sqrt();
        let [low, high] = plane.interval_95_g_mm;
        assert!((high - 20.0 - 2.0 * radius).abs() < 1e-9 && (low + high - 40.0).abs() < 1e-9);
        assert!((plane.angle_95_deg - (radius / 20.0).asin().to_degrees()).abs() < 1e-9);
        assert!(plane.is_determined());
        let unknown = DMatrix::from_diagonal_element(2, 2, f64::INFINITY);
        assert!(!PlaneUnbalance::new("1", Complex::from(20e-6), &unknown).is_determined());
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
        let both = PlaneUnbalances::new(["1", "2"], &u, &covariance);
        assert!((both.separation.condition - 30.0).abs() < 1e-6);
        let reason = both.reason_undetermined().unwrap();
        assert!(reason.contains("plane 1 is 10 ± ") && reason.contains("(condition number 30)"), "{reason}");
        let large = PlaneUnbalances::new(["1", "2"], &u.map(|u| 10.0 * u), &covariance);
        assert!(large.planes.iter().all(PlaneUnbalance::is_determined), "by noise alone");
        assert!(
            large.reason_undetermined().is_none()
                && large.alike().unwrap().starts_with("The planes have nearly the same effect")
        );
    }
}
