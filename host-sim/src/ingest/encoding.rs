//! The characters of a text file.

use encoding_rs::{Encoding, UTF_8, UTF_16BE, UTF_16LE, WINDOWS_1252};

/// Bytes from which UTF-16 without a mark is told.
const LOOKED_AT: usize = 2000;

/// The text of a file: by its byte order mark, as UTF-16 if every other byte is zero, as UTF-8 if it is valid,
/// else as Windows-1252. Nothing if it is not text.
pub fn decoded(mut bytes: Vec<u8>) -> Option<String> {
    let (encoding, mark) = Encoding::for_bom(&bytes).unwrap_or_else(|| (without_mark(&bytes), 0));
    let text = if encoding == UTF_8 {
        // of a long file a copy would be as long
        bytes.drain(..mark);
        String::from_utf8(bytes).ok()?
    } else {
        let (text, damaged) = encoding.decode_without_bom_handling(&bytes[mark..]);
        let lost = damaged && encoding != WINDOWS_1252;
        (!lost).then(|| text.into_owned())?
    };
    let control = |c: char| c.is_control() && !matches!(c, '\t' | '\r' | '\n' | '\u{c}' | '\u{1a}');
    (!text.chars().take(LOOKED_AT).any(control)).then_some(text)
}

fn without_mark(bytes: &[u8]) -> &'static Encoding {
    let start = &bytes[..bytes.len().min(LOOKED_AT)];
    let zeros = |first: usize| start.iter().skip(first).step_by(2).filter(|b| **b == 0).count();
    // measurements are mostly digits and separators, whose upper byte is zero
    let mostly = |zeros: usize| start.len() >= 4 && 4 * zeros > start.len();
    match () {
        () if mostly(zeros(1)) && zeros(0) == 0 => UTF_16LE,
        () if mostly(zeros(0)) && zeros(1) == 0 => UTF_16BE,
        () if std::str::from_utf8(bytes).is_ok() => UTF_8,
        () => WINDOWS_1252,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn utf_16(text: &str, mark: bool, bytes: fn(u16) -> [u8; 2]) -> Vec<u8> {
        let mark = mark.then_some(0xfeff);
        mark.into_iter().chain(text.encode_utf16()).flat_map(bytes).collect()
    }

    #[test]
    fn text_is_equal_in_every_encoding_and_picture_is_refused() {
        let text = "Zeit;Drehzahl;16X 1X [µm]\r\n1;11000;12,5\r\n";
        let latin = text.chars().map(|c| c as u32 as u8).collect();
        let marked = [b"\xef\xbb\xbf", text.as_bytes()].concat();
        let mut files = vec![text.as_bytes().to_vec(), marked, latin];
        for mark in [true, false] {
            files.extend([utf_16(text, mark, u16::to_le_bytes), utf_16(text, mark, u16::to_be_bytes)]);
        }
        for bytes in files {
            assert_eq!(decoded(bytes.clone()).as_deref(), Some(text), "{bytes:?}");
        }
        assert_eq!(decoded(b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR".to_vec()), None);
    }
}
