//! The response of a shaft on any supports: solved once on nominal supports, then updated for the actual ones.

pub mod modal_shaft;
#[cfg(test)]
mod tests;
pub mod update;
