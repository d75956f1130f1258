//! A device's number and key, given as text when its firmware is built.

use rotor_edge_core::can::MAX_NODE;
use rotor_edge_core::command::{KEY_BYTES, Key};

/// A node's number from text; `default` without one.
///
/// # Panics
/// If it is not a number from 0 to [`MAX_NODE`]: at compile time, in a constant.
pub const fn node(text: Option<&str>, default: u8) -> u8 {
    let Some(text) = text else { return default };
    match u8::from_str_radix(text, 10) {
        Ok(node) if node <= MAX_NODE => node,
        _ => panic!("the node's number must be from 0 to 30"),
    }
}

/// A key of 64 hexadecimal digits, as `rotor-edge key` writes it; without one the node takes no commands.
///
/// # Panics
/// If it is anything else: at compile time, in a constant.
pub const fn key(text: Option<&str>) -> Option<Key> {
    let Some(text) = text else { return None };
    let digits = text.as_bytes();
    assert!(digits.len() == 2 * KEY_BYTES, "the key must have 64 hexadecimal digits");
    let mut key = [0; KEY_BYTES];
    let mut place = 0;
    while place < KEY_BYTES {
        key[place] = digit(digits[2 * place]) << 4 | digit(digits[2 * place + 1]);
        place += 1;
    }
    Some(Key(key))
}

const fn digit(character: u8) -> u8 {
    match (character as char).to_digit(16) {
        Some(digit) => digit as u8,
        None => panic!("the key must have 64 hexadecimal digits"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn number_and_key_are_read_from_text() {
        assert_eq!((node(None, 1), node(Some("30"), 1)), (1, 30));
        let text = "00112233445566778899aabbccddeeffFFEEDDCCBBAA99887766554433221100";
        let key = key(Some(text)).unwrap();
        assert_eq!((key.0[1], key.0[15], key.0[16], key.0[31]), (0x11, 0xff, 0xff, 0x00));
        assert_eq!(super::key(None), None);
    }

    #[test]
    #[should_panic(expected = "0 to 30")]
    fn a_number_that_is_reserved_does_not_compile() {
        node(Some("31"), 1);
    }

    #[test]
    #[should_panic(expected = "64 hexadecimal digits")]
    fn a_key_cut_short_does_not_compile() {
        key(Some("0011"));
    }
}
