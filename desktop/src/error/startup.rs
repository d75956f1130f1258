//! Reasons why a start-up cannot be evaluated by the two-degree model.

#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StartupError {
    /// The rotor has not exactly one disk.
    #[error("the rotor has {given} disks; the two-degree model of a start-up needs exactly one [[disk]]")]
    Disks { given: usize },
    /// The rotor has not exactly two bearings.
    #[error("the two-degree model of a start-up needs two bearings, {given} are given")]
    Bearings { given: usize },
    /// The mass of the disk is zero and none is given.
    #[error("disk \"{disk}\" has no mass_kg, expected the mass for the two-degree model")]
    NoMass { disk: String },
    /// The shaft does not bend at the disk.
    #[error(
        "disk \"{disk}\" sits on a bearing, where the shaft does not bend: the two-degree model does not apply"
    )]
    DiskOnBearing { disk: String },
    /// Every run has weights whose angles are not stated.
    #[error("no run has known weights, so no rotor model can be fitted")]
    NoKnownWeights,
}
