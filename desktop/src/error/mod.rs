//! What can be wrong with a user's input, in one sentence each.

mod film;
mod forecast;
mod startup;
mod track;

pub use film::FilmError;
pub use forecast::ForecastError;
pub use startup::StartupError;
pub use track::TrackError;

/// A problem with the input or with what was asked of it.
///
/// Every message is one sentence that names the file and the key or row and says what was expected.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be read or written.
    #[error("{file}: {reason}")]
    File {
        /// The path as the user gave it.
        file: String,
        /// What the operating system said.
        reason: String,
    },
    /// A key of `rotor.toml` is missing, unknown or out of range.
    #[error("{file}: {key}: {expected}")]
    Rotor {
        /// The path as the user gave it.
        file: String,
        /// The key, as it would be written in the file.
        key: String,
        expected: String,
    },
    /// A row or column of a file of measurements, or of a bearing's table, cannot be used.
    #[error("{file}: {place}: {expected}")]
    Measurement {
        /// The path as the user gave it.
        file: String,
        /// The row or column.
        place: String,
        expected: String,
    },
    /// Phases were entered the wrong way round, lag as lead; whatever is made of them is wrong.
    #[error("{0}")]
    ReversedPhases(String),
    /// The covariance of what differs between runs cannot be inverted.
    #[error(
        "the covariance between runs is singular: a probe has the same reading in every run, expected readings that scatter"
    )]
    SingularScatter,
    /// A correction plane was named that does not exist.
    #[error("there is no plane \"{plane}\", expected one of {}", quoted(.known).join(", "))]
    UnknownPlane { plane: String, known: Vec<String> },
    /// A hole was named by a number that its plane does not have.
    #[error("there is no hole {hole}, expected 1 to {count}")]
    UnknownHole { hole: usize, count: usize },
    /// Weights are to be added to a run that was not measured.
    #[error("there is no run \"{run}\" to add weights to, expected one of {}", .known.join(", "))]
    UnknownRun { run: String, known: Vec<String> },
    /// No reading lies in the range of speeds that was asked for.
    #[error("there is no reading between {from_rpm:.0} and {to_rpm:.0} rpm")]
    NoReadingInRange { from_rpm: f64, to_rpm: f64 },
    /// No run has a trial weight in a correction plane.
    #[error(
        "no run has a trial weight in plane \"{plane}\", so its influence coefficients are unknown; measure such a run and \
         state its weight"
    )]
    NoTrialWeight { plane: String },
    /// Trial weights of the runs are linearly dependent.
    #[error(
        "the trial weights are linearly dependent: {} need {} runs with independent trial weights at one speed, such as one \
         run without weights and one with a weight in each plane",
        counted_planes(*.planes),
        .planes + 1
    )]
    DependentTrialWeights { planes: usize },
    /// No speed was measured in as many runs as there are unknowns.
    #[error(
        "no speed between {slowest_rpm:.0} and {fastest_rpm:.0} rpm was measured in {} runs with independent trial weights, \
         which {} need{advice}",
        .planes + 1,
        counted_planes(*.planes)
    )]
    TooFewRuns { planes: usize, slowest_rpm: f64, fastest_rpm: f64, advice: String },
    /// No weight in a correction plane changes the vibration.
    #[error("a weight in plane \"{plane}\" changes no probe's reading; remove the plane, or add a probe")]
    PlaneWithoutEffect { plane: String },
    /// Influences of the correction planes are linearly dependent.
    #[error(
        "the correction planes have the same effect on every probe at these speeds; choose fewer planes, or more speeds"
    )]
    PlanesActAlike,
    /// The effect of a trial weight is no larger than the noise.
    #[error(
        "the effect of the trial weight in plane \"{plane}\" is below the noise; repeat with a larger trial weight, or with \
         more readings"
    )]
    EffectBelowNoise { plane: String },
    /// Runs contradict each other by more than the trial weights change.
    #[error(
        "the runs contradict each other by {percent:.0} % of the vibration, which hides the effect of the trial weights; check the \
         weights and readings of each run and the sign of the phases, or repeat the runs"
    )]
    ContradictingRuns { percent: f64 },
    /// Influences of these correction planes differ by no more than the noise.
    #[error(
        "the difference between the planes {} is below the noise; repeat with larger trial weights or more readings, or \
         choose fewer planes",
        quoted(.planes).join(" and ")
    )]
    DifferenceBelowNoise { planes: Vec<String> },
    /// A measurement has another unit than the coefficients that were kept.
    #[error("the measurement is in {measured} and the coefficients are in {kept}, expected one unit")]
    UnitMismatch { measured: String, kept: String },
    /// The base run that was named was not measured.
    #[error("the data have no run \"{run}\", expected the name of the base run")]
    UnknownBaseRun { run: String },
    /// The base run that was named has weights.
    #[error("the base run \"{run}\" has weights in the rotor's file, expected a run without")]
    WeightedBaseRun { run: String },
    /// Several runs could be the base run.
    #[error("several runs are without weights ({}); name the base run with --base", .runs.join(", "))]
    AmbiguousBaseRun { runs: Vec<String> },
    /// A probe has no reading.
    #[error("probe {probe} has no reading; state used = false for it in the rotor's file")]
    SilentProbe { probe: String },
    /// A probe shows one value at every speed.
    #[error(
        "probe {probe} has the same reading at every speed: it is stuck or dead; state used = false for it in the rotor's file"
    )]
    StuckProbe { probe: String },
    /// A probe shows its largest value in several readings.
    #[error(
        "probe {probe} has its largest reading, {level_um:.2} µm, {readings} times: it is clipped; leave those cells empty"
    )]
    ClippedProbe { probe: String, level_um: f64, readings: usize },
    /// There are more readings than a fit takes.
    #[error(
        "the data have {number} readings, a fit accepts at most {most}; keep one in {}, as readings of one run at one speed \
         are alike",
        .number.div_ceil(*.most)
    )]
    TooManyReadings { number: usize, most: usize },
    /// There are no more values than unknowns.
    #[error(
        "{values} measured values cannot determine {unknowns} unknowns of bearings and planes; measure at more speeds"
    )]
    TooFewValues { values: usize, unknowns: usize },
    /// No fit of the model comes near the data.
    #[error(
        "the data look like those of another machine: with the best bearings and unbalance, the model of \"{rotor}\" still \
         misses {:.0} % of the vibration; check both files",
        .relative_error * 100.0
    )]
    AnotherMachine { rotor: String, relative_error: f64 },
    /// An effect is in the model already, or cannot be searched for on this rotor.
    #[error("{effect} {why}")]
    EffectNotAddable { effect: String, why: String },
    /// There is no such effect, or it cannot act there.
    #[error("{0}")]
    UnknownEffect(String),
    /// The dynamic stiffness cannot be inverted at a speed.
    #[error("the model is singular at {speed_rad_s:.1} rad/s")]
    SingularModel { speed_rad_s: f64 },
    /// The dynamic stiffness cannot be inverted with any bearings that were tried.
    #[error("the machine is singular {tried}")]
    SingularMachine {
        /// The bearings, with their preposition.
        tried: &'static str,
    },
    /// The iteration of amplitude and stiffness of nonlinear supports does not converge.
    #[error(
        "the iteration for the amplitude at the supports does not converge at {speed_rpm:.0} rpm; check the nonlinear supports"
    )]
    AmplitudeNotSettled { speed_rpm: f64 },
    /// The iteration for the damped modes does not converge.
    #[error("the modes at {speed_rpm:.0} rpm do not converge")]
    ModesNotConverged { speed_rpm: f64 },
    /// A response to the rotor's own unbalance is asked for, and its planes state none.
    #[error(
        "no [[plane]] states an unbalance; expected unbalance_g_mm and angle_deg in at least one of them"
    )]
    NoOwnUnbalance,
    /// A horizontal shaft has fewer than two bearings.
    #[error("{given} bearing given, a horizontal shaft needs two to carry its weight")]
    TooFewBearings { given: usize },
    /// There are not as many heights as bearings.
    #[error("{given} elevations given for {bearings} bearings")]
    Elevations { given: usize, bearings: usize },
    /// The height of a bearing is infinite or not a number.
    #[error("an elevation is {elevation_m} m, expected a finite number")]
    ElevationNotFinite { elevation_m: f64 },
    /// Two bearings are at one place.
    #[error("bearings \"{}\" and \"{}\" are at the same place", .bearings[0], .bearings[1])]
    BearingsAtOnePlace { bearings: [String; 2] },
    /// There are fewer measured values than planes.
    #[error("{values} measured values cannot fix the unbalance of {planes} planes")]
    TooFewValuesForPlanes { values: usize, planes: usize },
    /// The data that were given hold no reading.
    #[error("there is no reading")]
    NoReading,
    /// A reading, counted from 1, names no run.
    #[error("reading {reading} names no run, expected a column run")]
    ReadingWithoutRun { reading: usize },
    /// The readings of a run state two sessions.
    #[error(
        "run \"{run}\" is in session \"{}\" and in session \"{}\", expected one session; give the runs different names",
        .sessions[0], .sessions[1]
    )]
    RunInTwoSessions { run: String, sessions: [String; 2] },
    /// A weight of a run is in no plane.
    #[error("run \"{run}\" has a weight at {position_m} m, where the rotor's file has no [[plane]]")]
    WeightOutsidePlanes { run: String, position_m: f64 },
    /// No run of the data has a weight in the rotor's file.
    #[error(
        "no run of the data has a [[run]] with added_unbalance in the rotor's file, expected at least one beside the base run"
    )]
    NoWeightedRun,
    /// No run is without weights.
    #[error(
        "no run of the data has a [[run]] without weights in the rotor's file; name the base run with --base"
    )]
    NoBaseRun,
    /// No run has a speed of the base run.
    #[error("no speed of the base run \"{base}\" was measured in another run, expected common speeds")]
    NoCommonSpeed { base: String },
    /// No other run has readings around the speeds of a run.
    #[error(
        "no run has two speeds within {:.0} % around one of run \"{run}\", expected run-ups that overlap",
        100.0 * .within
    )]
    NoOverlap {
        run: String,
        /// Largest distance of two speeds, relative.
        within: f64,
    },
    /// No reading is at a speed of the influence coefficients that were kept.
    #[error(
        "no probe was measured at a speed of the coefficients, within {:.2} % (--same-speed): they have {known}",
        100.0 * .within
    )]
    NoKeptSpeed {
        /// Largest distance of two speeds, relative.
        within: f64,
        /// Probes and speeds of the coefficients.
        known: String,
    },
    #[error(transparent)]
    Film(#[from] FilmError),
    #[error(transparent)]
    Forecast(#[from] ForecastError),
    #[error(transparent)]
    Startup(#[from] StartupError),
    #[error(transparent)]
    Track(#[from] TrackError),
    /// The data do not allow what was asked.
    #[error("{0}")]
    Unsuitable(String),
}

impl Error {
    pub(crate) fn file(file: &str, reason: impl ToString) -> Self {
        Self::File { file: file.into(), reason: reason.to_string() }
    }

    pub(crate) fn rotor(file: &str, key: impl Into<String>, expected: impl Into<String>) -> Self {
        Self::Rotor { file: file.into(), key: key.into(), expected: expected.into() }
    }

    pub(crate) fn measurement(file: &str, place: impl Into<String>, expected: impl Into<String>) -> Self {
        let (place, expected) = (one_line(&place.into()), one_line(&expected.into()));
        Self::Measurement { file: file.into(), place, expected }
    }
}

fn quoted(names: &[String]) -> Vec<String> {
    names.iter().map(|name| format!("\"{name}\"")).collect()
}

fn counted_planes(planes: usize) -> String {
    format!("{planes} plane{}", if planes == 1 { "" } else { "s" })
}

/// A quotation mark that is never closed makes the rest of a file one cell, and messages quote cells.
fn one_line(text: &str) -> String {
    const LONGEST: usize = 200;
    let line = text.replace(['\r', '\n'], " ");
    match line.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &line[..end]),
        None => line,
    }
}
