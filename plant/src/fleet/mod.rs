//! Jobs over many machines: each is one command of the desk over one machine's readings.
//!
//! | module | holds |
//! |---|---|
//! | [`machines`] | which machine a monitor watches |
//! | [`record`] | a machine's readings as a measurement file |
//! | [`queue`] | jobs with leases: each is done once, whoever is killed |
//! | [`worker`] | takes jobs and does them |

pub mod machines;
pub mod queue;
pub mod record;
pub mod worker;
