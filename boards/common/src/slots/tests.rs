//! Every place at which power can fail, on flash that behaves as flash does.

use std::vec;
use std::vec::Vec;

use embedded_storage::nor_flash::{ErrorType, NorFlashError, NorFlashErrorKind, ReadNorFlash};

use super::*;

const WORD: usize = 8;
const PAGE: usize = 64;
const FLASH_BYTES: usize = 16 * PAGE;

/// Flash of double words, each writable once after an erasure, that loses power at a chosen moment.
#[derive(Clone)]
struct Flash {
    bytes: Vec<u8>,
    written: Vec<bool>,
    /// Words still to be written or pages to be erased before power fails; that one is half done.
    power: usize,
    seed: u64,
}

#[derive(Debug)]
struct Dead;

impl NorFlashError for Dead {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl ErrorType for Flash {
    type Error = Dead;
}

impl Flash {
    fn new(fill: impl FnMut() -> u8) -> Self {
        let mut bytes = vec![0; FLASH_BYTES];
        bytes.fill_with(fill);
        Self { bytes, written: vec![true; FLASH_BYTES / WORD], power: usize::MAX, seed: 1 }
    }

    fn random(&mut self) -> u8 {
        self.seed = self.seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.seed >> 56) as u8
    }

    /// Whether there is still power for a step, and whether it is the one that is cut.
    fn spend(&mut self) -> Result<bool, Dead> {
        match self.power {
            0 => Err(Dead),
            _ => {
                self.power -= 1;
                Ok(self.power == 0)
            }
        }
    }
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Dead> {
        if self.power == 0 {
            return Err(Dead);
        }
        bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Dead> {
        assert!((from as usize).is_multiple_of(PAGE) && (to as usize).is_multiple_of(PAGE));
        for page in (from as usize..to as usize).step_by(PAGE) {
            let cut = self.spend()?;
            for at in page..page + PAGE {
                // Half an erasure leaves anything.
                self.bytes[at] = if cut { self.random() } else { 0xff };
                self.written[at / WORD] = cut;
            }
            if cut {
                return Err(Dead);
            }
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Dead> {
        assert!((offset as usize).is_multiple_of(WORD) && bytes.len().is_multiple_of(WORD));
        for (word, bytes) in (offset as usize / WORD..).zip(bytes.chunks(WORD)) {
            let cut = self.spend()?;
            assert!(!self.written[word], "a word is written once after an erasure");
            self.written[word] = true;
            for (at, &byte) in (word * WORD..).zip(bytes) {
                // Half a write has cleared some of the bits that it was to clear.
                self.bytes[at] = if cut { byte | self.random() } else { byte };
            }
            if cut {
                return Err(Dead);
            }
        }
        Ok(())
    }
}

fn load(flash: &Flash) -> Option<(u64, Option<Vec<u8>>)> {
    let mut buffer = [0; FLASH_BYTES];
    let mut slots = Slots::new(flash.clone());
    slots.load(&mut buffer).map(|(counter, model)| (counter, model.map(Vec::from)))
}

fn model(version: u8, length: usize) -> Vec<u8> {
    (0..length).map(|place| version ^ place as u8).collect()
}

/// Cuts power at each step of a save, twice over: the restarted board is cut again while it saves.
fn cut_everywhere(before: &Flash, counter: u64, new: Option<&[u8]>) {
    let old = load(before);
    let want = Some((counter, new.map(Vec::from).or(old.clone().and_then(|(_, model)| model))));
    let mut whole = Slots::new(before.clone());
    whole.save(counter, new).unwrap();
    assert_eq!(load(&whole.flash), want);
    let steps = FLASH_BYTES / WORD;
    let mut cuts = 0;
    for power in 1..steps {
        for seed in 0..8 {
            let mut slots = Slots::new(Flash { power, seed, ..before.clone() });
            let saved = slots.save(counter, new);
            let restarted = Flash { power: usize::MAX, ..slots.flash };
            let found = load(&restarted);
            if saved.is_ok() {
                assert_eq!(found, want);
                continue;
            }
            cuts += 1;
            assert!(found == old || found == want, "cut at {power}: {found:?}");
            for again in 1..steps {
                let mut slots = Slots::new(Flash { power: again, ..restarted.clone() });
                let saved = slots.save(counter, new);
                let found = load(&Flash { power: usize::MAX, ..slots.flash });
                assert!(found == want || (saved.is_err() && found == old), "cut at {power}, then {again}");
            }
        }
    }
    assert!(cuts >= 8 * 8, "the save was cut in {cuts} places");
}

#[test]
fn a_cut_at_any_write_or_erasure_leaves_the_old_state_or_the_new_one() {
    let (first, second, third) = (model(1, 200), model(2, 77), model(3, 210));
    let blank = Flash::new(|| 0xff);
    cut_everywhere(&blank, 1, Some(&first));
    let mut slots = Slots::new(blank);
    slots.save(1, Some(&first)).unwrap();
    cut_everywhere(&slots.flash, 2, Some(&second));
    slots.save(2, Some(&second)).unwrap();
    cut_everywhere(&slots.flash, 3, Some(&third));
    cut_everywhere(&slots.flash, 3, None);
}

#[test]
fn whatever_the_flash_held_before_nothing_is_found_and_everything_can_be_saved() {
    let mut seed = Flash::new(|| 0);
    for fill in 0..=255 {
        let flash = Flash::new(|| if fill == 0 { seed.random() } else { fill });
        assert_eq!(load(&flash), None);
        let mut slots = Slots::new(flash);
        slots.save(9, Some(&[1, 2, 3])).unwrap();
        assert_eq!(load(&slots.flash), Some((9, Some(vec![1, 2, 3]))));
    }
}

#[test]
fn a_counter_without_a_model_keeps_the_model_saved_before_or_none() {
    let mut slots = Slots::new(Flash::new(|| 0xff));
    slots.save(5, None).unwrap();
    assert_eq!(load(&slots.flash), Some((5, None)));
    slots.save(6, Some(&model(4, 100))).unwrap();
    slots.save(u64::MAX, None).unwrap();
    assert_eq!(load(&slots.flash), Some((u64::MAX, Some(model(4, 100)))));
}

#[test]
fn the_newest_is_found_over_the_end_of_the_numbers() {
    let mut slots = Slots::new(Flash::new(|| 0xff));
    for counter in 0..10 {
        slots.save(counter, Some(&model(counter as u8, 40))).unwrap();
        // The next two saves then straddle the wrap.
        if counter == 0 {
            let record = Record { number: u32::MAX - 1, counter, model_bytes: 40 };
            let head = slots.head(&record, Source::Slot(0)).unwrap();
            slots.flash.bytes[..HEAD_BYTES].copy_from_slice(&head);
        }
        assert_eq!(load(&slots.flash), Some((counter, Some(model(counter as u8, 40)))));
    }
}

#[test]
fn every_flipped_bit_of_the_newest_slot_falls_back_to_the_one_before() {
    let mut slots = Slots::new(Flash::new(|| 0xff));
    slots.save(1, Some(&model(1, 50))).unwrap();
    slots.save(2, Some(&model(2, 50))).unwrap();
    let start = slots.start(1) as usize;
    for bit in 0..8 * (HEAD_BYTES + 50) {
        let mut flash = slots.flash.clone();
        flash.bytes[start + bit / 8] ^= 1 << (bit % 8);
        assert_eq!(load(&flash), Some((1, Some(model(1, 50)))), "bit {bit}");
    }
}

#[test]
fn a_model_longer_than_a_slot_is_refused_and_the_old_one_stays() {
    let mut slots = Slots::new(Flash::new(|| 0xff));
    let room = FLASH_BYTES / 2 - HEAD_BYTES;
    slots.save(1, Some(&model(1, room))).unwrap();
    assert_eq!(slots.save(2, Some(&model(2, room + 1))), Err(SaveError::Length));
    assert_eq!(load(&slots.flash), Some((1, Some(model(1, room)))));
}
