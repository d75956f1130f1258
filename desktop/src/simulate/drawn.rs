//! A machine that differs from its drawing, at random within the tolerances.

use rand::Rng;
use rand::rngs::StdRng;
use rand_distr::StandardNormal;

use super::stream;
use crate::error::Error;
use crate::machine::drawing::Rotor;
use crate::machine::tolerance::Deviations;
use crate::rotor_file::assign_loads;

const DRAWING_STREAM: u64 = 0x6472_6177;
/// Largest error of a number in standard deviations.
const LARGEST_SD: f64 = 2.0;

/// A number of the drawing that the machine does not keep to.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawingChange {
    /// As `[tolerance.found]` calls it.
    pub what: String,
    /// The machine's number less the drawing's: relative, of positions in m.
    pub change: f64,
    /// The same in standard deviations of the tolerance.
    pub deviations: f64,
}

/// The machine with every number of its drawing off by a normal deviate of its tolerance, at most two standard
/// deviations; without `[tolerance]` by what is usual. A number that cannot be off that way is off the other way: a bearing at the
/// end of a shaft moves inward.
///
/// # Errors
/// If the drawing is stated as exact.
pub fn within_tolerance(file: &Rotor, seed: u64) -> Result<(Rotor, Vec<DrawingChange>), Error> {
    let deviations = Deviations::of(file);
    if deviations.is_empty() {
        let what = "the rotor's file states an exact drawing, so there is no error to draw; expected a [tolerance] that is \
                    not zero";
        return Err(Error::Unsuitable(what.into()));
    }
    let mut random = stream(seed, DRAWING_STREAM);
    let (mut machine, mut changes) = (file.clone(), Vec::new());
    for (kind, sd) in &deviations.kinds {
        let t = truncated(&mut random);
        let changed = |t: f64| {
            let mut changed = machine.clone();
            kind.change(&mut changed, 1.0 + sd * t, sd * t);
            changed.validate().is_ok().then_some((t, changed))
        };
        if let Some((t, changed)) = changed(t).or_else(|| changed(-t)) {
            machine = changed;
            changes.push(DrawingChange { what: kind.name(file), change: sd * t, deviations: t });
        }
    }
    assign_loads(&mut machine);
    Ok((machine, changes))
}

/// A standard normal deviate within [`LARGEST_SD`].
fn truncated(random: &mut StdRng) -> f64 {
    loop {
        let t: f64 = random.sample(StandardNormal);
        if t.abs() <= LARGEST_SD {
            return t;
        }
    }
}
