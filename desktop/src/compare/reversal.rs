//! Are the phases the wrong way round?

use super::ComparedValues;
use super::whirl::ProbePair;

/// Backward energy must exceed forward energy by this many of its own standard deviations.
const CERTAIN_SIGMAS: f64 = 4.0;

/// Whether every forward whirl appears backward: at all bearings the model goes forward, the
/// measurement backward beyond noise, and radii fit better with the two directions exchanged.
///
/// A wrong sign of the phase, or the two probes exchanged, turns `F` into the conjugate of `B`.
/// A real machine goes backward at one bearing between two split critical speeds, not at all bearings
/// on the average of all speeds.
pub(super) fn reversed(pairs: &[ProbePair], values: &ComparedValues) -> bool {
    !pairs.is_empty() && pairs.iter().all(|pair| reversed_at(pair, values))
}

fn reversed_at(pair: &ProbePair, values: &ComparedValues) -> bool {
    // all in standard deviations of a component, so that a noisy resonance does not decide alone
    let (mut excess, mut variance) = (0.0, 0.0);
    let (mut model_excess, mut as_read, mut exchanged) = (0.0, 0.0, 0.0);
    for seen in pair.seen(values) {
        let [forward, backward] = seen.measured_m.map(|m| m.norm() / seen.sigma_m);
        let [model_forward, model_backward] = seen.model_m.map(|m| m.norm() / seen.sigma_m);
        excess += backward * backward - forward * forward;
        // of |signal + noise|² with unit noise in each component: 4 + 4 |signal|²
        variance += 8.0 + 4.0 * (forward * forward + backward * backward);
        model_excess += model_forward * model_forward - model_backward * model_backward;
        as_read += (forward - model_forward).powi(2) + (backward - model_backward).powi(2);
        exchanged += (backward - model_forward).powi(2) + (forward - model_backward).powi(2);
    }
    excess > CERTAIN_SIGMAS * variance.sqrt() && model_excess > 0.0 && exchanged < as_read
}
