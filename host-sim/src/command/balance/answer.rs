//! What `balance` answers.

use rotor_edge_desktop::balance::Balanced;

/// Weights by both ways, and how they are told.
pub struct BalanceResult {
    /// Name of the way and what it gave.
    pub ways: Vec<(&'static str, Balanced)>,
    /// Names of the correction planes.
    pub planes: Vec<String>,
    /// Speeds at which vibration counts, rpm.
    pub range_rpm: [f64; 2],
    /// Speed of the grade, rpm.
    pub service_rpm: f64,
    /// Whether angles count against the rotation.
    pub against_rotation: bool,
    /// What could not be done, one sentence each.
    pub remarks: Vec<String>,
}
