//! Whether the unbalances of the correction planes can be told apart.
//!
//! The measure is the condition number of the influence of the planes on what was measured: relative errors come through
//! that many times as large in what tells the planes apart as in what they have in common.

use nalgebra::{ComplexField, DMatrix, DVector};

use crate::decomposition::singular_values;

/// Condition number above which the planes act nearly alike: an error of a tenth of the response is then as large as the
/// whole difference between the planes.
const LARGEST_CONDITION: f64 = 10.0;

/// How well correction planes are told apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneSeparation {
    /// Condition number of the influence of the planes; not a number where fewer values than planes were measured.
    pub condition: f64,
    planes: usize,
}

impl PlaneSeparation {
    /// From the influence of each plane, one column a plane.
    pub fn of_influence<T: ComplexField<RealField = f64>>(influence: DMatrix<T>) -> Self {
        let (values, planes) = influence.shape();
        let singular = singular_values(influence);
        let condition = if values < planes { f64::NAN } else { singular.max() / singular.min() };
        Self { condition, planes }
    }

    /// From the eigenvalues of the normal matrix of the planes' unbalances, or of its inverse, their covariance.
    pub fn of_eigenvalues(eigenvalues: &DVector<f64>, planes: usize) -> Self {
        let (least, most) = (eigenvalues.min(), eigenvalues.max());
        let condition = if least > 0.0 { (most / least).sqrt() } else { f64::INFINITY };
        Self { condition, planes }
    }

    /// That the planes act nearly alike, in one sentence.
    pub fn words(&self) -> String {
        if !self.condition.is_finite() {
            return "The data do not tell the effects of the planes apart.".into();
        }
        format!(
            "The planes have nearly the same effect on the probes (condition number {0:.0}): a 1 % model error can become \
             {0:.0} % in the unbalance.",
            self.condition
        )
    }

    /// Whether the planes act nearly alike.
    pub fn acts_alike(&self) -> bool {
        self.planes > 1 && (self.condition.is_nan() || self.condition > LARGEST_CONDITION)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decomposition::hermitian;

    #[test]
    fn influence_and_its_covariance_have_the_same_condition() {
        let influence = DMatrix::from_row_slice(3, 2, &[1.0, 0.9, 0.5, 0.7, -0.2, 0.1]);
        let direct = PlaneSeparation::of_influence(influence.clone());
        let covariance = (influence.transpose() * &influence).try_inverse().unwrap();
        let inverse = PlaneSeparation::of_eigenvalues(&hermitian(covariance).eigenvalues, 2);
        assert!((direct.condition / inverse.condition - 1.0).abs() < 1e-9);
        assert!(!direct.acts_alike());
    }

    #[test]
    fn more_planes_than_values_act_alike_and_one_plane_never_does() {
        let few = PlaneSeparation::of_influence(DMatrix::from_row_slice(1, 2, &[1.0, 2.0]));
        assert!(few.condition.is_nan() && few.acts_alike());
        let one = PlaneSeparation::of_eigenvalues(&DVector::from_element(1, 0.0), 1);
        assert!(one.condition.is_infinite() && !one.acts_alike());
    }
}
