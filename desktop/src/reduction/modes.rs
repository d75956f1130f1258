//! The lowest modes of a shaft that stands still.
//!
//! Of a shaft of usual size all modes are solved for and the lowest taken. The work for that grows with the cube of the
//! coordinates; of a large one a few shapes are bent under their own inertia again and again until they are the lowest modes
//! (subspace iteration: Bathe and Wilson 1973, "Solution methods for eigenvalue problems in structural mechanics").

use crate::decomposition::eigen::DefinitePencil;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Coordinates up to which all modes are solved for: about a second.
const SMALL: usize = 400;
/// Shapes that are carried along beside the modes sought: the error of a mode falls in a round by its eigenvalue over that
/// of the first shape left out.
const BESIDE: usize = 8;
/// Change of the eigenvalues in a round, relative to the highest sought, that ends the iteration; and the rounds after which
/// it ends whatever they do.
const SETTLED: f64 = 1e-13;
const MOST_ROUNDS: usize = 60;

/// The `count` lowest modes, orthonormal in the mass; `held` is the factor of the stiffness, or of it and a little of the mass.
pub fn lowest(
    stiffness: &DMatrix<f64>,
    mass: &DMatrix<f64>,
    held: &Cholesky<f64, Dyn>,
    count: usize,
) -> Vec<DVector<f64>> {
    match mass.nrows() {
        0..=SMALL => solved(stiffness, mass, count).1,
        _ => iterated(stiffness, mass, held, count),
    }
}

/// Eigenvalues and modes by the solution of the whole.
///
/// # Panics
/// If the mass is not positive definite, which no shaft's is.
fn solved(stiffness: &DMatrix<f64>, mass: &DMatrix<f64>, count: usize) -> (Vec<f64>, Vec<DVector<f64>>) {
    let factor = mass.clone().cholesky().expect("the mass of a shaft is positive definite").l();
    let pencil = DefinitePencil::new(stiffness, &factor);
    let lowest = &pencil.ascending()[..count.min(mass.nrows())];
    (lowest.iter().map(|k| pencil.values[*k]).collect(), lowest.iter().map(|k| pencil.vector(*k)).collect())
}

fn iterated(
    stiffness: &DMatrix<f64>,
    mass: &DMatrix<f64>,
    held: &Cholesky<f64, Dyn>,
    count: usize,
) -> Vec<DVector<f64>> {
    let size = mass.nrows();
    let carried = (count + BESIDE).min(size);
    // loads that are spread over the shaft, each in its own way
    let mut shapes = DMatrix::from_fn(size, carried, |i, j| ((i + 1) as f64 * (j + 1) as f64 * 0.618).cos());
    let mut last = vec![f64::INFINITY; count];
    for _ in 0..MOST_ROUNDS {
        let bent = held.solve(&(mass * &shapes)).qr().q();
        let (k, m) = (bent.tr_mul(&(stiffness * &bent)), bent.tr_mul(&(mass * &bent)));
        let (values, combined) = solved(&k, &m, carried);
        shapes = bent * DMatrix::from_columns(&combined);
        let highest = values[count - 1].abs();
        let moved = values.iter().zip(&last).map(|(now, before)| (now - before).abs()).fold(0.0, f64::max);
        if moved <= SETTLED * highest {
            break;
        }
        last = values[..count].to_vec();
    }
    shapes.column_iter().take(count).map(|mode| mode.into_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::drawing::Physics;
    use crate::shaft::structure::Structure;
    use crate::testing::sample_rotor;

    #[test]
    fn modes_by_iteration_are_those_of_the_whole() {
        let structure = Structure::finite_elements(&sample_rotor(), &Physics::default(), 12);
        let (mass, mut stiffness) = (structure.mass, structure.stiffness);
        for bearing in &sample_rotor().bearing {
            let at = structure.stations.iter().position(|s| (s.position_m - bearing.position_m).abs() < 1e-9);
            stiffness[(2 * at.unwrap(), 2 * at.unwrap())] += 2e8;
        }
        let held = stiffness.clone().cholesky().unwrap();
        let (values, expected) = solved(&stiffness, &mass, 8);
        for (k, mode) in iterated(&stiffness, &mass, &held, 8).iter().enumerate() {
            let square = mode.dot(&(&stiffness * mode));
            assert!((square / values[k] - 1.0).abs() < 1e-9, "{k}: {square} {}", values[k]);
            let alike = mode.dot(&(&mass * &expected[k])).abs();
            assert!((alike - 1.0).abs() < 1e-6, "{k}: {alike}");
        }
    }
}
