//! Files made from others, as a slip of the hand, a damaged disk or an enemy would make them.

use rand_core::Rng;
use rand_xoshiro::Xoshiro256PlusPlus;

/// What stands in place of a number.
const NUMBERS: [&str; 16] = [
    "0",
    "-1",
    "1e300",
    "-1e300",
    "1e-300",
    "NaN",
    "inf",
    "-inf",
    "1e400",
    "4294967296",
    "18446744073709551616",
    "-0",
    "0.1.2",
    "1,5",
    "",
    "99999999999999999999999999999999999999",
];

/// A number below `limit`, which is above zero.
fn below(random: &mut Xoshiro256PlusPlus, limit: usize) -> usize {
    (random.next_u64() % limit as u64) as usize
}

/// A copy with one to four changes.
pub fn mutated(seed: &[u8], random: &mut Xoshiro256PlusPlus) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..=below(random, 4) {
        change(&mut bytes, random);
    }
    bytes
}

fn change(bytes: &mut Vec<u8>, random: &mut Xoshiro256PlusPlus) {
    if bytes.is_empty() {
        return bytes.push(random.next_u64() as u8);
    }
    let place = below(random, bytes.len());
    let end = (place + 1 + below(random, 40)).min(bytes.len());
    match below(random, 9) {
        0 => bytes[place] ^= 1 << below(random, 8),
        1 => bytes[place] = random.next_u64() as u8,
        2 => bytes.truncate(place),
        3 => drop(bytes.drain(place..end)),
        4 => bytes.insert(place, random.next_u64() as u8),
        5 => {
            let again = bytes[place..end].to_vec();
            bytes.splice(place..place, again);
        }
        6 => line(bytes, random),
        _ => number(bytes, place, random),
    }
}

/// A line is lost, or comes twice.
fn line(bytes: &mut Vec<u8>, random: &mut Xoshiro256PlusPlus) {
    let mut lines: Vec<Vec<u8>> = bytes.split_inclusive(|byte| *byte == b'\n').map(<[u8]>::to_vec).collect();
    let which = below(random, lines.len());
    if below(random, 2) == 0 {
        lines.remove(which);
    } else {
        let again = lines[which].clone();
        lines.insert(below(random, lines.len()), again);
    }
    *bytes = lines.concat();
}

/// The number at or after a place becomes another.
fn number(bytes: &mut Vec<u8>, place: usize, random: &mut Xoshiro256PlusPlus) {
    let is_part = |byte: &u8| byte.is_ascii_digit() || *byte == b'.';
    let Some(start) = bytes[place..].iter().position(|byte| byte.is_ascii_digit()).map(|at| place + at)
    else {
        return;
    };
    let end =
        bytes[start..].iter().position(|byte| !is_part(byte)).map_or(bytes.len(), |length| start + length);
    bytes.splice(start..end, NUMBERS[below(random, NUMBERS.len())].bytes());
}
