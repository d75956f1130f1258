//! Machines that physics does not know: each number of a rotor file and of a deployed model out of its bounds, in turn and
//! at random. None is accepted, so none is deployed.

#[path = "absurd/files.rs"]
mod files;
#[path = "absurd/models.rs"]
mod models;
#[path = "absurd/values.rs"]
mod values;
