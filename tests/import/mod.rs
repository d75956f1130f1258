//! What tests of imports share.

pub mod exports;
pub mod truth;
