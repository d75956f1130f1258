//! What takes minutes.

mod hidden;
