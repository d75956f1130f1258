//! Which physical effect is missing in a model?
//!
//! Every effect, at every place where it can sit, is fitted on top of the model with bearings and planes
//! free, allowing for what the drawing's tolerances could have done. The fits are ranked by their evidence
//! (`statistics::evidence`) and turned into probabilities; the best must also predict speeds that it was
//! not fitted to. Where the data cannot decide, the answer says so, names the rivals, and says which
//! measurement would tell them apart.

pub(crate) mod advice;
mod answer;
mod as_file;
mod attempts;
pub(crate) mod base;
mod best_fit;
pub(crate) mod checks;
mod diagnosis;
mod evidence;
mod explained;
mod held_out;
mod holding;
mod improve;
mod instruments;
mod mistaken;
mod mistakes;
mod parameters;
pub(crate) mod planes;
pub(crate) mod rank;
mod rivals;
mod runs;
mod saturated;
mod screening;
mod sets;
pub(crate) mod sweep;
mod unknown;
mod verdict;

pub use crate::fit::dimensions::FittedDimension;
pub use crate::receptance::update::solved_responses;
pub use crate::statistics::scatter::Scatter;
pub use answer::{
    Advice, Candidate, Diagnosis, DiagnosisVerdict, HeldOut, RIVAL, SURE, SuspectedMistake, TooFast,
};
pub use best_fit::{BestFit, best_fit, fit_holding, judged_fit};
pub use diagnosis::{diagnose, diagnose_telling};
pub use holding::HeldParameter;
pub use improve::{Improvement, ImprovementOutcome, ImprovementStep, add, improve, improve_telling};
pub use parameters::FittedParameter;
pub use planes::{PlaneUnbalance, PlaneUnbalances};
pub use runs::{Account, FoundWeight, RefutedRun};
pub use unknown::{EquivalentForce, ForceGrowth, Nature, UnknownCause};
