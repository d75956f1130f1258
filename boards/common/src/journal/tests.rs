//! Every place at which power can fail, over several turns of the pages.

use std::vec::Vec;

use super::*;
use crate::testing::{Flash as TestFlash, WORD};

const PAGE: usize = 512;

type Flash = TestFlash<PAGE>;
type Found = Option<(u64, Vec<u8>)>;

fn found(journal: &Journal<Flash>) -> Found {
    let record = journal.last()?;
    assert_eq!(record.nonce, !record.counter);
    Some((record.counter, record.memory.to_vec()))
}

/// The nonce is the counter's complement.
fn append<const PAGE: usize>(
    journal: &mut Journal<TestFlash<PAGE>>,
    counter: u64,
    memory: &[u8],
) -> Result<(), SaveError> {
    journal.append(Record { counter, nonce: !counter, memory })
}

fn memory(version: u8, length: usize) -> Vec<u8> {
    (0..length).map(|place| version ^ place as u8).collect()
}

fn appended(mut journal: Journal<Flash>, number: u8) -> Journal<Flash> {
    append(&mut journal, number.into(), &memory(number, number as usize % (MEMORY_BYTES + 1))).unwrap();
    journal
}

fn want(number: u8) -> Found {
    Some((number.into(), memory(number, number as usize % (MEMORY_BYTES + 1))))
}

#[test]
fn the_last_record_is_found_over_many_turns_of_the_pages() {
    let mut journal = Journal::new(Flash::new(2, || 0));
    assert_eq!(found(&journal), None);
    for number in 0..=255 {
        journal = appended(journal, number);
        assert_eq!(found(&journal), want(number));
    }
    assert_eq!(journal.flash.refused, 0, "a word is written once after an erasure");
    // 256 records, three a page
    assert_eq!(journal.flash.erasures, [43, 43]);
}

#[test]
fn power_cut_leaves_previous_or_new_record_and_free_space() {
    let steps = CELL_BYTES / WORD + 3;
    let mut before = Journal::new(Flash::new(2, || 0xff));
    for number in 1..15 {
        let old = found(&before);
        let mut cuts = 0;
        for power in 1..steps {
            for seed in 0..8 {
                let mut journal = Journal::new(Flash { power, seed, ..before.flash.clone() });
                let result = append(&mut journal, number.into(), &memory(number, number.into()));
                let restarted = journal.flash.restarted();
                let now = found(&Journal::new(restarted.clone()));
                if result.is_ok() {
                    assert_eq!(now, want(number));
                    continue;
                }
                cuts += 1;
                assert!(now == old || now == want(number), "record {number} cut at {power}: {now:?}");
                // Cut again and again, it never loses what it had, and then goes on.
                let mut flash = restarted;
                for again in [1, 2, 7, 19, 20, 3, 1, 1] {
                    let mut journal = Journal::new(Flash { power: again, ..flash });
                    let is_written =
                        append(&mut journal, number.into(), &memory(number, number.into())).is_ok();
                    let now = found(&Journal::new(journal.flash.clone().restarted()));
                    assert!(
                        now == want(number) || (now == old && !is_written),
                        "cut at {power}, then {again}"
                    );
                    flash = journal.flash.restarted();
                }
                let mut journal = Journal::new(flash);
                for next in number..number + 8 {
                    journal = appended(journal, next);
                    assert_eq!(found(&journal), want(next));
                }
            }
        }
        assert!(cuts >= 8 * (CELL_BYTES / WORD - 1), "{cuts} cuts");
        before = appended(before, number);
    }
}

#[test]
fn flipped_bit_in_last_record_falls_back_to_previous() {
    let journal = appended(appended(Journal::new(Flash::new(2, || 0xff)), 40), 41);
    for bit in 0..8 * (HEAD_BYTES + 41) {
        let mut flash = journal.flash.clone();
        flash.bytes[CELL_BYTES + bit / 8] ^= 1 << (bit % 8);
        let journal = Journal::new(flash);
        assert_eq!(found(&journal), want(40), "bit {bit}");
        assert_eq!(found(&appended(journal, 42)), want(42), "bit {bit}");
    }
}

#[test]
fn arbitrary_flash_content_yields_no_record_and_is_writable() {
    let mut seed = Flash::new(2, || 0);
    for fill in 0..=255 {
        let journal = Journal::new(Flash::new(2, || if fill == 0 { seed.random() } else { fill }));
        assert_eq!(found(&journal), None);
        assert_eq!(found(&appended(journal, 9)), want(9));
    }
}

#[test]
fn oversized_memory_is_refused_and_previous_record_stays() {
    let mut journal = appended(Journal::new(Flash::new(2, || 0xff)), 5);
    assert_eq!(append(&mut journal, 6, &[0; MEMORY_BYTES + 1]), Err(SaveError::Length));
    append(&mut journal, 6, &memory(6, MEMORY_BYTES)).unwrap();
    assert_eq!(found(&journal), Some((6, memory(6, MEMORY_BYTES))));
}

#[test]
fn cell_without_nonce_is_read_and_continued() {
    let memory = memory(7, 40);
    let mut cell = [0xff; CELL_BYTES];
    let head = [MARK_WITHOUT_NONCE, 8, 5, 0, memory.len() as u32];
    for (place, value) in head.into_iter().enumerate() {
        cell[4 * place..4 * place + 4].copy_from_slice(&value.to_le_bytes());
    }
    cell[HEAD_BYTES..HEAD_BYTES + memory.len()].copy_from_slice(&memory);
    let check = checksum(&[&cell[..CHECKSUM_PLACE], &memory]);
    cell[CHECKSUM_PLACE..HEAD_BYTES].copy_from_slice(&check.to_le_bytes());
    let mut flash = Flash::new(2, || 0xff);
    flash.bytes[..CELL_BYTES].copy_from_slice(&cell);
    let mut journal = Journal::new(flash);
    assert_eq!(journal.last(), Some(Record { counter: 5, nonce: 0, memory: &memory }));
    append(&mut journal, 6, &memory).unwrap();
    assert_eq!(found(&journal), Some((6, memory)));
}

/// What the module states: pages of 2,048 bytes, one record an hour for 20 years.
#[test]
fn hourly_records_wear_pages_below_ten_thousand_cycles() {
    let mut journal = Journal::new(TestFlash::<2048>::new(2, || 0xff));
    let hours = 20.0 * 365.25 * 24.0;
    let written = 2_600;
    for number in 0..written {
        append(&mut journal, number, &[0; MEMORY_BYTES]).unwrap();
    }
    for erasures in journal.flash.erasures {
        let in_twenty_years = erasures as f64 * hours / written as f64;
        assert!((6_000.0..7_000.0).contains(&in_twenty_years), "{in_twenty_years}");
    }
}
