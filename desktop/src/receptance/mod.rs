//! The response of a shaft on any supports: the shaft solved once, supports put on it by a small update.

pub mod plant;
#[cfg(test)]
mod tests;
pub mod update;
