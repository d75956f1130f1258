//! The shaft with its disks: finite elements, the shape functions of reduced models, the loads of its weight.

pub mod assumed_modes;
pub mod basis;
pub mod elements;
pub mod mesh;
mod modes;
pub mod nodal;
pub mod statics;
pub mod structure;
