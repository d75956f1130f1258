//! The shaft with its disks: finite elements, and the shape functions of reduced models.

pub mod assumed_modes;
pub mod basis;
pub mod elements;
pub mod nodal;
pub mod structure;
