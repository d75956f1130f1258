//! The forces of each row: which of the plant's act, and in what sizes.

use std::borrow::Cow;

use nalgebra::Complex;

use super::{Column, Problem};
use crate::effects::terms::Terms;
use crate::fit::data::FitRow;
use crate::receptance::modal_shaft::{Force, ModalShaft};

type C = Complex<f64>;

/// What a row's unknowns act by, in turn, and after them its known trial weights: each a sum of forces, known by their number in
/// [`Problem::forces`], with factors.
pub type ForceColumns = Vec<Vec<(usize, C)>>;

impl Problem<'_> {
    /// Force columns of a row at its true speed.
    fn columns_of(&self, row: usize, speed_rad_s: f64) -> ForceColumns {
        let row = &self.rows[row];
        let w2 = speed_rad_s * speed_rad_s;
        let number = |force: Force| {
            let column = self.plant.column(force);
            self.forces.iter().position(|f| *f == column).expect("forces_in_use lists every force of a row")
        };
        let unknown = |column: &Column| match column {
            Column::Force { force, law, per_unit } => {
                let share = if let Force::Pattern(pattern) = force { row.share_of(*pattern) } else { 1.0 };
                vec![(number(*force), C::from(per_unit * share * law.factor(speed_rad_s)))]
            }
            Column::Runout { .. } => Vec::new(),
        };
        let weight = |(z, u): &(f64, C)| (number(Force::UnbalanceAt(*z)), u * w2);
        let known = row.added.iter().map(weight).collect();
        self.unknowns.iter().map(unknown).chain([known]).collect()
    }

    pub(super) fn columns(&self, terms: &Terms) -> Vec<ForceColumns> {
        (0..self.rows.len()).map(|row| self.columns_of(row, self.speed_rad_s(terms, row))).collect()
    }

    /// The force columns of every row at its true speed.
    pub(super) fn columns_at(&self, terms: &Terms) -> Cow<'_, [ForceColumns]> {
        if terms.speed_factor == 1.0 { (&self.columns).into() } else { self.columns(terms).into() }
    }

    /// Size of each force in every row, for these unknowns.
    pub fn sizes(&self, terms: &Terms, unknowns: &[C]) -> Vec<Vec<C>> {
        let known = C::from(1.0);
        let of_row = |columns: &ForceColumns| {
            let mut sizes = vec![C::from(0.0); self.forces.len()];
            for (column, amount) in columns.iter().zip(unknowns.iter().chain([&known])) {
                column.iter().for_each(|(force, factor)| sizes[*force] += factor * amount);
            }
            sizes
        };
        self.columns_at(terms).iter().map(of_row).collect()
    }
}

/// Numbers of the plant's forces by which unknowns and trial weights act.
pub(super) fn forces_in_use(plant: &ModalShaft, unknowns: &[Column], rows: &[FitRow]) -> Vec<usize> {
    let by_unknown = |column: &Column| match column {
        Column::Force { force, .. } => Some(*force),
        Column::Runout { .. } => None,
    };
    let weights = rows.iter().flat_map(|row| &row.added).map(|(z, _)| Force::UnbalanceAt(*z));
    let mut numbers = Vec::new();
    for force in unknowns.iter().filter_map(by_unknown).chain(weights) {
        let number = plant.column(force);
        if !numbers.contains(&number) {
            numbers.push(number);
        }
    }
    numbers
}
