//! Every place at which power can fail, and every bit that can be damaged.

use std::vec;
use std::vec::Vec;

use super::*;
use crate::testing::{Flash as TestFlash, WORD};

const PAGE: usize = 64;
const PAGES: usize = 16;
const FLASH_BYTES: usize = PAGES * PAGE;

type Flash = TestFlash<PAGE>;
/// Counter, model, thresholds.
type Found = (u64, Result<(Vec<u8>, Vec<u8>), Missing>);

fn blank() -> Flash {
    Flash::new(PAGES, || 0xff)
}

fn found(slots: &Slots<Flash>) -> Found {
    let Stored { counter, state } = slots.load();
    (counter, state.map(|state| (state.model.to_vec(), state.thresholds.to_vec())))
}

fn load(flash: &Flash) -> Found {
    found(&Slots::new(flash.clone()))
}

fn model(version: u8, length: usize) -> Vec<u8> {
    (0..length).map(|place| version ^ place as u8).collect()
}

fn both<'a>(model: &'a [u8], thresholds: &'a [u8]) -> Change<'a> {
    Change { model: Some(model), thresholds: Some(thresholds) }
}

fn only_model(model: &[u8]) -> Change<'_> {
    Change { model: Some(model), thresholds: None }
}

fn saved(mut slots: Slots<Flash>, counter: u64, change: Change<'_>) -> Slots<Flash> {
    slots.save(counter, change).unwrap();
    assert_eq!(slots.flash.refused, 0, "a word is written once after an erasure");
    slots
}

/// Cuts power at each step of a save, twice over: the restarted board is cut again while it saves.
fn cut_everywhere(before: &Flash, counter: u64, change: Change<'_>) {
    let old = load(before);
    let want = found(&saved(Slots::new(before.clone()), counter, change));
    // On flash that was never saved to, a save that was cut is seen to have been begun.
    let is_old =
        |now: &Found| *now == old || old == (0, Err(Missing::Nothing)) && *now == (0, Err(Missing::Damaged));
    let steps = FLASH_BYTES / WORD;
    let mut cuts = 0;
    for power in 1..steps {
        for seed in 0..8 {
            let mut slots = Slots::new(Flash { power, seed, ..before.clone() });
            let result = slots.save(counter, change);
            let restarted = slots.flash.restarted();
            let now = load(&restarted);
            if result.is_ok() {
                assert_eq!(now, want);
                continue;
            }
            cuts += 1;
            assert!(is_old(&now) || now == want, "cut at {power}: {now:?}");
            for again in 1..steps {
                let mut slots = Slots::new(Flash { power: again, ..restarted.clone() });
                let result = slots.save(counter, change);
                let now = load(&slots.flash.restarted());
                assert!(now == want || (result.is_err() && is_old(&now)), "cut at {power}, then {again}");
            }
        }
    }
    assert!(cuts >= 8 * 8, "the save was cut in {cuts} places");
}

#[test]
fn power_cut_leaves_old_or_new_slot() {
    let (first, second, third) = (model(1, 200), model(2, 77), model(3, 210));
    cut_everywhere(&blank(), 1, both(&first, &[1; 40]));
    let slots = saved(Slots::new(blank()), 1, both(&first, &[1; 40]));
    cut_everywhere(&slots.flash, 2, only_model(&second));
    let slots = saved(slots, 2, only_model(&second));
    cut_everywhere(&slots.flash, 3, both(&third, &[7; 33]));
    cut_everywhere(&slots.flash, 3, Change { model: None, thresholds: Some(&[9; 50]) });
    cut_everywhere(&slots.flash, 3, Change::default());
}

#[test]
fn arbitrary_flash_content_yields_no_slot_and_is_writable() {
    let mut seed = Flash::new(PAGES, || 0);
    for fill in 0..=255 {
        let flash = Flash::new(PAGES, || if fill == 0 { seed.random() } else { fill });
        assert_eq!(load(&flash), (0, Err(Missing::Nothing)));
        let slots = saved(Slots::new(flash), 9, only_model(&[1, 2, 3]));
        assert_eq!(found(&slots), (9, Ok((vec![1, 2, 3], vec![]))));
    }
}

#[test]
fn what_does_not_change_stays_or_is_still_missing() {
    let slots = saved(Slots::new(blank()), 5, Change::default());
    assert_eq!(found(&slots), (5, Err(Missing::Nothing)));
    let slots = saved(slots, 6, both(&model(4, 100), &[8; 20]));
    let slots = saved(slots, u64::MAX, Change::default());
    assert_eq!(found(&slots), (u64::MAX, Ok((model(4, 100), vec![8; 20]))));
    let slots = saved(slots, u64::MAX, Change { model: None, thresholds: Some(&[3; 70]) });
    assert_eq!(found(&slots), (u64::MAX, Ok((model(4, 100), vec![3; 70]))));
    let slots = saved(slots, u64::MAX, only_model(&model(5, 10)));
    assert_eq!(found(&slots), (u64::MAX, Ok((model(5, 10), vec![3; 70]))));
}

