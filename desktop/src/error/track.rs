//! Reasons why a record cannot be followed.

#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrackError {
    /// The rotor has not exactly two bearings.
    #[error("a record is followed on two bearings, {given} are given; compare and diagnose take any number")]
    Bearings { given: usize },
    /// A bearing's coefficients depend on speed, load or amplitude, or are learned.
    #[error(
        "a record is followed on bearings with constant coefficients; state those of \"{bearing}\" at the record's speed as \
         stiffness_n_m and damping_n_s_m"
    )]
    VaryingBearing { bearing: String },
    /// The file has a foundation.
    #[error(
        "a record is followed on rigid ground or pedestals; the file has a [foundation]; compare and diagnose take it"
    )]
    Foundation,
    /// A probe moves with its housing.
    #[error(
        "a record is followed by probes on the ground; probe \"{probe}\" is mounted on a housing that moves"
    )]
    MovingProbe { probe: String },
    /// The rotor has an effect that depends on the amplitude.
    #[error("tracking takes supports as linear, and the rotor has {effect}; leave it out")]
    NonlinearEffect { effect: String },
    /// The file says that planes are identified and a plane has no unbalance.
    #[error("plane {plane} has no unbalance_g_mm; `identify` writes it")]
    PlaneNotIdentified { plane: String },
    /// A weight of a run is in no plane.
    #[error(
        "run \"{run}\" has a weight at {position_m} m, where no plane is; a record is followed with weights in planes"
    )]
    WeightOutsidePlanes { run: String, position_m: f64 },
    /// Too few readings have all probes.
    #[error("the record has {complete} complete readings, tracking needs at least {needed}")]
    TooFewReadings { complete: usize, needed: usize },
    /// The residual of the first days is larger than that of bearings in their usual range.
    #[error(
        "no bearings explain the first days: a residual of {:.0} % of the features, where bearings that wander leave up to \
         {:.0} %; expected a record (and a run-up) that begins before the event, of the machine that the rotor's file describes",
        100.0 * .residual_ratio,
        100.0 * .limit
    )]
    FirstDaysUnexplained { residual_ratio: f64, limit: f64 },
    /// The unbalance that fits the noise alone is too large beside that which explains the reading.
    #[error(
        "one reading cannot tell the unbalance of planes {} apart: noise alone looks like up to {noise_g_mm:.0} g·mm, where \
         {explains_g_mm:.0} g·mm explain the reading; keep the planes in which the machine is balanced, or follow readings that \
         stand further out of the noise",
        .planes.join(", ")
    )]
    PlanesInNoise { planes: Vec<String>, noise_g_mm: f64, explains_g_mm: f64 },
    /// There are more planes than probes.
    #[error(
        "one reading cannot tell the unbalance of planes {} apart: there are {probes} probes; keep the planes in which the \
         machine is balanced, or follow readings that stand further out of the noise",
        .planes.join(", ")
    )]
    MorePlanesThanProbes { planes: Vec<String>, probes: usize },
    /// A later run-up shows the machine as it was at first.
    #[error(
        "nothing changed before the later run-up of day {time_d}: expected one that was taken after an event"
    )]
    NoEventBefore { time_d: f64 },
}
