//! Exact derivatives of a problem: a term says how a parameter changes its dynamic stiffness or a probe's
//! gain, the adjoint response says what that does at every probe.

use nalgebra::{Complex, DMatrix, Matrix2};

use super::centreline;
use super::problem::{Evaluation, Problem, Responses};
use crate::effects::terms::Terms;

type C = Complex<f64>;

/// Step in a search coordinate for the slope of a term: second-order differences of smooth, small
/// matrices, good to ten digits.
const SLOPE_STEP: f64 = 1e-5;

impl Problem<'_> {
    /// Change of the model at every value per search coordinate, the linear unknowns held, in noise units.
    pub(super) fn derivative(&self) -> Option<DMatrix<f64>> {
        let now = self.evaluated()?;
        let mut d = DMatrix::zeros(2 * self.count(), self.x().len());
        for i in 0..self.x().len() {
            let moved = |by: f64| {
                let mut x = self.x().to_vec();
                x[i] += by;
                self.hypothesis.terms(&x)
            };
            let (up, down) = (moved(SLOPE_STEP), moved(-SLOPE_STEP));
            let mut slopes = vec![C::from(0.0); self.count()];
            self.add_support_slopes(now, &up, &down, &mut slopes);
            self.add_housing_slopes(now, &up, &down, &mut slopes);
            self.add_damping_slopes(now, &up, &down, &mut slopes);
            self.add_speed_slopes(now, &up, &down, &mut slopes);
            self.add_gain_slopes(now, &up, &down, &mut slopes);
            for (k, (v, slope)) in self.values().zip(slopes).enumerate() {
                (d[(2 * k, i)], d[(2 * k + 1, i)]) = (slope.re / v.sigma_m, slope.im / v.sigma_m);
            }
        }
        Some(self.observed(d))
    }

    /// Change of the journals' places per search coordinate, in standard deviations of what gap voltages say.
    pub(super) fn centreline_derivative(&self) -> DMatrix<f64> {
        let (observed, x) = (&self.data.centreline, self.x());
        let mut d = DMatrix::zeros(observed.len(), x.len());
        for i in (0..x.len()).filter(|_| !observed.is_empty()) {
            let at = |by: f64| {
                let mut x = x.to_vec();
                x[i] += by;
                centreline::residuals(observed, &self.hypothesis.terms(&x))
            };
            d.set_column(i, &((at(SLOPE_STEP) - at(-SLOPE_STEP)) / (2.0 * SLOPE_STEP)));
        }
        d
    }

    fn add_support_slopes(&self, now: &Evaluation, up: &Terms, down: &Terms, slopes: &mut [C]) {
        if now.terms.foundation.is_some() && up.supports != down.supports {
            return self.add_slopes_on_foundation(now, up, down, slopes);
        }
        let pairs = up.supports.iter().zip(&down.supports);
        for (k, ((place, a), (_, b))) in pairs.enumerate().filter(|(_, (a, b))| a != b) {
            let Some(held) = self.held.iter().position(|h| h == place) else { continue };
            debug_assert_eq!(down.supports[k].0, *place, "a step does not move supports");
            let slope = |row: &usize| -> Matrix2<C> {
                let change = self.stiffness(up, *place, a, *row) - self.stiffness(down, *place, b, *row);
                change.unscale(2.0 * SLOPE_STEP)
            };
            let slope_of: Vec<Matrix2<C>> = now.responses.groups.first.iter().map(slope).collect();
            // of each probe in a row, which can have many values of it
            let mut seen: Vec<C> = Vec::with_capacity(now.terms.shows.len());
            let mut at = 0;
            for (r, row) in self.rows.iter().enumerate() {
                let slope = &slope_of[now.responses.groups.of_row[r]];
                let force = slope * now.motion[r].fixed_rows::<2>(2 * held);
                let adjoint = &now.responses.of(r).adjoint;
                seen.clear();
                seen.extend(adjoint.column_iter().map(|a| a[2 * held] * force.x + a[2 * held + 1] * force.y));
                for (slope, v) in slopes[at..].iter_mut().zip(&row.values) {
                    *slope -= now.terms.gains[v.probe] * seen[now.terms.shows[v.probe]];
                }
                at += row.values.len();
            }
        }
    }

    /// A foundation passes a change at one bearing on to all.
    fn add_slopes_on_foundation(&self, now: &Evaluation, up: &Terms, down: &Terms, slopes: &mut [C]) {
        let mut at = 0;
        for (r, row) in self.rows.iter().enumerate() {
            let forces = |terms: &Terms| self.supports(terms, r).forces(&now.motion[r]);
            let force = (forces(up) - forces(down)).unscale(2.0 * SLOPE_STEP);
            for v in &row.values {
                let seen = now.responses.of(r).adjoint.column(now.terms.shows[v.probe]).dot(&force);
                slopes[at] -= now.terms.gains[v.probe] * seen;
                at += 1;
            }
        }
    }

    /// What a probe on a housing reads of it changes with bearing and pedestal, whatever the shaft does.
    fn add_housing_slopes(&self, now: &Evaluation, up: &Terms, down: &Terms, slopes: &mut [C]) {
        let rotor = self.hypothesis.rotor;
        let on_ground = (0..rotor.probe.len()).all(|probe| up.mount(rotor, probe).is_none());
        if up.supports == down.supports || on_ground {
            return;
        }
        let mut at = 0;
        for (r, row) in self.rows.iter().enumerate() {
            for (a, b) in self.mounted(up, r).iter().zip(&self.mounted(down, r)) {
                let change = (&a.reading - &b.reading).dot(&now.motion[r]).unscale(2.0 * SLOPE_STEP);
                for (k, v) in
                    row.values.iter().enumerate().filter(|(_, v)| now.terms.shows[v.probe] == a.probe)
                {
                    slopes[at + k] -= now.terms.gains[v.probe] * change;
                }
            }
            at += row.values.len();
        }
    }

    fn add_damping_slopes(&self, now: &Evaluation, up: &Terms, down: &Terms, slopes: &mut [C]) {
        let slope = (up.internal_damping_s - down.internal_damping_s) / (2.0 * SLOPE_STEP);
        if slope == 0.0 {
            return;
        }
        let places = self.places();
        let mut at = 0;
        for (r, row) in self.rows.iter().enumerate() {
            let speed_and_damping = [self.speed_rad_s(&now.terms, r), now.terms.internal_damping_s];
            let supports = self.supports(&now.terms, r);
            let receptances = self.receptances_of(r, &now.terms);
            let (response, motion) = (&now.responses.of(r), &now.motion[r]);
            let change = receptances.damping_slope(
                &self.plant,
                speed_and_damping,
                &places,
                &supports,
                response,
                motion,
            );
            for v in &row.values {
                slopes[at] += now.terms.gains[v.probe] * change[now.terms.shows[v.probe]] * slope;
                at += 1;
            }
        }
    }

    fn add_gain_slopes(&self, now: &Evaluation, up: &Terms, down: &Terms, slopes: &mut [C]) {
        if up.gains == down.gains {
            return;
        }
        let shown = self.shown(&now.terms, &now.sizes, &now.responses);
        for (slope, (v, shown)) in slopes.iter_mut().zip(self.values().zip(shown)) {
            *slope += (up.gains[v.probe] - down.gains[v.probe]) / (2.0 * SLOPE_STEP) * shown;
        }
    }

    /// Another speed changes the receptances themselves: two whole responses.
    fn add_speed_slopes(&self, now: &Evaluation, up: &Terms, down: &Terms, slopes: &mut [C]) {
        if up.speed_factor == down.speed_factor {
            return;
        }
        // at a critical speed without damping there is no slope
        let (Some(above), Some(below)) = (self.respond(up), self.respond(down)) else { return };
        let shown =
            |terms, responses| self.shown(&now.terms, &self.sizes(terms, &now.solved.unknowns), responses);
        let sides = shown(up, &above).into_iter().zip(shown(down, &below));
        for (slope, (v, (above, below))) in slopes.iter_mut().zip(self.values().zip(sides)) {
            *slope += now.terms.gains[v.probe] * (above - below) / (2.0 * SLOPE_STEP);
        }
    }

    /// Motion that every value shows under forces of these sizes in each row, gain and runout left out.
    fn shown(&self, terms: &Terms, sizes: &[Vec<C>], responses: &Responses) -> Vec<C> {
        let probes = terms.shows.len();
        let mut shown = Vec::with_capacity(self.count());
        for (r, (row, sizes)) in self.rows.iter().zip(sizes).enumerate() {
            let response = &responses.of(r).probes;
            shown.extend(row.values.iter().map(|v| -> C {
                let probe = terms.shows[v.probe];
                sizes.iter().enumerate().map(|(force, size)| size * response[force * probes + probe]).sum()
            }));
        }
        shown
    }
}
