//! One thing that a monitor told, or was told, and what makes it that one and no other.

use rotor_edge::answers::monitor_result::ResultAnswer;
use rotor_edge::bus::states::name;
use rotor_edge_core::can::NumberedReading;
use rotor_edge_core::model::Pair;
use rotor_edge_core::state::{NodeState, Reason, Status};
use serde::{Deserialize, Serialize};

/// Version of what is kept and sent; a reader refuses newer ones.
pub const SCHEMA: u32 = 1;

/// One monitor of the plant.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Source {
    pub plant: String,
    /// Name of the bus in it.
    pub bus: String,
    /// Number of the monitor on the bus.
    pub node: u8,
}

/// One thing of one monitor. Two with the same source, kind, epoch and sequence are the same.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Item {
    /// [`SCHEMA`] of who wrote it.
    pub schema: u32,
    pub source: Source,
    /// Grows when the monitor's numbers begin again.
    pub epoch: u64,
    /// Number within the epoch.
    pub sequence: u16,
    /// The gateway's clock when it was complete, µs since 1970.
    pub time_us: i64,
    /// Whether that clock was behind what it had said before, or before this program was written.
    pub is_clock_doubtful: bool,
    pub body: Body,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Body {
    /// To the monitor.
    Reading(ReadingItem),
    /// By the monitor, of a reading with the same epoch and sequence.
    Result(ResultAnswer),
    /// By the monitor when it changed.
    State(StateItem),
    /// By the monitor every few seconds.
    Heartbeat(Heartbeat),
}

/// A number that may be missing: the protocol's NaN is `None`.
fn finite(value: f32) -> Option<f32> {
    value.is_finite().then_some(value)
}

fn pair([cos, sin]: Pair) -> [Option<f32>; 2] {
    [finite(cos), finite(sin)]
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReadingItem {
    pub speed_rpm: Option<f32>,
    /// What is known of the phase reference, as `locked`.
    pub keyphasor: String,
    /// Cosine and sine of each probe, µm zero to peak; none of a probe that was lost.
    pub probes_um: Vec<[Option<f32>; 2]>,
    /// Gap voltage of each probe, none where it is not stated.
    pub gaps_v: Vec<Option<f32>>,
}

/// What a monitor said of itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StateItem {
    /// What it was doing, as `tracking`.
    pub state: String,
    pub reason: String,
    /// Bit i set: probe i was missing.
    pub missing_mask: u8,
    /// Why the flag was raised that is up.
    pub cause: String,
    /// Bearing suspected then, from 1.
    pub suspect: Option<u8>,
    /// Time since the last reading that was judged, s; none if there was none.
    pub age_s: Option<f32>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Heartbeat {
    /// Version of the protocol that it speaks.
    pub protocol: u8,
    pub state: String,
    pub reason: String,
    /// Readings that it evaluated since it started.
    pub readings: u32,
}

impl Body {
    /// As columns and subjects name it.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Reading(_) => Kind::Reading,
            Self::Result(_) => Kind::Result,
            Self::State(_) => Kind::State,
            Self::Heartbeat(_) => Kind::Heartbeat,
        }
    }
}

/// What an item is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Kind {
    Reading,
    Result,
    State,
    Heartbeat,
}

impl Kind {
    pub const ALL: [Self; 4] = [Self::Reading, Self::Result, Self::State, Self::Heartbeat];

    /// Name of its table and of its part of a subject.
    pub fn name(self) -> &'static str {
        match self {
            Self::Reading => "reading",
            Self::Result => "result",
            Self::State => "state",
            Self::Heartbeat => "heartbeat",
        }
    }
}

impl Item {
    /// Source, kind, epoch and sequence in one word: the same for the same item, another for any other.
    pub fn id(&self) -> String {
        let Source { plant, bus, node } = &self.source;
        let kind = self.body.kind().name();
        // lengths, for names may hold anything
        format!("{}:{plant}:{}:{bus}:{node}:{kind}:{}:{}", plant.len(), bus.len(), self.epoch, self.sequence)
    }
}

