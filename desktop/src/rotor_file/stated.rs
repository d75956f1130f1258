//! What a file states, apart from what a fit found.
//!
//! The numbers of a fitted file are the machine as it was found: that is what every command computes with. What
//! people stated of it before is the centre of the priors, and must stay so: a prior centred on what data have moved
//! counts the same data twice, and a fit repeated would drift away. So a fitted file keeps both, `stated` at each bearing and
//! `[tolerance.found]`, and a fit begins by taking them apart again.

use super::loads;
use crate::machine::drawing::Rotor;
use crate::machine::tolerance::Deviation;

impl Rotor {
    /// Whether a fit has moved bearings or drawing away from what was stated of them.
    pub fn is_fitted(&self) -> bool {
        self.bearing.iter().any(|b| b.stated.is_some())
            || self.tolerance.as_ref().is_some_and(|t| !t.found.is_empty())
    }

    /// The machine with bearings and drawing as they were stated before any fit; planes and effects, which have no prior,
    /// are as they are.
    pub fn as_stated(&self) -> Self {
        let mut stated = self.clone();
        if !self.is_fitted() {
            return stated;
        }
        for bearing in &mut stated.bearing {
            if let Some(law) = bearing.stated.take() {
                bearing.law = law;
            }
        }
        let found = stated.tolerance.as_mut().map(|t| std::mem::take(&mut t.found)).unwrap_or_default();
        for deviation in Deviation::all(self) {
            if let Some(by) = found.get(&deviation.name(self)) {
                deviation.change(&mut stated, (1.0 + by).recip(), -by);
            }
        }
        loads::assign_loads(&mut stated);
        stated
    }
}
