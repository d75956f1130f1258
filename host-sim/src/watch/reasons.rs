//! Each reason of a state in words, and what to do about it.

use rotor_edge_core::state::Reason;

use super::lists::listed;
use crate::bus::numbers::probe_numbers;

const RUN_UP: &str = "record a run-up and run `rotor-edge improve`";
const DEPLOY: &str = "deploy a model: `rotor-edge deploy`";
const PROBE: &str = "check the probe, its cable and its proximitor";

/// What a reason means to somebody who watches.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Why {
    pub what: String,
    /// What to do about it.
    pub next: &'static str,
}

/// A reason in words; `mask` says which probes, if it is about probes.
pub fn why(reason: Reason, mask: u8) -> Why {
    let (what, next) = match reason {
        Reason::Probes => (of_probes(mask, "gives no value", "give no value"), PROBE),
        Reason::Gap => (
            of_probes(mask, "is out of its gap range", "are out of their gap range"),
            "check the gap voltage, the probe's mounting and its cable",
        ),
        Reason::Repeated => (
            of_probes(mask, "repeats the same value", "repeat the same values"),
            "check who sends the readings: the numbers are fresh, the data are not",
        ),
        Reason::Probe => (of_probes(mask, "alone has changed", "alone have changed"), PROBE),
        Reason::Unknown(code) => {
            (format!("reason {code}, which this program does not know"), "watch with a newer program")
        }
        _ => {
            let (what, next) = fixed_words(reason);
            (what.into(), next)
        }
    };
    Why { what, next }
}

/// What is the matter and what to do, of reasons that are not about single probes.
fn fixed_words(reason: Reason) -> (&'static str, &'static str) {
    match reason {
        Reason::None => ("nothing is the matter", ""),
        Reason::NoReading => {
            ("no reading arrives", "send readings; check who sends them, and to which number")
        }
        Reason::Age => (
            "the last judged reading is too old",
            "see why readings stopped: the machine, who sends them, the bus",
        ),
        Reason::Keyphasor => (
            "the keyphasor is missing, unsteady or has moved, and without it speed and phase mean nothing",
            "check the keyphasor's probe, its gap and the mark on the shaft; wait until the speed is constant",
        ),
        Reason::Speed => (
            "the speed is outside the range that the model is for",
            "check that it is in rpm; for faster machines deploy with --fastest-rpm",
        ),
        Reason::Response => (
            "the model has no finite response at this speed",
            "deploy a better model: `rotor-edge improve`, `rotor-edge deploy`",
        ),
        Reason::Undetermined => ("the probes that are left do not tell the planes apart", PROBE),
        Reason::NoRedundancy => (
            "the probes that are left give as many values as there are unknowns: any machine would fit",
            PROBE,
        ),
        Reason::BelowNoise => (
            "the vibration is below the noise",
            "nothing, if the machine turns slowly; else check probes and their supply",
        ),
        Reason::Rise => ("the residual rose above its level", RUN_UP),
        Reason::Ratio => ("the residual is too large a part of the vibration", RUN_UP),
        Reason::Reference => ("the residual is above that of the time after the deployment", RUN_UP),
        Reason::Jump => (
            "the unbalance changed faster than it may, and the model still fits",
            "look for lost material or a loose part; after balancing or repair: `rotor-edge acknowledge`",
        ),
        Reason::NumberInUse => ("its number is in use by another", "give one of them another number"),
        Reason::NothingStored => ("no model was deployed to it yet", DEPLOY),
        Reason::Schema => ("its stored model is one of another version of the firmware", DEPLOY),
        Reason::Damaged => ("its stored model is damaged", DEPLOY),
        Reason::Size => ("its stored model is larger than it holds", DEPLOY),
        Reason::ProbeCount => (
            "readings have another number of probes than its model",
            "deploy the model of this machine, or send the readings of the right one",
        ),
        Reason::Absurd => {
            ("readings hold values that no probe can show", "check units (µm 0-pk) and the probes' scale")
        }
        Reason::Learning => ("the reference is being taken", ""),
        Reason::Scale => (
            "all probes show one multiple of what they showed before at this speed",
            "check the proximitors' supply, the scale factors and the unit of the readings",
        ),
        Reason::Scatter => (
            "readings scatter so much that they determine no direction",
            "check the keyphasor and the cables' shields; wait until the speed is constant",
        ),
        Reason::Intermittent => (
            "readings that do not fit come and go",
            "look for a loose contact or cable, and for what changes in the machine at those times",
        ),
        Reason::Storage => (
            "what it learned could not be stored, and a loss of power would lose it",
            "check its memory: the disk of a program, the flash of a board",
        ),
        _ => ("the reason is one that this program does not know", "watch with a newer program"),
    }
}

fn of_probes(mask: u8, one: &str, several: &str) -> String {
    let numbers = probe_numbers(mask);
    match numbers.len() {
        0 => format!("a probe {one}"),
        1 => format!("probe {} {one}", listed(&numbers)),
        _ => format!("probes {} {several}", listed(&numbers)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_reason_has_own_words_and_says_what_to_do() {
        let mut seen = std::collections::HashSet::new();
        for reason in Reason::ALL {
            let why = why(reason, 0b10);
            assert!(seen.insert(why.what.clone()), "{reason:?}: {}", why.what);
            let nothing_to_do = matches!(reason, Reason::None | Reason::Learning);
            assert_eq!(why.next.is_empty(), nothing_to_do, "{reason:?}");
        }
    }

    #[test]
    fn reason_of_newer_monitor_is_named_by_its_number() {
        let why = why(Reason::from_code(200), 0);
        assert_eq!(why.what, "reason 200, which this program does not know");
        assert_eq!(why.next, "watch with a newer program");
    }

    #[test]
    fn probes_are_counted_from_one() {
        assert_eq!(why(Reason::Probes, 0b100).what, "probe 3 gives no value");
        assert_eq!(why(Reason::Gap, 0b11).what, "probes 1 and 2 are out of their gap range");
    }
}
