//! When the watchdog may be fed: only after every part of the program has come round since the last time, so that one
//! that hangs is not covered by another that runs. What the wire does is none of the program's doing: a bus that is full of
//! frames with precedence, without anybody to acknowledge, or broken resets nobody.

/// A part of the program that must come round.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Frames are taken from the controller, or there were none.
    Receive,
    /// The node was polled at a later time than before.
    Poll,
    /// Frames are handed to the controller, dropped in time, or there were none.
    Send,
}

const ALL: u8 = 0b111;

/// What has come round since the watchdog was fed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Progress {
    seen: u8,
    polled_us: u64,
}

impl Progress {
    pub const fn new() -> Self {
        Self { seen: 0, polled_us: 0 }
    }

    /// A part came round.
    pub fn made(&mut self, part: Part) {
        self.seen |= 1 << part as u8;
    }

    /// The node was polled. A clock that stands still is no progress.
    pub fn polled(&mut self, time_us: u64) {
        if time_us > self.polled_us {
            self.polled_us = time_us;
            self.made(Part::Poll);
        }
    }

    /// Whether to feed the watchdog now; if so, all parts must come round again.
    pub fn may_feed(&mut self) -> bool {
        let all = self.seen == ALL;
        if all {
            self.seen = 0;
        }
        all
    }
}

/// What the CAN controller is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Activity {
    /// Not in step with the bus yet.
    Synchronising,
    /// Nothing is on the wire.
    Idle,
    /// Somebody else's frame is on the wire, one that won the arbitration against ours included.
    Receiving,
    /// Our frame is on the wire.
    Sending,
}

/// What the CAN controller says while frames wait for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wire {
    /// It holds a frame that it is asked to send.
    pub is_asked: bool,
    /// It is error passive or off the bus.
    pub is_faulty: bool,
    /// What it is doing.
    pub activity: Activity,
}

/// A controller that is asked to send and leaves a free wire unused for so long has stopped, µs. It sends after 11 recessive
/// bits, 22 µs at 500 kbit/s; a look between two frames of a full bus finds those, look after look does not.
const UNUSED_US: u64 = 200_000;

/// Whether frames that wait do so because of the wire.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Sending {
    /// Every look since then has found the wire free.
    free_since_us: Option<u64>,
}

impl Sending {
    /// Nothing waits.
    pub const fn new() -> Self {
        Self { free_since_us: None }
    }

    /// All that waited was handed over, or some of it.
    pub fn moved(&mut self) {
        self.free_since_us = None;
    }

    /// Frames wait and none could be handed over. `true` if that is the wire's doing: the controller has a frame in hand and
    /// loses arbitration, is not acknowledged, or is off the bus. `false` if it has none in hand, though some wait, or leaves a
    /// free wire unused.
    pub fn is_held_by(&mut self, time_us: u64, wire: Wire) -> bool {
        self.free_since_us = match wire.activity {
            Activity::Idle => self.free_since_us.or(Some(time_us)),
            _ => None,
        };
        let unused_us = self.free_since_us.map_or(0, |since_us| time_us.saturating_sub(since_us));
        wire.is_faulty || wire.is_asked && unused_us < UNUSED_US
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_after_all_parts_and_then_all_again() {
        let mut progress = Progress::new();
        for time_us in 1..4 {
            assert!(!progress.may_feed());
            progress.made(Part::Receive);
            progress.made(Part::Send);
            assert!(!progress.may_feed());
            progress.polled(time_us);
            assert!(progress.may_feed());
        }
        assert!(!progress.may_feed());
    }

    #[test]
    fn a_clock_that_stands_still_starves_the_watchdog() {
        let mut progress = Progress::new();
        progress.polled(5);
        progress.made(Part::Receive);
        progress.made(Part::Send);
        assert!(progress.may_feed());
        progress.polled(5);
        progress.made(Part::Receive);
        progress.made(Part::Send);
        assert!(!progress.may_feed());
    }

    const LOSING: Wire = Wire { is_asked: true, is_faulty: false, activity: Activity::Receiving };

    /// Time from one pass of the program to the next.
    const PASS_US: u64 = 50_000;

    /// Whether the watchdog is fed at every pass of a program that sends nothing, the wire being as `wire` says.
    fn is_fed(passes: u64, wire: impl Fn(u64) -> Wire) -> bool {
        let (mut progress, mut sending) = (Progress::new(), Sending::new());
        (1..=passes).all(|pass| {
            progress.made(Part::Receive);
            progress.polled(pass * PASS_US);
            if sending.is_held_by(pass * PASS_US, wire(pass)) {
                progress.made(Part::Send);
            }
            progress.may_feed()
        })
    }

    #[test]
    fn a_bus_full_of_frames_with_precedence_resets_nobody() {
        assert!(is_fed(100_000, |_| LOSING));
        // Three bits of each 50 or more lie between frames.
        let pauses = |pass: u64| match pass * 2_654_435_761 % 50 < 3 {
            true => Wire { activity: Activity::Idle, ..LOSING },
            false => LOSING,
        };
        assert!(is_fed(100_000, pauses));
    }

    #[test]
    fn nobody_to_acknowledge_and_bus_off_reset_nobody() {
        for activity in [Activity::Sending, Activity::Synchronising, Activity::Idle] {
            assert!(is_fed(1_000, |_| Wire { is_asked: true, is_faulty: true, activity }));
        }
    }

    #[test]
    fn waiting_frames_of_idle_controller_are_program_fault() {
        for activity in [Activity::Receiving, Activity::Idle, Activity::Sending] {
            assert!(!is_fed(1, |_| Wire { is_asked: false, is_faulty: false, activity }));
        }
    }

    #[test]
    fn controller_ignoring_free_wire_is_reset_but_restarting_is_not() {
        let free = Wire { activity: Activity::Idle, ..LOSING };
        assert!(is_fed(UNUSED_US / PASS_US, |_| free));
        assert!(!is_fed(UNUSED_US / PASS_US + 1, |_| free));
        let mut sending = Sending::new();
        for time_us in 0..UNUSED_US {
            assert!(sending.is_held_by(time_us, free));
        }
        sending.moved();
        assert!(sending.is_held_by(UNUSED_US, free));
    }

    #[test]
    fn a_program_that_hangs_on_a_full_bus_is_reset() {
        let (mut progress, mut sending) = (Progress::new(), Sending::new());
        for pass in 0..100 {
            // It neither takes frames nor polls the node any more.
            if sending.is_held_by(pass * PASS_US, LOSING) {
                progress.made(Part::Send);
            }
            assert!(!progress.may_feed());
        }
    }
}
