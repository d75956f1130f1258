//! What arbitrary bytes are given to, one function a decoder, and what must hold whatever they are: nothing panics, and
//! what is accepted survives being written and read again. The fuzz targets and the replay of their corpus call these.

pub mod command;
pub mod extraction;
pub mod frames;
pub mod lines;
pub mod model;
pub mod node;
pub mod transfer;

use rotor_edge_core::can::Frame;
use rotor_edge_core::reading::{ProbeVector, Reading};

/// What arbitrary bytes are given to.
pub type Decoder = fn(&[u8]);

/// Every decoder by the name of its fuzz target.
pub const ALL: [(&str, Decoder); 12] = [
    ("node", node::node),
    ("memory", node::memory),
    ("message", frames::message),
    ("assembler", frames::assembler),
    ("result_assembler", frames::result_assembler),
    ("isotp", transfer::isotp),
    ("slcan", lines::slcan),
    ("model", model::model),
    ("request", command::request),
    ("answer", command::answer),
    ("thresholds", command::thresholds),
    ("extraction", extraction::extraction),
];

/// Arbitrary bytes, taken from the front; zeros when there are no more.
pub struct Bytes<'a>(pub &'a [u8]);

impl<'a> Bytes<'a> {
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn array<const N: usize>(&mut self) -> [u8; N] {
        let mut array = [0; N];
        for (place, byte) in array.iter_mut().zip(self.slice(N)) {
            *place = *byte;
        }
        array
    }

    /// So many bytes, or what is left.
    pub fn slice(&mut self, length: usize) -> &'a [u8] {
        let (taken, rest) = self.0.split_at(length.min(self.0.len()));
        self.0 = rest;
        taken
    }

    pub fn u8(&mut self) -> u8 {
        u8::from_le_bytes(self.array())
    }

    pub fn u16(&mut self) -> u16 {
        u16::from_le_bytes(self.array())
    }

    pub fn f32(&mut self) -> f32 {
        f32::from_le_bytes(self.array())
    }

    /// Identifier, length and payload.
    pub fn frame(&mut self) -> Frame {
        let id = self.u16() & 0x7ff;
        let length = usize::from(self.u8() % 9);
        Frame::standard(id, self.slice(length)).expect("eleven bits, eight bytes")
    }

    /// Speed, number of probes, their vectors in steps of 10 nm, and which of them are lost.
    pub fn reading(&mut self) -> Reading {
        let speed_rpm = f32::from(self.u16());
        let count = 1 + usize::from(self.u8() % 8);
        let mut part = || f32::from(self.u16() as i16) * 0.01;
        let probes: Vec<ProbeVector> =
            (0..count).map(|_| ProbeVector { cos_um: part(), sin_um: part() }).collect();
        let mut reading = Reading::new(speed_rpm, &probes).expect("one to eight");
        reading.lose(self.u8());
        reading
    }
}

/// Bytes with the CRC-32 behind them that makes a decoder read them.
pub fn with_crc32(mut bytes: Vec<u8>) -> Vec<u8> {
    let crc32 = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&bytes);
    bytes.extend(crc32.to_le_bytes());
    bytes
}
