//! Model, thresholds and command counter in flash, in two slots: a save goes to the slot that is not in use, and its head is
//! written last. Whatever write or erasure a cut in power falls into, one whole slot remains.
//!
//! ```text
//! slot   head: u32 mark, u32 number of the save, u64 counter, u16 length of the model, u16 length of the thresholds,
//!              u32 CRC-32 of the model, u32 CRC-32 of the thresholds, u32 CRC-32 of the head
//!        model as deployed, ones up to the next multiple of 32, thresholds; length 0: never saved
//! ```
//!
//! The head has a checksum of its own, so that the counter outlives whatever happens to the rest. Slots of the layout before
//! (one checksum over head and model, no thresholds) are read as well.

#[cfg(test)]
mod tests;

use crate::flash::{Mapped, SaveError, checksum, word, write};

const MARK: u32 = u32::from_le_bytes(*b"REs2");
/// The layout before.
const OLD_MARK: u32 = u32::from_le_bytes(*b"REs1");
const HEAD_BYTES: usize = 32;
const CHECKSUM_PLACE: usize = HEAD_BYTES - 4;
/// The thresholds begin at a multiple of this.
const ALIGNMENT: usize = 32;
const SLOTS: u32 = 2;

/// What was saved last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stored<'a> {
    /// The highest counter that any slot holds; 0 if none does.
    pub counter: u64,
    /// The model's and the thresholds' bytes; the thresholds are empty if they were never saved.
    pub state: Result<State<'a>, Missing>,
}

/// What belongs together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct State<'a> {
    /// As deployed.
    pub model: &'a [u8],
    /// As set; empty if they never were.
    pub thresholds: &'a [u8],
}

/// Why there is no model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Missing {
    /// None was ever saved.
    Nothing,
    /// One was saved, and cannot be read any more.
    Damaged,
}

/// What changes; `None` stays as it was saved before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Change<'a> {
    /// The model's bytes.
    pub model: Option<&'a [u8]>,
    /// The thresholds' bytes.
    pub thresholds: Option<&'a [u8]>,
}

/// A part of a slot: its length and its checksum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Part {
    bytes: u16,
    checksum: u32,
}

impl Part {
    fn of(bytes: &[u8]) -> Result<Self, SaveError> {
        let length = u16::try_from(bytes.len()).map_err(|_| SaveError::Length)?;
        Ok(Self { bytes: length, checksum: checksum(&[bytes]) })
    }

    fn is(self, bytes: &[u8]) -> bool {
        Self::of(bytes) == Ok(self)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Head {
    number: u32,
    counter: u64,
    model: Part,
    thresholds: Part,
}

/// Where the thresholds begin in a slot.
fn thresholds_place(model_bytes: usize) -> usize {
    HEAD_BYTES + model_bytes.next_multiple_of(ALIGNMENT)
}

impl Head {
    fn encode(&self) -> [u8; HEAD_BYTES] {
        let mut bytes = [0; HEAD_BYTES];
        let values = [
            MARK,
            self.number,
            self.counter as u32,
            (self.counter >> 32) as u32,
            u32::from(self.model.bytes) | u32::from(self.thresholds.bytes) << 16,
            self.model.checksum,
            self.thresholds.checksum,
        ];
        let (words, _) = bytes.as_chunks_mut::<4>();
        for (word, value) in words.iter_mut().zip(values) {
            *word = value.to_le_bytes();
        }
        let check = checksum(&[bytes.get(..CHECKSUM_PLACE).unwrap_or_default()]);
        if let Some(last) = bytes.last_chunk_mut() {
            *last = check.to_le_bytes();
        }
        bytes
    }

    /// Of a slot's bytes, if its head is whole.
    fn decode(slot: &[u8]) -> Option<Self> {
        let number = word(slot, 4);
        let counter = u64::from(word(slot, 8)) | u64::from(word(slot, 12)) << 32;
        let head = match word(slot, 0) {
            MARK => {
                let lengths = word(slot, 16);
                let model = Part { bytes: lengths as u16, checksum: word(slot, 20) };
                let thresholds = Part { bytes: (lengths >> 16) as u16, checksum: word(slot, 24) };
                let head = Self { number, counter, model, thresholds };
                (slot.get(..HEAD_BYTES)? == head.encode()).then_some(head)?
            }
            OLD_MARK => {
                let model = slot.get(HEAD_BYTES..)?.get(..word(slot, 16) as usize)?;
                let whole = checksum(&[slot.get(..CHECKSUM_PLACE)?, &[0; 4], model]);
                let empty = Part::of(&[]).ok()?;
                let head = Self { number, counter, model: Part::of(model).ok()?, thresholds: empty };
                (whole == word(slot, CHECKSUM_PLACE)).then_some(head)?
            }
            _ => return None,
        };
        let end = thresholds_place(head.model.bytes.into()) + usize::from(head.thresholds.bytes);
        (end <= slot.len()).then_some(head)
    }

    /// What the slot with this head holds, whole or not.
    fn state<'a>(&self, slot: &'a [u8]) -> Option<State<'a>> {
        let model_bytes = self.model.bytes.into();
        Some(State {
            model: slot.get(HEAD_BYTES..)?.get(..model_bytes)?,
            thresholds: slot.get(thresholds_place(model_bytes)..)?.get(..self.thresholds.bytes.into())?,
        })
    }

    fn is_whole(&self, State { model, thresholds }: State<'_>) -> bool {
        self.model.is(model) && self.thresholds.is(thresholds)
    }
}

/// Two slots in a stretch of flash that nothing else uses.
pub struct Slots<F> {
    flash: F,
}

