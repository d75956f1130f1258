//! The glossary: the terms of the program's answers, with their meanings.

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

pub const fn word(
    kind: Kind,
    name: &'static str,
    also: &'static [&'static str],
    what: &'static str,
    next: &'static str,
) -> Word {
    Word { kind, name, also, what, next }
}

/// Verdicts of a diagnosis and states of a monitor.
pub const VERDICTS_AND_STATES: &[Word] = &[
    word(
        Kind::Verdict,
        "adequate",
        &[],
        "The model explains the measurements. Noise alone is more probable than all missing effects together, and \
         the data determine the unbalance of every plane.",
        "Deploy the model, or follow the unbalance with `rotor-edge track`.",
    ),
    word(
        Kind::Verdict,
        "missing",
        &[],
        "One physical effect is missing in the model. Noise alone is less than 5 % probable, and every other effect has \
         less than a twentieth of its probability. With the effect, the model predicts speeds that were left out of the fit.",
        "Inspect what the diagnosis names, then let `rotor-edge improve` add the effect.",
    ),
    word(
        Kind::Verdict,
        "undecided",
        &[],
        "An effect may be missing, but several explanations fit equally well. The diagnosis names them, and the \
         measurement that would tell them apart.",
        "Make that measurement. It is often a run-up, or a run with a trial weight.",
    ),
    word(
        Kind::Verdict,
        "not_determined",
        &[],
        "The model fits, but the data do not determine the unbalance. The 95 % region of a plane contains zero, \
         so even the side of the shaft is unknown.",
        "Measure more speeds or a run with a trial weight, or ask for fewer planes.",
    ),
    word(
        Kind::Verdict,
        "unknown",
        &[],
        "An effect is missing that is not in the list of known effects. The diagnosis says where along the shaft \
         the missing force acts, how it grows with speed, and in which direction it whirls.",
        "Check the drawing and the probes near that place. The diagnosis lists the known effects that look \
         similar.",
    ),
    word(
        Kind::State,
        "no model",
        &[],
        "The monitor has no model, or cannot use the stored one.",
        "Deploy a model with `rotor-edge deploy`.",
    ),
    word(
        Kind::State,
        "waiting",
        &[],
        "The monitor has a model, but has not judged a reading since it started.",
        "Check that readings are sent, and that they carry this monitor's number.",
    ),
    word(
        Kind::State,
        "learning",
        &[],
        "The monitor judges readings and records its reference, the mean residual after a deployment. It takes \
         one minute and at least ten readings.",
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
        "The residual is above the noise and above its usual level or reference, or the unbalance grew faster \
         than allowed. After ten seconds and three readings the state becomes `flagged`.",
        "Wait for the flag, or look at the trend with `rotor-edge watch`.",
    ),
    word(
        Kind::State,
        "flagged",
        &["flag"],
        "The model no longer describes the machine. The flag stays, also after a loss of power, until it is \
         acknowledged or another model is deployed.",
        "Record a run-up, run `rotor-edge improve` and deploy the result. If the cause is known, run `rotor-edge \
         acknowledge`.",
    ),
    word(
        Kind::State,
        "blind",
        &[],
        "Readings arrive but cannot be judged. Possible reasons are a missing keyphasor, a speed out of range, \
         impossible values, or too few working probes.",
        "Check the probe, cable and keyphasor that the reason names.",
    ),
    word(
        Kind::State,
        "stale",
        &[],
        "No reading was judged within the age limit, ten seconds by default.",
        "Find out why readings stopped: check the machine, the sender and the bus.",
    ),
    word(
        Kind::State,
        "conflict",
        &[],
        "Another monitor uses the same number. Each detects the other and stops sending.",
        "Give one of them another number.",
    ),
    word(
        Kind::State,
        "listening",
        &[],
        "The monitor just started and listens for a tenth of a second whether its number is free.",
        "",
    ),
];
