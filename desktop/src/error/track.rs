//! Reasons why a record cannot be followed.

#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrackError {
    /// No bearing has a number that may change: all of them are magnetic.
    #[error(
        "`track` needs a bearing with coefficients, a table or a film, and the rotor has magnetic supports alone; use `compare` or \
         `diagnose`"
    )]
    NothingToFollow,
    /// The file has a foundation.
    #[error(
        "`track` needs bearings on rigid ground or pedestals, and the file has a [foundation]; use `compare` or `diagnose`"
    )]
    Foundation,
    /// A probe moves with its housing.
    #[error("`track` needs probes on the ground, and probe \"{probe}\" is mounted on a housing that moves")]
    MovingProbe { probe: String },
    /// The rotor has an effect that depends on the amplitude.
    #[error("`track` needs linear supports, and the rotor has {effect}; remove it from the rotor's file")]
    NonlinearEffect { effect: String },
    /// The file says that planes are identified and a plane has no unbalance.
    #[error("plane {plane} has no unbalance_g_mm; `identify` writes it")]
    PlaneNotIdentified { plane: String },
    /// A weight of a run is in no plane.
    #[error("run \"{run}\" has a weight at {position_m} m, expected weights at the positions of [[plane]]")]
    WeightOutsidePlanes { run: String, position_m: f64 },
    /// Too few readings have all probes.
    #[error("the record has {complete} complete readings, `track` needs at least {needed}")]
    TooFewReadings { complete: usize, needed: usize },
    /// The residual of the first days is larger than that of bearings in their usual range.
    #[error(
        "no bearings explain the first days: the residual is {:.0} % of the features, at most {:.0} % is normal; expected a \
         record (and a run-up) of this rotor that begins before the event",
        100.0 * .residual_ratio,
        100.0 * .limit
    )]
    FirstDaysUnexplained { residual_ratio: f64, limit: f64 },
    /// The unbalance that fits the noise alone is too large beside that which explains the reading.
    #[error(
        "one reading cannot separate the unbalance of planes {}: noise alone looks like up to {noise_g_mm:.0} g·mm, the whole \
         reading like {explains_g_mm:.0} g·mm; keep the balancing planes alone, or follow readings with less noise",
        .planes.join(", ")
    )]
    PlanesInNoise { planes: Vec<String>, noise_g_mm: f64, explains_g_mm: f64 },
    /// There are more planes than probes.
    #[error(
        "one reading of {probes} probes cannot separate the unbalance of planes {}; keep the balancing planes alone",
        .planes.join(", ")
    )]
    MorePlanesThanProbes { planes: Vec<String>, probes: usize },
    /// A later run-up shows the machine as it was at first.
    #[error("the later run-up of day {time_d} shows no change, expected a run-up after an event")]
    NoEventBefore { time_d: f64 },
    /// An outage lies outside the record, or ends before it begins.
    #[error(
        "the outage from day {from_d} to day {to_d} is none of this record; expected two ascending days from {first_d} to \
         {last_d}"
    )]
    OutageOutside { from_d: f64, to_d: f64, first_d: f64, last_d: f64 },
    /// Two outages have days in common.
    #[error(
        "the outages from day {from_d} to day {to_d} and from day {other_from_d} to day {other_to_d} overlap; state them as one"
    )]
    OutagesOverlap { from_d: f64, to_d: f64, other_from_d: f64, other_to_d: f64 },
    /// The machine turned within an outage.
    #[error(
        "the outage from day {from_d} to day {to_d} has a reading on day {time_d}; expected none before its end"
    )]
    ReadingInOutage { from_d: f64, to_d: f64, time_d: f64 },
    /// The machine after an outage cannot be identified.
    #[error("after the outage from day {from_d} to day {to_d}: {why}")]
    AfterOutage { from_d: f64, to_d: f64, why: String },
}
