//! A code over a monitor's stored state, by the monitor's own key: this is what monitor N, with that key, wrote.

use hmac::{Hmac, KeyInit, Mac};
use rotor_edge_core::command::{CODE_BYTES, Key};
use sha2::Sha256;

use super::hex::{from_hex, to_hex};

/// Keeps the code apart from those of commands, which are made with the same key.
const DOMAIN: &[u8] = b"rotor-edge state";
const LINE: &str = "code ";

#[derive(Debug, Clone, Copy)]
pub struct StateMac {
    key: Key,
    node: u8,
}

impl StateMac {
    /// The monitor of this number.
    pub fn new(key: Key, node: u8) -> Self {
        Self { key, node }
    }

    /// A text of whole lines, and its code as one more.
    pub fn close(&self, text: &str) -> String {
        let full = self.mac(text).finalize().into_bytes();
        format!("{text}{LINE}{}\n", to_hex(&full[..CODE_BYTES]))
    }

    /// Whether the code at the text's end is this monitor's; `None` if there is none.
    pub fn confirms(&self, text: &str) -> Option<bool> {
        let (before, last) = text.strip_suffix('\n')?.rsplit_once('\n')?;
        let code = from_hex(last.strip_prefix(LINE)?)?;
        let is_ours = self.mac(&format!("{before}\n")).verify_truncated_left(&code).is_ok();
        Some(is_ours && code.len() == CODE_BYTES)
    }

    fn mac(&self, text: &str) -> Hmac<Sha256> {
        let mut mac = Hmac::<Sha256>::new_from_slice(&self.key.0).expect("a key of any length");
        mac.update(DOMAIN);
        mac.update(&[self.node]);
        mac.update(text.as_bytes());
        mac
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "counter 41\nmodel 0102\n";

    #[test]
    fn code_belongs_to_one_text_key_and_monitor() {
        let mac = StateMac::new(Key([7; 32]), 1);
        let closed = mac.close(TEXT);
        assert_eq!(mac.confirms(&closed), Some(true));
        assert_eq!(StateMac::new(Key([7; 32]), 2).confirms(&closed), Some(false));
        assert_eq!(StateMac::new(Key([8; 32]), 1).confirms(&closed), Some(false));
        assert_eq!(mac.confirms(&closed.replace("41", "40")), Some(false));
        let short = closed.trim_end().len() - 2;
        assert_eq!(mac.confirms(&format!("{}\n", &closed[..short])), Some(false), "a shorter code");
        for length in 0..closed.len() {
            assert_eq!(mac.confirms(&closed[..length]), None, "{length} bytes");
        }
    }
}
