//! Every frame that a classic CAN bus carries; what is ours of it is a [`Frame`].

use rotor_edge_core::can::Frame;

const STANDARD_IDS: u32 = 1 << 11;
const EXTENDED_IDS: u32 = 1 << 29;
const HEX: &[u8; 16] = b"0123456789ABCDEF";

/// A data or remote frame with a standard or an extended identifier. Always valid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WireFrame {
    id: u32,
    extended: bool,
    remote: bool,
    length: u8,
    payload: [u8; 8],
}

impl WireFrame {
    /// A data frame; `None` if the identifier is too large or there are more than eight bytes.
    pub fn data(id: u32, extended: bool, bytes: &[u8]) -> Option<Self> {
        let mut frame = Self::remote(id, extended, bytes.len())?;
        frame.remote = false;
        frame.payload[..bytes.len()].copy_from_slice(bytes);
        Some(frame)
    }

    /// A remote frame that asks for `length` bytes; `None` as for [`WireFrame::data`].
    pub fn remote(id: u32, extended: bool, length: usize) -> Option<Self> {
        let ids = if extended { EXTENDED_IDS } else { STANDARD_IDS };
        let valid = id < ids && length <= 8;
        valid.then_some(Self { id, extended, remote: true, length: length as u8, payload: [0; 8] })
    }

    /// Identifier, 11 or 29 bits.
    pub fn id(&self) -> u32 {
        self.id
    }

    /// Whether the identifier has 29 bits.
    pub fn is_extended(&self) -> bool {
        self.extended
    }

    /// Whether it asks for data instead of carrying it.
    pub fn is_remote(&self) -> bool {
        self.remote
    }

    /// Bytes that it carries or asks for.
    pub fn length(&self) -> usize {
        usize::from(self.length)
    }

    /// The bytes that it carries.
    pub fn bytes(&self) -> &[u8] {
        if self.remote { &[] } else { &self.payload[..self.length()] }
    }

    /// Appends the identifier as all text formats have it: three digits, or eight if it is extended.
    pub fn push_id(&self, text: &mut Vec<u8>) {
        let digits = if self.extended { 8 } else { 3 };
        text.extend((0..digits).rev().map(|place| HEX[(self.id >> (4 * place)) as usize & 15]));
    }

    /// The frame, if it is of the kind that our protocol uses.
    pub fn ours(&self) -> Option<Frame> {
        let standard = !self.extended && !self.remote;
        let id = u16::try_from(self.id).ok().filter(|_| standard)?;
        Frame::standard(id, self.bytes())
    }
}

impl From<&Frame> for WireFrame {
    fn from(frame: &Frame) -> Self {
        let mut payload = [0; 8];
        payload[..frame.bytes().len()].copy_from_slice(frame.bytes());
        Self {
            id: u32::from(frame.raw_id()),
            extended: false,
            remote: false,
            length: frame.bytes().len() as u8,
            payload,
        }
    }
}

/// Appends a byte as two hexadecimal digits.
pub fn push_hex(byte: u8, text: &mut Vec<u8>) {
    text.extend([byte >> 4, byte & 15].map(|digit| HEX[usize::from(digit)]));
}

/// Bytes from pairs of hexadecimal digits; `None` for anything else.
pub fn bytes_of_hex(text: &str) -> Option<Vec<u8>> {
    let pair = |pair: &[u8]| match pair {
        [high, low] => Some(digit(*high)? << 4 | digit(*low)?),
        _ => None,
    };
    text.as_bytes().chunks(2).map(pair).collect()
}

/// A number of hexadecimal digits alone: no sign, no blank.
pub fn number_of_hex(text: &str) -> Option<u32> {
    let digits = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    digits.then(|| u32::from_str_radix(text, 16).ok())?
}

fn digit(byte: u8) -> Option<u8> {
    char::from(byte).to_digit(16).map(|digit| digit as u8)
}

/// Frames of every kind, for the tests of all text formats.
#[cfg(test)]
pub mod testing {
    use proptest::prelude::*;

    use super::WireFrame;

    pub fn any_frame() -> impl Strategy<Value = WireFrame> {
        let bytes = proptest::collection::vec(any::<u8>(), 0..=8);
        (any::<u32>(), any::<bool>(), any::<bool>(), bytes).prop_map(|(id, extended, remote, bytes)| {
            let id = id & if extended { 0x1fff_ffff } else { 0x7ff };
            let frame = match remote {
                true => WireFrame::remote(id, extended, bytes.len()),
                false => WireFrame::data(id, extended, &bytes),
            };
            frame.unwrap()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_standard_data_frames_are_ours() {
        let frame = Frame::standard(0x123, &[1, 2]).unwrap();
        assert_eq!(WireFrame::from(&frame).ours(), Some(frame));
        assert_eq!(WireFrame::data(0x123, false, &[1, 2]), Some(WireFrame::from(&frame)));
        assert_eq!(WireFrame::data(0x123, true, &[1, 2]).unwrap().ours(), None);
        assert_eq!(WireFrame::remote(0x123, false, 2).unwrap().ours(), None);
    }

    #[test]
    fn no_frame_has_too_large_an_identifier_or_too_many_bytes() {
        assert_eq!(WireFrame::data(0x800, false, &[]), None);
        assert_eq!(WireFrame::data(0x2000_0000, true, &[]), None);
        assert_eq!(WireFrame::data(1, false, &[0; 9]), None);
        assert_eq!(WireFrame::remote(1, false, 9), None);
    }

    #[test]
    fn hexadecimal_is_digits_and_nothing_else() {
        assert_eq!(bytes_of_hex("00fFa1"), Some(vec![0, 0xff, 0xa1]));
        for bad in ["0", "0g", "+1", " 1"] {
            assert_eq!(bytes_of_hex(bad), None, "{bad}");
        }
        assert_eq!(number_of_hex("7fF"), Some(0x7ff));
        for bad in ["", "+7", "0x7", "100000000"] {
            assert_eq!(number_of_hex(bad), None, "{bad}");
        }
    }
}
