//! Shape functions of reduced models, and the shaft on them element by element.

pub mod basis;
mod modes;
pub mod nodal;
pub mod sizes;
pub mod strain;