/// A name as a word of ASCII letters, digits and hyphens, as subjects and files take it; other names make other words.
pub fn plain_word(name: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '-';
    name.chars().map(|c| if is_plain(c) { c.to_string() } else { format!("_{:x}_", u32::from(c)) }).collect()
}

impl From<&NumberedReading> for ReadingItem {
    fn from(numbered: &NumberedReading) -> Self {
        let reading = &numbered.reading;
        Self {
            speed_rpm: finite(reading.speed_rpm),
            keyphasor: name(numbered.keyphasor),
            probes_um: reading.probes().iter().map(|p| pair([p.cos_um, p.sin_um])).collect(),
            gaps_v: reading.gaps_v().iter().map(|v| finite(*v)).collect(),
        }
    }
}

impl From<&Status> for StateItem {
    fn from(status: &Status) -> Self {
        Self {
            state: name(status.state),
            reason: name(status.reason),
            missing_mask: status.missing_mask,
            cause: name(status.cause),
            suspect: status.suspect.map(|bearing| bearing + 1),
            age_s: finite(status.age_s),
        }
    }
}

impl Heartbeat {
    /// Of what a heartbeat carries.
    pub fn new(protocol: u8, state: NodeState, reason: Reason, readings: u32) -> Self {
        Self { protocol, state: name(state), reason: name(reason), readings }
    }
}

#[cfg(test)]
mod tests {
    use rotor_edge_core::reading::{ProbeVector, Reading as Measured};

    use super::*;

    fn item(plant: &str, bus: &str) -> Item {
        let vector = ProbeVector { cos_um: 0.1, sin_um: -3.3e-7 };
        let reading = Measured::new(8_999.7, &[vector, ProbeVector::LOST]).unwrap();
        let reading = reading.with_gaps_v(&[-9.6]);
        Item {
            schema: SCHEMA,
            source: Source { plant: plant.into(), bus: bus.into(), node: 7 },
            epoch: 3,
            sequence: 12,
            time_us: 1_700_000_000_123_456,
            is_clock_doubtful: false,
            body: Body::Reading((&NumberedReading::new(12, reading)).into()),
        }
    }

    #[test]
    fn an_item_comes_back_from_its_text_to_the_bit() {
        let sent = item("north", "can0");
        let text = serde_json::to_string(&sent).unwrap();
        assert_eq!(serde_json::from_str::<Item>(&text).unwrap(), sent, "{text}");
        let Body::Reading(reading) = sent.body else { panic!() };
        assert_eq!(reading.probes_um, [[Some(0.1), Some(-3.3e-7)], [None, None]]);
        assert_eq!(&reading.gaps_v[..2], [Some(-9.6), None]);
    }

    #[test]
    fn suspect_bearing_of_a_state_counts_from_one() {
        let status = Status { suspect: Some(1), ..Status::default() };
        assert_eq!(StateItem::from(&status).suspect, Some(2));
    }

    #[test]
    fn reason_of_newer_monitor_is_kept_by_its_number() {
        let status = Status { reason: Reason::Unknown(30), cause: Reason::Unknown(31), ..Status::default() };
        let item = StateItem::from(&status);
        assert_eq!((item.reason.as_str(), item.cause.as_str()), ("reason_30", "reason_31"));
        assert_eq!(Heartbeat::new(3, NodeState::Tracking, Reason::Unknown(200), 1).reason, "reason_200");
    }

    #[test]
    fn names_become_words_that_no_wildcard_and_no_other_name_makes() {
        assert_eq!(plain_word("can-0"), "can-0");
        assert_eq!(plain_word("socketcand:127.0.0.1"), "socketcand_3a_127_2e_0_2e_0_2e_1");
        assert_ne!(plain_word("a_2e_b"), plain_word("a.b"));
        assert!(!plain_word("> *\u{e4}\n/").contains(['>', '*', ' ', '\n', '.', '/']));
    }

    #[test]
    fn names_that_run_into_each_other_make_no_equal_ids() {
        assert_ne!(item("a:1", "b").id(), item("a", "1:b").id());
        assert_eq!(item("a", "b").id(), item("a", "b").id());
    }
}
