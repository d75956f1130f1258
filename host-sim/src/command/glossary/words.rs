//! The glossary: every word that the program says and a newcomer may not know.

/// What kind of word it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// What `diagnose` says.
    Verdict,
    /// What a monitor says of itself.
    State,
    /// A quantity or a term of the trade.
    Term,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Word {
    pub kind: Kind,
    pub name: &'static str,
    /// Other ways to write it.
    pub also: &'static [&'static str],
    pub what: &'static str,
    /// What to do; empty where there is nothing to do.
    pub next: &'static str,
}

const fn word(
    kind: Kind,
    name: &'static str,
    also: &'static [&'static str],
    what: &'static str,
    next: &'static str,
) -> Word {
    Word { kind, name, also, what, next }
}

/// All of them but the effects, which the desktop crate explains.
pub const WORDS: &[Word] = &[
    word(
        Kind::Verdict,
        "adequate",
        &[],
        "The model explains the measurements: nothing but noise is more probable than all missing effects together, \
         and the data determine the unbalance of every plane.",
        "Deploy the model, or follow the unbalance with `rotor-edge track`.",
    ),
    word(
        Kind::Verdict,
        "missing",
        &[],
        "One physical effect is missing in the model: nothing but noise is less than 5 % probable, no other effect has \
         a twentieth of its probability, and it predicts speeds that were left out.",
        "Inspect what the diagnosis names, then let `rotor-edge improve` add the effect.",
    ),
    word(
        Kind::Verdict,
        "undecided",
        &[],
        "Something may be missing, or is, but several explanations fit alike. The diagnosis names them, and the \
         measurement that would tell them apart.",
        "Take that measurement: often a run-up, or a run with a trial weight.",
    ),
    word(
        Kind::Verdict,
        "not_determined",
        &[],
        "The model fits, but the data do not fix the unbalance: the 95 % region of a plane holds zero, so that not even \
         the side of the shaft is known.",
        "Measure more speeds or a run with a trial weight, or ask for fewer planes.",
    ),
    word(
        Kind::Verdict,
        "unknown",
        &[],
        "Something is missing that none of the known effects explains. The diagnosis says where along the shaft the \
         missing force acts, how it grows with speed, and which way it turns.",
        "Check the drawing and the probes near that place; what looks like it is listed.",
    ),
    word(
        Kind::Term,
        "size that matters",
        &["sizes that matter", "relevant size"],
        "The size at which an effect changes the vibration by a tenth, root mean square over the planned readings. \
         `rotor-edge plan` counts an effect as found if it is found there with 90 % probability.",
        "",
    ),
    word(
        Kind::Term,
        "expected information",
        &["gain of a measurement", "bits"],
        "By how much a measurement is expected to lower the uncertainty, in bits: one bit halves the number of effects that \
         could be missing, or the area of the 95 % region of a plane's unbalance.",
        "Make the measurement that has most of it for the least effort.",
    ),
    word(
        Kind::State,
        "no model",
        &[],
        "The monitor holds no model, or cannot use the one that is stored.",
        "Deploy one with `rotor-edge deploy`.",
    ),
    word(
        Kind::State,
        "waiting",
        &[],
        "The monitor has a model, and no reading was judged since it started.",
        "Send readings; check who sends them, and to which number.",
    ),
    word(
        Kind::State,
        "learning",
        &[],
        "The monitor judges readings and takes its reference: the mean residual of the first minute and ten readings \
         after a deployment.",
        "",
    ),
    word(
        Kind::State,
        "tracking",
        &["healthy"],
        "The model describes the machine: the residual is small, and the last reading is recent.",
        "",
    ),
    word(
        Kind::State,
        "suspicious",
        &[],
        "The residual is above the noise and above its own level or reference, or the unbalance grew faster than it may. \
         It becomes a flag after ten seconds and three readings.",
        "Wait for the flag, or look at the trend with `rotor-edge watch`.",
    ),
    word(
        Kind::State,
        "flagged",
        &["flag"],
        "The model stopped describing the machine. The flag stays, over losses of power too, until somebody \
         acknowledges it or deploys another model.",
        "Record a run-up, run `rotor-edge improve`, deploy the result; or `rotor-edge acknowledge`.",
    ),
    word(
        Kind::State,
        "blind",
        &[],
        "Readings arrive and cannot be judged: no keyphasor, a speed out of range, values that cannot be, or too few \
         probes left for the planes.",
        "Check the probe, cable and keyphasor that the reason names.",
    ),
    word(
        Kind::State,
        "stale",
        &[],
        "Nothing was judged for longer than evidence lasts, ten seconds unless stated otherwise.",
        "See why readings stopped: the machine, who sends them, the bus.",
    ),
    word(
        Kind::State,
        "conflict",
        &[],
        "Another monitor uses the same number; each hears the other and falls silent.",
        "Give one of them another number.",
    ),
    word(
        Kind::State,
        "listening",
        &[],
        "The monitor just started and listens for a tenth of a second whether its number is free.",
        "",
    ),
    word(
        Kind::Term,
        "1x",
        &[],
        "The part of the vibration at running speed: a vector of amplitude and phase, or of a cosine and a sine.",
        "",
    ),
    word(
        Kind::Term,
        "2x",
        &[],
        "The part at twice the running speed; it grows with misalignment, a crack, or a shaft that is not round.",
        "Extract it from waveforms with `rotor-edge extract --two-x`.",
    ),
    word(
        Kind::Term,
        "keyphasor",
        &["mark"],
        "A probe that sees a mark on the shaft once a turn. Phases count from there: t = 0 when the mark passes.",
        "",
    ),
    word(
        Kind::Term,
        "lag",
        &["phase lag", "phase"],
        "The angle that the shaft turns from the keyphasor's mark to the vibration's positive peak, degrees. A lead is its \
         negative; taking one for the other mirrors every angle.",
        "",
    ),
    word(
        Kind::Term,
        "pk-pk",
        &["0-pk"],
        "Peak to peak, the whole travel, which monitors show. Files and models here hold half of it: zero to peak, 0-pk.",
        "",
    ),
    word(
        Kind::Term,
        "feature",
        &["features", "f", "feature sum"],
        "One component of one probe's 1x vector, cosine or sine, µm 0-pk: two probes at each of two bearings give eight. \
         The feature sum is the sum of their magnitudes.",
        "",
    ),
    word(
        Kind::Term,
        "residual",
        &["e", "e/f", "misfit"],
        "Difference of model and measurement: the sum over all features of |model − measured|, µm. As a share of the \
         feature sum it says how well the model fits: a few percent is noise, tens of percent is missing physics.",
        "If it stays high, `rotor-edge diagnose` says what is missing.",
    ),
    word(
        Kind::Term,
        "χ² per value",
        &["χ²", "chi2", "chi2_per_value"],
        "Squared residuals in standard deviations of the noise, a mean over all values. Noise alone gives one; far above \
         one, an effect is missing; far below, the noise was stated too large.",
        "",
    ),
    word(
        Kind::Term,
        "unbalance",
        &["U", "U_g"],
        "Mass times its distance from the axis, g·mm, in a plane across the shaft, at an angle from the keyphasor's \
         mark. It pulls as the square of the speed.",
        "",
    ),
    word(
        Kind::Term,
        "static unbalance",
        &["static", "dynamic unbalance", "couple"],
        "The vector sum of the planes is the static unbalance; what is left, opposite in the two planes, is the couple, \
         or dynamic unbalance.",
        "",
    ),
    word(
        Kind::Term,
        "influence coefficient",
        &["influence coefficients"],
        "Vibration of a probe at one speed, amplitude and phase, for a unit of unbalance in a plane. Trial runs measure \
         it; a model computes it.",
        "",
    ),
    word(
        Kind::Term,
        "trial weight",
        &["trial run", "trial weights"],
        "A known mass at a known place, added for one run, so that the change of vibration shows how the machine answers.",
        "State it in `[[run]]` of the rotor's file.",
    ),
    word(
        Kind::Term,
        "condition number",
        &["condition", "poorly determined"],
        "How nearly two planes act alike on the probes. An error of one percent in the model moves the weakest \
         combination of planes by this many percent; above 10 they count as poorly determined.",
        "Measure at more speeds or more places along the shaft, or ask for fewer planes.",
    ),
    word(
        Kind::Term,
        "forward whirl",
        &["backward whirl", "whirl"],
        "The shaft's centre circles in the direction of rotation, or against it. Unbalance drives it forward; supports that \
         differ along x and y add a backward part, and orbits become ellipses.",
        "",
    ),
    word(
        Kind::Term,
        "critical speed",
        &["resonance", "undamped critical speed", "damped critical speed"],
        "A speed at which a natural frequency of the turning shaft equals the speed: unbalance is answered with the \
         largest vibration, and the phase turns.",
        "`rotor-edge check` computes them.",
    ),
    word(
        Kind::Term,
        "log decrement",
        &[],
        "How fast a mode dies out: the logarithm of one swing over the next. Below zero the machine is unstable; API asks \
         for 0.1 at least.",
        "",
    ),
    word(
        Kind::Term,
        "trial unbalance",
        &[],
        "A known unbalance for which `rotor-edge check` computes the vibration. It stands for no residual unbalance of the \
         machine: the response is linear, so twice the unbalance gives twice the vibration.",
        "",
    ),
    word(
        Kind::Term,
        "amplification factor",
        &["amplification"],
        "How sharp the peak of a critical speed is: its speed over the distance of the two speeds beside it where the \
         amplitude is 0.707 of the peak. Without damping it has no limit; below 2.5 a critical speed counts as critically \
         damped.",
        "Large values call for more damping at the bearings, or for a running range further from that speed.",
    ),
    word(
        Kind::Term,
        "separation margin",
        &["margin"],
        "Distance of a critical speed from the nearest running speed, in percent of that running speed. The margin that \
         is needed grows with the amplification factor; a critical speed with a factor below 2.5 needs none.",
        "State the running range with `rotor-edge check --rpm A..B`.",
    ),
    word(
        Kind::Term,
        "eccentricity ratio",
        &["eccentricity", "ε"],
        "Distance of the journal's centre from the bearing's centre over the radial clearance: 0 in the middle, 1 at the \
         wall. Lightly loaded bearings run near 0, where oil whirl is likely.",
        "",
    ),
    word(
        Kind::Term,
        "attitude angle",
        &["attitude"],
        "Angle, degrees, from the direction of the load to the line through the centres of bearing and journal, in the \
         direction of rotation. Near 90° in a lightly loaded plain bearing, small in one with tilting pads.",
        "",
    ),
    word(
        Kind::Term,
        "gap voltage",
        &["gap"],
        "The mean voltage of a proximity probe: where the shaft runs in its bearing. Beside an oil film it is evidence of \
         load, clearance and viscosity.",
        "",
    ),
    word(
        Kind::Term,
        "simulated truth",
        &["truth file"],
        "What a simulated machine has and its file does not say: effects with their parameters, the unbalance of each plane, and \
         where the machine differs from its drawing.",
        "Write it with `rotor-edge simulate --truth`, and hold the diagnosis against it.",
    ),
    word(
        Kind::Term,
        "slow roll",
        &[],
        "A speed at which unbalance does nothing yet: a probe then shows its runout, of a track that is not round or is \
         magnetic.",
        "Take it off with `--slow-roll`.",
    ),
    word(
        Kind::Term,
        "interval",
        &["95 %", "interval_95"],
        "The range that holds the true value in 95 of 100 cases, if the model and its noise are right.",
        "",
    ),
    word(
        Kind::Term,
        "evidence",
        &["probability"],
        "How probable the measurements are under an explanation, all sizes of its parameters weighed: an effect with more \
         freedom pays for it.",
        "",
    ),
    word(
        Kind::Term,
        "message authentication code",
        &["MAC"],
        "Eight bytes that only a holder of the monitor's key can compute for a frame. A frame with a wrong code is \
         ignored.",
        "Start the monitor with `rotor-edge node --sealed`, and give its key to `watch` and `decode`.",
    ),
    word(
        Kind::Term,
        "nonce",
        &[],
        "A number that only grows and is part of each message authentication code, so that a recorded frame is not \
         accepted again.",
        "",
    ),
    word(
        Kind::Term,
        "phase I",
        &["identification", "identify"],
        "Bearings and unbalance are found together, on the desk, from the first days and a run-up.",
        "",
    ),
    word(
        Kind::Term,
        "phase II",
        &[],
        "Only the unbalance is followed, from reading to reading, on the controller; bearings stay as phase I found them.",
        "",
    ),
];