impl<F: Mapped> Slots<F> {
    /// `flash` may hold anything; its first half becomes one slot, its second half the other.
    pub fn new(flash: F) -> Self {
        Self { flash }
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.flash
    }

    /// What was saved last. Where that is damaged, the slot before serves if it holds the same; a model that was replaced
    /// does not come back.
    pub fn load(&self) -> Stored<'_> {
        let counter = self.heads().into_iter().flatten().map(|head| head.counter).max().unwrap_or_default();
        let state = match self.source() {
            Some((slot, head)) => match head.state(self.slot(slot)) {
                Some(state) if state.model.is_empty() => Err(Missing::Nothing),
                Some(state) if head.is_whole(state) => Ok(state),
                _ => Err(Missing::Damaged),
            },
            None if self.is_marked() => Err(Missing::Damaged),
            None => Err(Missing::Nothing),
        };
        Stored { counter, state }
    }

    /// Saves the counter and what changes.
    ///
    /// Errors: [`SaveError`].
    pub fn save(&mut self, counter: u64, change: Change<'_>) -> Result<(), SaveError> {
        let source = self.source();
        let number = self.newest().map_or(0, |(_, head)| head.number.wrapping_add(1));
        let target = source.map_or(0, |(slot, _)| (slot + 1) % SLOTS);
        let part = |new: Option<&[u8]>, old: fn(&Head) -> Part| match (new, &source) {
            (Some(bytes), _) => Part::of(bytes),
            (None, Some((_, head))) => Ok(old(head)),
            (None, None) => Part::of(&[]),
        };
        let model = part(change.model, |head| head.model)?;
        let thresholds = part(change.thresholds, |head| head.thresholds)?;
        let place = thresholds_place(model.bytes.into());
        if place + usize::from(thresholds.bytes) > self.slot_bytes() as usize {
            return Err(SaveError::Length);
        }
        let start = self.start(target);
        self.flash.erase(start, start + self.slot_bytes()).map_err(|_| SaveError::Flash)?;
        let from =
            source.map(|(slot, head)| (self.start(slot) as usize, thresholds_place(head.model.bytes.into())));
        self.put(start + HEAD_BYTES as u32, change.model, from.map(|(slot, _)| slot + HEAD_BYTES), model)?;
        self.put(start + place as u32, change.thresholds, from.map(|(slot, at)| slot + at), thresholds)?;
        let head = Head { number, counter, model, thresholds };
        write(&mut self.flash, start, &head.encode())?;
        let slot = self.slot(target);
        let reads = Head::decode(slot) == Some(head)
            && head.state(slot).is_some_and(|state| {
                // What was damaged before may stay so, and is known by its old checksum.
                (change.model.is_none() || model.is(state.model))
                    && (change.thresholds.is_none() || thresholds.is(state.thresholds))
            });
        if reads { Ok(()) } else { Err(SaveError::Verify) }
    }

    /// Writes a part: new bytes, or else those that are at `old`.
    fn put(
        &mut self,
        start: u32,
        new: Option<&[u8]>,
        old: Option<usize>,
        part: Part,
    ) -> Result<(), SaveError> {
        if let Some(bytes) = new {
            return write(&mut self.flash, start, bytes);
        }
        let Some(old) = old else { return Ok(()) };
        for place in (0..usize::from(part.bytes)).step_by(ALIGNMENT) {
            let mut chunk = [0xff; ALIGNMENT];
            let left = self.flash.mapped().get(old + place..).unwrap_or_default();
            for (to, from) in chunk.iter_mut().zip(left.iter().take(usize::from(part.bytes) - place)) {
                *to = *from;
            }
            write(&mut self.flash, start + place as u32, &chunk)?;
        }
        Ok(())
    }

    fn slot_bytes(&self) -> u32 {
        let half = self.flash.capacity() as u32 / SLOTS;
        half - half % F::ERASE_SIZE as u32
    }

    fn start(&self, slot: u32) -> u32 {
        slot * self.slot_bytes()
    }

    fn slot(&self, slot: u32) -> &[u8] {
        let start = self.start(slot) as usize;
        self.flash.mapped().get(start..start + self.slot_bytes() as usize).unwrap_or_default()
    }

    fn heads(&self) -> [Option<Head>; SLOTS as usize] {
        [0, 1].map(|slot| Head::decode(self.slot(slot)))
    }

    /// The slot that was saved last. Numbers wrap; two slots in use differ by one.
    fn newest(&self) -> Option<(u32, Head)> {
        match self.heads() {
            [Some(first), Some(second)] if second.number == first.number.wrapping_add(1) => Some((1, second)),
            [Some(first), _] => Some((0, first)),
            [None, second] => Some((1, second?)),
        }
    }

    /// The slot to read from: the newest, or if that is damaged the other, should it hold the same.
    fn source(&self) -> Option<(u32, Head)> {
        let (slot, head) = self.newest()?;
        let whole = |slot, head: &Head| head.state(self.slot(slot)).is_some_and(|state| head.is_whole(state));
        let other = (slot + 1) % SLOTS;
        match Head::decode(self.slot(other)) {
            Some(before)
                if !whole(slot, &head)
                    && (before.model, before.thresholds) == (head.model, head.thresholds)
                    && whole(other, &before) =>
            {
                Some((other, before))
            }
            _ => Some((slot, head)),
        }
    }

    fn is_marked(&self) -> bool {
        [0, 1].into_iter().any(|slot| [MARK, OLD_MARK].contains(&word(self.slot(slot), 0)))
    }
}
