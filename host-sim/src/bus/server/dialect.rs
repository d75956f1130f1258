//! The server's side of the two text protocols.

use std::time::Duration;

use rotor_edge_core::can::slcan::{ACCEPTED, REFUSED, answer};

use crate::bus::codec::Decoder;
use crate::bus::slcan::{self, Lines};
use crate::bus::socketcand::{self, Messages};
use crate::bus::wire::WireFrame;

/// What a server does about a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reply {
    /// Nothing is to be said.
    Silence,
    Say(&'static str),
    /// This is said, if it is anything, and from then on frames are passed on to the client.
    Join(&'static str),
    /// This is said, and no more frames are passed on to the client.
    Leave(&'static str),
    /// The command is refused with this.
    Refuse(&'static str),
    /// It is counted as refused, and nothing is said.
    Ignore,
}

pub trait Dialect: Default + Send + 'static {
    /// Takes apart what the client sends.
    type Decoder: Decoder + 'static;
    const NAME: &'static str;
    /// Said to a new client.
    const GREETING: &'static str;
    /// Said to a client that is turned away.
    const REFUSAL: &'static str;
    /// What to do about bytes that are neither a frame of this bus nor a command.
    const GARBAGE: Reply;
    /// How long no frame may follow the answer to joining.
    const QUIET: Duration;

    /// What to do about a command.
    fn command(&mut self, text: &str) -> Reply;

    /// Whether the client has opened the bus for sending.
    fn may_send(&self) -> bool;

    /// Appends a frame for the client; nothing if the protocol does not have this kind.
    fn encode(frame: &WireFrame, time_us: u64, bytes: &mut Vec<u8>);
}

/// An SLCAN adapter. It answers every command, as LAWICEL's do: programs wait for that. Frames it takes in silence.
#[derive(Debug, Default)]
pub struct Slcan {
    open: bool,
    listen_only: bool,
}

impl Dialect for Slcan {
    type Decoder = Lines;
    const NAME: &'static str = "slcan";
    const GREETING: &'static str = "";
    const REFUSAL: &'static str = REFUSED;
    const GARBAGE: Reply = Reply::Refuse(REFUSED);
    const QUIET: Duration = Duration::ZERO;

    fn command(&mut self, text: &str) -> Reply {
        let (kind, rest) = text.split_at(1);
        match (kind, rest) {
            ("O" | "L", "") => {
                (self.open, self.listen_only) = (true, kind == "L");
                Reply::Join(ACCEPTED)
            }
            ("C", "") => {
                self.open = false;
                Reply::Leave(ACCEPTED)
            }
            // bit rates: every rate is right on a bus without wires
            ("S" | "s", rate) if rate.bytes().all(|byte| byte.is_ascii_hexdigit()) => Reply::Say(ACCEPTED),
            // no time stamps
            ("Z", "0") => Reply::Say(ACCEPTED),
            ("V" | "N" | "F", "") => Reply::Say(answer(kind.as_bytes()[0])),
            _ => Reply::Refuse(REFUSED),
        }
    }

    fn may_send(&self) -> bool {
        self.open && !self.listen_only
    }

    fn encode(frame: &WireFrame, _: u64, bytes: &mut Vec<u8>) {
        slcan::encode(frame, bytes);
    }
}

/// A socketcand server with one bus, whatever name it is opened by.
#[derive(Debug, Default)]
pub struct Socketcand {
    open: bool,
}

impl Dialect for Socketcand {
    type Decoder = Messages;
    const NAME: &'static str = "socketcand";
    const GREETING: &'static str = "< hi >";
    const REFUSAL: &'static str = "< error no such message >";
    /// socketcand says nothing to a frame that its bus cannot carry; to python-can an answer would be a broken frame.
    const GARBAGE: Reply = Reply::Ignore;
    /// python-can reads the answer to `rawmode` as one packet that holds nothing else.
    const QUIET: Duration = Duration::from_millis(200);

    fn command(&mut self, text: &str) -> Reply {
        match text {
            "rawmode" if self.open => Reply::Join("< ok >"),
            "rawmode" => Reply::Refuse("< error no bus is open >"),
            "echo" => Reply::Say("< echo >"),
            "bcmmode" | "controlmode" | "isotpmode" => Reply::Refuse("< error only rawmode is served >"),
            _ if text.starts_with("open ") => {
                self.open = true;
                Reply::Say("< ok >")
            }
            _ => Reply::Refuse("< error unknown command >"),
        }
    }

    fn may_send(&self) -> bool {
        self.open
    }

    fn encode(frame: &WireFrame, time_us: u64, bytes: &mut Vec<u8>) {
        socketcand::encode_frame(frame, time_us, bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answers<D: Dialect>(commands: &[&str]) -> (Vec<Reply>, bool) {
        let mut dialect = D::default();
        let answers = commands.iter().map(|text| dialect.command(text)).collect();
        (answers, dialect.may_send())
    }

    #[test]
    fn python_cans_way_to_open_slcan_is_accepted() {
        use Reply::{Join, Leave, Say};
        assert_eq!(
            answers::<Slcan>(&["C", "S6", "O", "O"]),
            (vec![Leave("\r"), Say("\r"), Join("\r"), Join("\r")], true)
        );
        assert_eq!(answers::<Slcan>(&["s011C", "L"]), (vec![Say("\r"), Join("\r")], false));
        assert!(!answers::<Slcan>(&["O", "C"]).1);
    }

    #[test]
    fn slcan_says_what_it_is_and_refuses_the_rest() {
        assert_eq!(answers::<Slcan>(&["V"]).0, [Reply::Say("V1013\r")]);
        for text in ["Sx", "Z1", "X", "O1", "d12381", "Q"] {
            assert_eq!(answers::<Slcan>(&[text]).0, [Reply::Refuse(REFUSED)], "{text}");
        }
    }

    #[test]
    fn socketcand_is_opened_before_it_is_joined() {
        use Reply::{Join, Refuse, Say};
        assert_eq!(
            answers::<Socketcand>(&["open vcan0", "rawmode"]),
            (vec![Say("< ok >"), Join("< ok >")], true)
        );
        for text in ["rawmode", "bcmmode", "open", "fly"] {
            let (answers, may_send) = answers::<Socketcand>(&[text]);
            assert!(matches!(answers[..], [Refuse(_)]) && !may_send, "{text}");
        }
    }
}
