//! One spelling of each term: other spellings that a reader may know, which no text of the project uses.

/// A term of the glossary, and the spellings that `explain` understands and no text uses.
pub const OTHER_SPELLINGS: &[(&str, &[&str])] = &[
    ("keyphasor", &["phase reference", "key phasor", "key-phasor"]),
    ("lag", &["lag phase", "phase-lag"]),
    ("pk-pk", &["peak to peak", "peak-to-peak", "p-p", "zero to peak", "zero-to-peak"]),
    ("χ² per value", &["chi-squared", "chi squared", "chi-square", "chi²"]),
    ("unbalance", &["imbalance", "out-of-balance"]),
    ("trial weight", &["trial mass", "test weight", "calibration weight"]),
    ("influence coefficient", &["influence number", "influence vector", "influence factor"]),
    ("trial unbalance", &["test unbalance"]),
    ("critical speed", &["critical velocity", "critical rpm"]),
    ("amplification factor", &["amplification ratio", "magnification factor", "quality factor"]),
    ("separation margin", &["margin of separation", "separation distance"]),
    ("eccentricity ratio", &["relative eccentricity", "excentricity"]),
    ("attitude angle", &["angle of attitude", "altitude angle"]),
    ("log decrement", &["logarithmic decrement", "log dec", "log-decrement"]),
    ("gap voltage", &["gap-voltage", "voltage of the gap"]),
    ("slow roll", &["slowroll", "slow rolling"]),
    ("condition number", &["number of condition", "conditioning number"]),
    ("message authentication code", &["message code", "authentication tag"]),
    ("nonce", &["freshness"]),
];