#[test]
fn the_newest_is_found_over_the_end_of_the_numbers() {
    let mut slots = Slots::new(blank());
    for counter in 0..10 {
        slots = saved(slots, counter, only_model(&model(counter as u8, 40)));
        // The next two saves then straddle the wrap.
        if counter == 0 {
            let head = Head { number: u32::MAX - 1, ..Head::decode(slots.slot(0)).unwrap() };
            slots.flash.bytes[..HEAD_BYTES].copy_from_slice(&head.encode());
        }
        assert_eq!(found(&slots), (counter, Ok((model(counter as u8, 40), vec![]))));
    }
}

#[test]
fn flipped_bit_never_restores_replaced_model_or_older_counter() {
    let slots = saved(Slots::new(blank()), 1, both(&model(1, 50), &[1; 20]));
    let slots = saved(slots, 2, both(&model(2, 50), &[1; 20]));
    let start = slots.start(1) as usize;
    let used = (0..HEAD_BYTES + 50).chain(thresholds_place(50)..thresholds_place(50) + 20);
    for bit in used.flat_map(|byte| 8 * byte..8 * byte + 8) {
        let mut flash = slots.flash.clone();
        flash.bytes[start + bit / 8] ^= 1 << (bit % 8);
        let want = match bit / 8 {
            // A head that is not whole is one that was being written.
            0..HEAD_BYTES => (1, Ok((model(1, 50), vec![1; 20]))),
            _ => (2, Err(Missing::Damaged)),
        };
        assert_eq!(load(&flash), want, "bit {bit}");
        // What is damaged does not become whole by being saved again.
        let again = saved(Slots::new(flash), 3, Change::default());
        assert_eq!(found(&again), (3, want.1), "bit {bit}");
    }
}

#[test]
fn equal_previous_slot_serves_until_new_one_is_complete() {
    let slots = saved(Slots::new(blank()), 1, both(&model(1, 50), &[1; 20]));
    let slots = saved(slots, 2, Change::default());
    let (start, want) = (slots.start(1) as usize, Ok((model(1, 50), vec![1; 20])));
    for bit in 8 * HEAD_BYTES..8 * (HEAD_BYTES + 50) {
        let mut flash = slots.flash.clone();
        flash.bytes[start + bit / 8] ^= 1 << (bit % 8);
        assert_eq!(load(&flash), (2, want.clone()), "bit {bit}");
        let mut cut = Slots::new(Flash { power: 5, ..flash.clone() });
        assert!(cut.save(3, Change::default()).is_err());
        assert_eq!(load(&cut.flash.restarted()).1, want, "bit {bit}");
        assert_eq!(found(&saved(Slots::new(flash), 3, Change::default())), (3, want.clone()), "bit {bit}");
    }
}

#[test]
fn damaged_heads_still_show_that_a_model_existed() {
    let slots = saved(Slots::new(blank()), 1, only_model(&model(1, 50)));
    let mut flash = slots.flash;
    flash.bytes[8] ^= 1;
    assert_eq!(load(&flash), (0, Err(Missing::Damaged)));
}

#[test]
fn the_layout_before_gives_its_counter_and_its_model() {
    let old = |number: u32, counter: u64, model: &[u8]| -> Vec<u8> {
        let mut head = [0; HEAD_BYTES];
        let words = [OLD_MARK, number, counter as u32, (counter >> 32) as u32, model.len() as u32];
        for (place, word) in words.into_iter().enumerate() {
            head[4 * place..][..4].copy_from_slice(&word.to_le_bytes());
        }
        let check = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&[&head[..], model].concat());
        head[28..].copy_from_slice(&check.to_le_bytes());
        [&head[..], model].concat()
    };
    let mut flash = blank();
    for (slot, number) in [(0, 6), (1, 7)] {
        let bytes = old(number, 10 + u64::from(number), &model(number as u8, 60));
        flash.bytes[slot * FLASH_BYTES / 2..][..bytes.len()].copy_from_slice(&bytes);
    }
    assert_eq!(load(&flash), (17, Ok((model(7, 60), vec![]))));
    cut_everywhere(&flash, 18, both(&model(8, 70), &[1; 30]));
    // A counter is as good without its model.
    let slots = saved(Slots::new(flash), 18, Change::default());
    assert_eq!(found(&slots), (18, Ok((model(7, 60), vec![]))));
}

#[test]
fn oversized_state_is_refused_and_old_state_stays() {
    let room = FLASH_BYTES / 2 - HEAD_BYTES;
    let mut slots = saved(Slots::new(blank()), 1, only_model(&model(1, room)));
    assert_eq!(slots.save(2, only_model(&model(2, room + 1))), Err(SaveError::Length));
    assert_eq!(slots.save(2, both(&model(2, room), &[1])), Err(SaveError::Length));
    assert_eq!(slots.save(2, only_model(&model(2, 70_000))), Err(SaveError::Length));
    assert_eq!(found(&slots), (1, Ok((model(1, room), vec![]))));
}
