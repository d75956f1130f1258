//! Machines that physics does not know: each number of a rotor file and of a deployed model out of its bounds, in turn and
//! at random. None is accepted, so none is deployed.

mod files;
mod models;
mod values;
