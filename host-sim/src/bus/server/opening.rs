//! The first bytes of a connection: a web page can make a browser send any text here, and what stands on lines of their own in
//! it would be taken for frames. No client of ours begins as a browser does.

/// How requests of HTTP begin.
const METHODS: [&[u8]; 10] = [
    b"GET ",
    b"HEAD ",
    b"POST ",
    b"PUT ",
    b"DELETE ",
    b"CONNECT ",
    b"OPTIONS ",
    b"TRACE ",
    b"PATCH ",
    b"PRI ",
];

/// What the first bytes say.
#[derive(Debug, PartialEq, Eq)]
pub enum Opening {
    Undecided,
    Http,
    Other,
}

/// Judges the bytes of a connection so far.
pub fn judge(first: &[u8]) -> Opening {
    let begun = |method: &&&[u8]| method.starts_with(first);
    if METHODS.iter().any(|method| first.starts_with(method)) {
        Opening::Http
    } else if METHODS.iter().find(begun).is_some() {
        Opening::Undecided
    } else {
        Opening::Other
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn browsers_are_told_from_clients_as_soon_as_they_can_be() {
        for (first, opening) in [
            (&b"POST / HTTP/1.1\r\n"[..], Opening::Http),
            (b"OPTIONS * HTTP/1.1", Opening::Http),
            (b"PO", Opening::Undecided),
            (b"C", Opening::Undecided),
            (b"C\r", Opening::Other),
            (b"O\r", Opening::Other),
            (b"t1230\r", Opening::Other),
            (b"< open vcan0 >", Opening::Other),
            (b"\r\r", Opening::Other),
        ] {
            assert_eq!(judge(first), opening, "{first:?}");
        }
    }
}
