//! How full the bus is, from the frames heard: every frame stuffed at its worst, so that the estimate is an upper bound.

use rotor_edge_core::can::Frame;

use crate::bus::frame_bits;

const SLICES: usize = 20;
const SLICE_US: u64 = 100_000;

/// Bits and frames of the last two seconds, in slices, and of all the time.
#[derive(Debug, Clone, Copy, Default)]
pub struct Load {
    slices: [Slice; SLICES],
    bits: u64,
}

/// What was heard in one slice of time.
#[derive(Debug, Clone, Copy, Default)]
struct Slice {
    /// Counted from the start.
    number: u64,
    bits: u64,
    frames: u64,
}

impl Load {
    pub fn take(&mut self, time_us: u64, frame: &Frame) {
        let bits = u64::from(frame_bits(frame));
        self.bits += bits;
        let number = time_us / SLICE_US;
        let slice = &mut self.slices[(number % SLICES as u64) as usize];
        if slice.number != number {
            *slice = Slice { number, ..Slice::default() };
        }
        slice.bits += bits;
        slice.frames += 1;
    }

    pub fn bits_a_second(&self, now_us: u64) -> f64 {
        self.lately(now_us, |slice| slice.bits)
    }

    pub fn frames_a_second(&self, now_us: u64) -> f64 {
        self.lately(now_us, |slice| slice.frames)
    }

    /// Bits a second since the start.
    pub fn mean_bits_a_second(&self, now_us: u64) -> f64 {
        a_second(self.bits, now_us)
    }

    fn lately(&self, now_us: u64, what: impl Fn(&Slice) -> u64) -> f64 {
        let now = now_us / SLICE_US;
        let oldest = (now + 1).saturating_sub(SLICES as u64);
        let recent = self.slices.iter().filter(|slice| (oldest..=now).contains(&slice.number));
        a_second(recent.map(what).sum(), now_us - oldest * SLICE_US)
    }
}

fn a_second(number: u64, time_us: u64) -> f64 {
    if time_us == 0 { 0.0 } else { number as f64 * 1e6 / time_us as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A full frame has 135 bits at worst: 111 and 24 stuffed.
    fn busy(from_us: u64, to_us: u64, every_us: u64) -> Load {
        let mut load = Load::default();
        for time_us in (from_us..to_us).step_by(every_us as usize) {
            load.take(time_us, &Frame::standard(0x123, &[0; 8]).unwrap());
        }
        load
    }

    #[test]
    fn a_steady_load_is_that_worked_out_by_hand() {
        let load = busy(0, 10_000_000, 1_000);
        // 1,000 frames a second of 135 bits: 27 % of 500 kbit/s
        for now_us in [10_000_000, 9_999_999] {
            assert!((load.bits_a_second(now_us) / 135_000.0 - 1.0).abs() < 1e-5, "{now_us}");
            assert!((load.mean_bits_a_second(now_us) / 135_000.0 - 1.0).abs() < 1e-6);
        }
        assert_eq!(load.frames_a_second(9_999_999).round(), 1_000.0);
    }

    #[test]
    fn two_seconds_of_silence_empty_it_and_the_mean_remembers() {
        let load = busy(0, 1_000_000, 1_000);
        assert!((load.bits_a_second(1_000_000) / 135_000.0 - 1.0).abs() < 1e-6);
        assert_eq!(load.frames_a_second(3_000_000), 0.0);
        assert!((load.mean_bits_a_second(10_000_000) / 13_500.0 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn nothing_heard_at_time_zero_is_no_load() {
        assert_eq!(Load::default().bits_a_second(0), 0.0);
        assert_eq!(busy(0, 1, 1).frames_a_second(0), 0.0);
    }
}
