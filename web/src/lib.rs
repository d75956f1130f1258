//! What the pages that programs of rotor-edge serve have in common.
//!
//! | module | holds |
//! |---|---|
//! | [`connection`] | how many connections there may be, and how long a client may take to ask |
//! | [`host`] | the host that a request names |
//! | [`token`] | secrets that let a client in |

pub mod connection;
pub mod host;
pub mod token;
