//! Terms of the glossary: quantities, methods and instruments.

use super::words::{Kind, Word, word};

pub const TERMS: &[Word] = &[
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
        "Expected reduction of uncertainty by a measurement, in bits. One bit halves the number of possible \
         missing effects, or the area of the 95 % region of a plane's unbalance.",
        "Make the measurement with the most information for the least effort.",
    ),
    word(
        Kind::Term,
        "1x",
        &[],
        "The component of the vibration at running speed. It is a vector, given as amplitude and phase or as a \
         cosine and a sine part.",
        "",
    ),
    word(
        Kind::Term,
        "2x",
        &[],
        "The component of the vibration at twice the running speed. It grows with misalignment, a crack, or a \
         shaft that is not round.",
        "Extract it from waveforms with `rotor-edge extract --two-x`.",
    ),
    word(
        Kind::Term,
        "keyphasor",
        &["mark"],
        "A probe that detects a mark on the shaft once per revolution. All phases are measured from this mark: t \
         = 0 when it passes.",
        "",
    ),
    word(
        Kind::Term,
        "lag",
        &["phase lag", "phase"],
        "Phase lag: the angle in degrees through which the shaft turns from the keyphasor mark to the positive \
         peak of the vibration. A phase lead is its negative. Confusing them mirrors every angle.",
        "",
    ),
    word(
        Kind::Term,
        "pk-pk",
        &["0-pk"],
        "Peak to peak: the whole travel of the vibration, as monitors show it. Files and models use half of it, \
         zero to peak (0-pk).",
        "",
    ),
    word(
        Kind::Term,
        "feature",
        &["features", "f", "feature sum"],
        "One component, cosine or sine, of the 1x vector of one probe, in µm 0-pk. Two probes at each of two \
         bearings give eight features. The feature sum is the sum of their magnitudes.",
        "",
    ),
    word(
        Kind::Term,
        "residual",
        &["e", "e/f", "misfit"],
        "Difference between model and measurement: the sum of |model − measured| over all features, in µm. \
         Relative to the feature sum, a few percent is noise and tens of percent is missing physics.",
        "If it stays high, find the missing effect with `rotor-edge diagnose`.",
    ),
    word(
        Kind::Term,
        "χ² per value",
        &["χ²", "chi2", "chi2_per_value"],
        "Mean squared residual, in units of the noise variance. Noise alone gives 1. A value far above 1 means \
         that an effect is missing; far below 1, that the stated noise is too large.",
        "",
    ),
    word(
        Kind::Term,
        "unbalance",
        &["U", "U_g"],
        "Mass times its distance from the axis of rotation, in g·mm, in a plane across the shaft, at an angle \
         from the keyphasor mark. Its force is proportional to the square of the speed.",
        "",
    ),
    word(
        Kind::Term,
        "static unbalance",
        &["static", "dynamic unbalance", "couple"],
        "The static unbalance is the vector sum over the planes. The remainder, equal and opposite in the two \
         planes, is the couple, here called dynamic unbalance.",
        "",
    ),
    word(
        Kind::Term,
        "influence coefficient",
        &["influence coefficients"],
        "Vibration vector of a probe at one speed per unit of unbalance in a plane. It is measured with trial \
         runs or computed by a model.",
        "",
    ),
    word(
        Kind::Term,
        "trial weight",
        &["trial run", "trial weights"],
        "A known mass at a known place, added for one run. The change of the vibration shows how the machine \
         responds to unbalance.",
        "State the weight in `[[run]]` of the rotor file.",
    ),
    word(
        Kind::Term,
        "condition number",
        &["condition", "poorly determined"],
        "Measure of how similar the effects of the planes on the probes are. A model error of 1 % can become this \
         many percent in the least well determined combination of planes. Above 10, the split between planes is \
         unreliable.",
        "Measure at more speeds or at more places along the shaft, or use fewer planes.",
    ),
    word(
        Kind::Term,
        "forward whirl",
        &["backward whirl", "whirl"],
        "In forward whirl the shaft centre orbits in the direction of rotation, in backward whirl against it. \
         Unbalance excites forward whirl. Supports that differ along x and y add a backward part, so the orbit is \
         an ellipse.",
        "",
    ),
    word(
        Kind::Term,
        "critical speed",
        &["resonance", "undamped critical speed", "damped critical speed"],
        "A speed that equals a natural frequency of the rotating shaft. The response to unbalance has a peak \
         there, and the phase changes quickly.",
        "`rotor-edge check` computes them.",
    ),
    word(
        Kind::Term,
        "log decrement",
        &[],
        "Measure of damping: the natural logarithm of the ratio of successive amplitudes of a decaying mode. \
         Below zero the machine is unstable; API standards require at least 0.1.",
        "",
    ),
    word(
        Kind::Term,
        "trial unbalance",
        &[],
        "An assumed unbalance for which `rotor-edge check` computes the vibration. It is not the residual \
         unbalance of the machine. The response is linear: twice the unbalance gives twice the vibration.",
        "",
    ),
    word(
        Kind::Term,
        "amplification factor",
        &["amplification"],
        "Sharpness of the peak at a critical speed: its speed divided by the distance between the two speeds at \
         which the amplitude is 0.707 of the peak. Below 2.5 a critical speed counts as critically damped.",
        "For a large value, add damping at the bearings or move the running range away from that speed.",
    ),
    word(
        Kind::Term,
        "separation margin",
        &["margin"],
        "Distance of a critical speed from the nearest running speed, in percent of that running speed. The \
         required margin grows with the amplification factor. A critical speed with a factor below 2.5 needs \
         none.",
        "State the running range with `rotor-edge check --rpm A..B`.",
    ),
    word(
        Kind::Term,
        "eccentricity ratio",
        &["eccentricity", "ε"],
        "Distance between the centres of journal and bearing, divided by the radial clearance: 0 is the middle, 1 \
         is contact. Lightly loaded bearings run near 0, where oil whirl is likely.",
        "",
    ),
    word(
        Kind::Term,
        "attitude angle",
        &["attitude"],
        "Angle in degrees from the direction of the load to the line of centres of bearing and journal, in the \
         direction of rotation. It is near 90° in a lightly loaded plain bearing and small in a tilting-pad \
         bearing.",
        "",
    ),
    word(
        Kind::Term,
        "gap voltage",
        &["gap"],
        "The mean voltage of a proximity probe. It shows the mean position of the shaft in its bearing, which \
         depends on load, clearance and viscosity of the oil.",
        "",
    ),
    word(
        Kind::Term,
        "simulated truth",
        &["truth file"],
        "The effects, the unbalance and the drawing errors of a simulated machine, which its rotor file does not \
         state.",
        "Write it with `rotor-edge simulate --truth` and compare the diagnosis with it.",
    ),
    word(
        Kind::Term,
        "slow roll",
        &[],
        "Rotation at so low a speed that the force of the unbalance is negligible. The probes then show their \
         runout, from a surface that is not round or is magnetised.",
        "Subtract it with `--slow-roll`.",
    ),
    word(
        Kind::Term,
        "interval",
        &["95 %", "interval_95", "confidence interval", "half-width"],
        "95 % confidence interval: a range that contains the true value in 95 of 100 cases, provided that model \
         and noise are right. `±` is half its width.",
        "",
    ),
    word(
        Kind::Term,
        "evidence",
        &["probability", "marginal likelihood", "Bayes factor"],
        "Marginal likelihood: the probability of the measurements under an explanation, averaged over its \
         parameters. An effect with more free parameters must fit better to reach the same value. Answers give \
         twice the logarithm of its ratio to that of the model without the effect.",
        "",
    ),
    word(
        Kind::Term,
        "message authentication code",
        &["MAC"],
        "Eight bytes that only a holder of the monitor's key can compute for a frame. A frame with a wrong code \
         is ignored.",
        "Start the monitor with `rotor-edge node --sealed`, and give its key to `watch` and `decode`.",
    ),
    word(
        Kind::Term,
        "nonce",
        &[],
        "An increasing number that is part of each message authentication code. It prevents a recorded frame from \
         being accepted again.",
        "",
    ),
    word(
        Kind::Term,
        "phase I",
        &["identification", "identify"],
        "Identification on the desktop: bearing coefficients and unbalance are fitted together to the first days \
         of a record and a run-up.",
        "",
    ),
    word(
        Kind::Term,
        "phase II",
        &[],
        "Estimation on the controller: the unbalance is updated with every reading, while the bearing \
         coefficients of phase I stay fixed.",
        "",
    ),
    word(
        Kind::Term,
        "run-up",
        &["coast-down", "start-up"],
        "Measurement while the machine accelerates through its speed range. A coast-down is the same while it slows down.",
        "",
    ),
    word(
        Kind::Term,
        "proximity probe",
        &["proximity probes", "eddy-current probe"],
        "Non-contacting sensor of the distance to the shaft. Two of them at right angles show the orbit of the shaft.",
        "",
    ),
    word(
        Kind::Term,
        "prior",
        &["prior probability"],
        "Probability distribution of a parameter before the data are seen, for example from the values in the rotor file.",
        "",
    ),
    word(
        Kind::Term,
        "random walk",
        &[],
        "Model of a quantity that changes by an independent random step in each interval of time.",
        "",
    ),
    word(
        Kind::Term,
        "balance grade",
        &["balance quality grade"],
        "Permissible unbalance by ISO 21940-11: the grade G in mm/s is the velocity of the centre of mass, the permissible \
         eccentricity times the angular speed.",
        "",
    ),
    word(
        Kind::Term,
        "CRPS",
        &["continuous ranked probability score"],
        "Continuous ranked probability score: the error of a forecast that is a probability distribution. It equals the \
         absolute error where the forecast is a single number.",
        "",
    ),
];
