//! Statistics of measurements and unknowns, without a machine in them.
//!
//! | module | holds |
//! |---|---|
//! | [`scatter`], [`between_runs`] | how measured noise differs from stated: size, correlation, from run to run |
//! | `allowance`, [`whitening`] | linear errors with a Gaussian prior, and all of it as one correlated noise |
//! | [`evidence`], [`significance`] | Bayes factors, and the words that they entitle to |
//! | [`interval`] | 95 % intervals |
//! | `contradiction` | stated numbers that data contradict |
//! | [`scale`], [`convergence`] | search coordinates; when Markov chains have met |

pub(crate) mod allowance;
pub mod between_runs;
pub(crate) mod contradiction;
pub mod convergence;
pub mod evidence;
pub mod interval;
pub mod scale;
pub mod scatter;
pub mod significance;
pub mod whitening;
