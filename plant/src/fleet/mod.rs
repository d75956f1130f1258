//! Jobs over many machines: each is one command of the desk over one machine's readings, or one deployment.
//!
//! | module | holds |
//! |---|---|
//! | [`machines`] | which machine a monitor watches |
//! | [`record`] | a machine's readings as a measurement file |
//! | [`task`] | one command with all that it needs, and what came of it |
//! | [`queue`] | jobs in a store with leases: each is done once, whoever is killed |
//! | [`worker`] | takes jobs of a store and does them |
//! | [`server`] | jobs on a NATS server: shared by who has the store, done by workers of any host |
//! | [`summary`] | what a plant wants to know: what changed, what is missing, what to deploy |

pub mod machines;
pub mod queue;
pub mod record;
pub mod server;
pub mod summary;
pub mod task;
pub mod worker;
