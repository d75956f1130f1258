//! What a monitor may say of the machine, and why: no state outlives its evidence.

/// What a node is doing. The numbers travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
#[non_exhaustive]
pub enum NodeState {
    /// A model is there, and no reading was judged since the start.
    #[default]
    Waiting = 0,
    /// The model describes the machine, by evidence no older than the age limit.
    Tracking = 1,
    /// The last reading was suspicious.
    Suspicious = 2,
    /// The flag is up: latched until it is acknowledged or the model replaced.
    Flagged = 3,
    /// Somebody else uses this node's number: it sends nothing but this state until that has ended.
    Conflict = 4,
    /// Just started: listens for others with its number before it answers.
    Listening = 5,
    /// No model: nothing can be said of the machine.
    NoModel = 6,
    /// The reference of a new model is being taken.
    Learning = 7,
    /// Readings arrive and cannot be judged.
    Blind = 8,
    /// Nothing was judged for longer than the age limit.
    Stale = 9,
}

/// Why a node is in its state. The numbers travel: a reason's is its place in [`Reason::ALL`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Reason {
    #[default]
    None,
    NoReading,
    /// The last judged reading is older than the age limit.
    Age,
    /// Probes are lost: see the mask.
    Probes,
    /// The keyphasor is missing or unsteady, or all phases turned by one angle.
    Keyphasor,
    /// The speed is outside the model's range.
    Speed,
    /// The model has no finite response at this speed.
    Response,
    /// The rows that are left do not tell the planes apart.
    Undetermined,
    /// As many rows as unknowns: the residual is zero whatever the machine does.
    NoRedundancy,
    /// The whole vibration lies below the noise.
    BelowNoise,
    /// The residual rose above its level.
    Rise,
    /// The residual is too large a part of the vibration.
    Ratio,
    /// The residual is above that of the time after the deployment.
    Reference,
    /// The unbalance of a plane changed faster than it may, while the model still fits.
    Jump,
    /// Another node has this one's number.
    NumberInUse,
    /// No model was ever stored.
    NothingStored,
    /// The stored model has another schema.
    Schema,
    /// The stored model is damaged or refused.
    Damaged,
    /// The stored model is larger than this firmware holds.
    Size,
    /// Readings have other probes than the model.
    ProbeCount,
    /// A value that no probe can show.
    Absurd,
    /// Gap voltages are out of their range: see the mask.
    Gap,
    /// The reference is being taken.
    Learning,
    /// All probes show one multiple of what they last showed at this speed.
    Scale,
    /// Readings of one speed scatter so much that they determine no direction.
    Scatter,
    /// Readings repeat to the bit more often than their noise allows: see the mask.
    Repeated,
    /// Suspicious readings come and go, for too large a part of the time.
    Intermittent,
    /// What must not be forgotten could not be stored.
    Storage,
    /// One probe alone changed: see the mask.
    Probe,
    /// A number that this version does not know.
    Unknown(u8),
}

impl NodeState {
    /// Every state, in the order of their numbers.
    pub const ALL: [Self; 10] = [
        Self::Waiting,
        Self::Tracking,
        Self::Suspicious,
        Self::Flagged,
        Self::Conflict,
        Self::Listening,
        Self::NoModel,
        Self::Learning,
        Self::Blind,
        Self::Stale,
    ];

    /// The state of a number on the wire.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.get(usize::from(code)).copied()
    }
}

impl Reason {
    /// Every known reason, in the order of their numbers.
    pub const ALL: [Self; 29] = [
        Self::None,
        Self::NoReading,
        Self::Age,
        Self::Probes,
        Self::Keyphasor,
        Self::Speed,
        Self::Response,
        Self::Undetermined,
        Self::NoRedundancy,
        Self::BelowNoise,
        Self::Rise,
        Self::Ratio,
        Self::Reference,
        Self::Jump,
        Self::NumberInUse,
        Self::NothingStored,
        Self::Schema,
        Self::Damaged,
        Self::Size,
        Self::ProbeCount,
        Self::Absurd,
        Self::Gap,
        Self::Learning,
        Self::Scale,
        Self::Scatter,
        Self::Repeated,
        Self::Intermittent,
        Self::Storage,
        Self::Probe,
    ];

    /// The number on the wire.
    pub fn code(self) -> u8 {
        match self {
            Self::Unknown(code) => code,
            known => (0..).zip(Self::ALL).find(|&(_, reason)| reason == known).map_or(0, |(code, _)| code),
        }
    }

    /// The reason of a number on the wire.
    pub fn from_code(code: u8) -> Self {
        Self::ALL.get(usize::from(code)).copied().unwrap_or(Self::Unknown(code))
    }
}

/// What a node says of itself.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Status {
    pub state: NodeState,
    /// Why; beside a latched flag, what is the matter at present.
    pub reason: Reason,
    /// Bit i set: probe i is missing, or out of its gap range if the reason is [`Reason::Gap`]; with [`Reason::Probe`] it is
    /// the one that changed alone.
    pub missing_mask: u8,
    /// Why the flag was raised that is latched; [`Reason::None`] without one.
    pub cause: Reason,
    /// The bearing that was suspected when the flag was raised, from 0, at most 6.
    pub suspect: Option<u8>,
    /// Time since the last reading that was judged, s; infinite if there was none.
    pub age_s: f32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_on_the_wire_are_the_places_in_the_lists() {
        for (code, state) in (0..).zip(NodeState::ALL) {
            assert_eq!((state as u8, NodeState::from_code(code)), (code, Some(state)));
        }
        for (code, reason) in (0..).zip(Reason::ALL) {
            assert_eq!((reason.code(), Reason::from_code(code)), (code, reason));
        }
        assert_eq!((NodeState::from_code(10), Reason::from_code(29)), (None, Reason::Unknown(29)));
        assert_eq!(Reason::Unknown(30).code(), 30);
    }
}
