//! The shaft with its disks: finite elements, the modes of a uniform beam, the loads of its weight.

pub mod assumed_modes;
pub mod elements;
pub mod mesh;
pub mod statics;
pub mod structure;
