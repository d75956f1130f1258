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

/// Why a node is in its state. The numbers travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
#[non_exhaustive]
pub enum Reason {
    #[default]
    None = 0,
    NoReading = 1,
    /// The last judged reading is older than the age limit.
    Age = 2,
    /// Probes are lost: see the mask.
    Probes = 3,
    /// The keyphasor is missing or unsteady.
    Keyphasor = 4,
    /// The speed is outside the model's range.
    Speed = 5,
    /// The model has no finite response at this speed.
    Response = 6,
    /// The rows that are left do not tell the planes apart.
    Undetermined = 7,
    /// As many rows as unknowns: the residual is zero whatever the machine does.
    NoRedundancy = 8,
    /// The whole vibration lies below the noise.
    BelowNoise = 9,
    /// The residual rose above its level.
    Rise = 10,
    /// The residual is too large a part of the vibration.
    Ratio = 11,
    /// The residual is above that of the time after the deployment.
    Reference = 12,
    /// The unbalance grew faster than it may: without that bound the model would still fit.
    Jump = 13,
    /// Another node has this one's number.
    NumberInUse = 14,
    /// No model was ever stored.
    NothingStored = 15,
    /// The stored model has another schema.
    Schema = 16,
    /// The stored model is damaged or refused.
    Damaged = 17,
    /// The stored model is larger than this firmware holds.
    Size = 18,
    /// Readings have other probes than the model.
    ProbeCount = 19,
    /// A value that no probe can show.
    Absurd = 20,
    /// Gap voltages are out of their range: see the mask.
    Gap = 21,
    /// The reference is being taken.
    Learning = 22,
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
    /// Every reason, in the order of their numbers.
    pub const ALL: [Self; 23] = [
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
    ];

    /// The reason of a number on the wire.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.get(usize::from(code)).copied()
    }
}

/// What a node says of itself.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Status {
    pub state: NodeState,
    /// Why; beside a latched flag, what is the matter at present.
    pub reason: Reason,
    /// Bit i set: probe i is missing, or out of its gap range if the reason is [`Reason::Gap`].
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
            assert_eq!((reason as u8, Reason::from_code(code)), (code, Some(reason)));
        }
        assert_eq!((NodeState::from_code(10), Reason::from_code(23)), (None, None));
    }
}
