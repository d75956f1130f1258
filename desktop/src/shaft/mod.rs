//! The shaft with its disks: finite elements, modes of a uniform beam, static loads.

pub mod assumed_modes;
pub mod elements;
pub mod mesh;
pub mod statics;
pub mod structure;
