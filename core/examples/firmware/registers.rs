//! The state of a monitor as Modbus input registers, and the answer to the request that reads them.
//!
//! | register | content |
//! |---|---|
//! | 0 | state, as the number of [`NodeState`](rotor_edge_core::state::NodeState) |
//! | 1 | reason, [`Reason::code`](rotor_edge_core::state::Reason::code) |
//! | 2 | reason of the latched flag, 0 without one |
//! | 3 | suspected bearing from 1, 0 without one |
//! | 4 | bit i: probe i is missing |
//! | 5 | age of the last verdict, s; 65,535 if there is none or it is older |
//! | 6, 7 | residual ratio e/f, f32, high word first |
//! | 8 … 15 | unbalance of planes 1 and 2, x and y, g·mm, f32, high word first |
//!
//! Numbers that are not known are NaN.

use crc::{CRC_16_MODBUS, Crc, NoTable};
use rotor_edge_core::heapless::Vec;
use rotor_edge_core::monitor::Monitor;
use rotor_edge_core::numerics::Numerics;

pub const REGISTERS: usize = 16;
/// Bytes of the longest answer: address, function, number of bytes, registers, CRC.
pub const ANSWER_BYTES: usize = 3 + 2 * REGISTERS + 2;

const READ_INPUT_REGISTERS: u8 = 4;
const ILLEGAL_FUNCTION: u8 = 1;
const ILLEGAL_ADDRESS: u8 = 2;

// Without a table, of 512 bytes.
static CRC: Crc<u16, NoTable> = Crc::<u16, NoTable>::new(&CRC_16_MODBUS);

/// What the monitor knows at a time, µs.
#[inline(never)] // out of the loop, where it costs less flash
pub fn registers<const SHAPES: usize, const PROBES: usize, C: Numerics<SHAPES, PROBES, 2>>(
    monitor: &Monitor<SHAPES, PROBES, 2, C>,
    time_us: u64,
) -> [u16; REGISTERS] {
    let status = monitor.status(time_us);
    let estimate = monitor.estimate();
    let [first, second] = estimate.map_or([[f32::NAN; 2]; 2], |estimate| {
        let mut planes = estimate.unbalance_g_mm.iter().copied();
        [0; 2].map(|_| planes.next().unwrap_or([f32::NAN; 2]))
    });
    let ratio = estimate.map_or(f32::NAN, |estimate| estimate.residual.ratio);
    let [r0, r1] = words(ratio);
    let [[a0, a1], [b0, b1]] = first.map(words);
    let [[c0, c1], [d0, d1]] = second.map(words);
    [
        status.state as u16,
        status.reason.code().into(),
        status.cause.code().into(),
        status.suspect.map_or(0, |bearing| u16::from(bearing) + 1),
        status.missing_mask.into(),
        status.age_s as u16,
        r0,
        r1,
        a0,
        a1,
        b0,
        b1,
        c0,
        c1,
        d0,
        d1,
    ]
}

fn words(number: f32) -> [u16; 2] {
    let bits = number.to_bits();
    [(bits >> 16) as u16, bits as u16]
}

/// The answer of the device with this address to a frame of Modbus RTU; `None` if the frame is damaged or for somebody else.
#[inline(never)] // out of the loop, where it costs less flash
pub fn answer(frame: &[u8], address: u8, registers: &[u16; REGISTERS]) -> Option<Vec<u8, ANSWER_BYTES>> {
    let (request, crc) = frame.split_last_chunk::<2>()?;
    let &[to, function, ref body @ ..] = request else { return None };
    if u16::from_le_bytes(*crc) != CRC.checksum(request) || to != address {
        return None;
    }
    let mut answer = Vec::new();
    match read(function, body, registers) {
        Ok(read) => {
            answer.extend_from_slice(&[address, function, (2 * read.len()) as u8]).ok()?;
            for register in read {
                answer.extend_from_slice(&register.to_be_bytes()).ok()?;
            }
        }
        Err(exception) => answer.extend_from_slice(&[address, function | 0x80, exception]).ok()?,
    }
    let crc = CRC.checksum(&answer).to_le_bytes();
    answer.extend_from_slice(&crc).ok()?;
    Some(answer)
}

fn read<'a>(function: u8, body: &[u8], registers: &'a [u16; REGISTERS]) -> Result<&'a [u16], u8> {
    if function != READ_INPUT_REGISTERS {
        return Err(ILLEGAL_FUNCTION);
    }
    let &[a, b, c, d] = body else { return Err(ILLEGAL_ADDRESS) };
    let [first, count] = [[a, b], [c, d]].map(|word| usize::from(u16::from_be_bytes(word)));
    registers.get(first..first + count).filter(|read| !read.is_empty()).ok_or(ILLEGAL_ADDRESS)
}
