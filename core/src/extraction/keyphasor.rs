//! The keyphasor's mark in a sampled channel.

/// Finds rising edges, between samples by linear interpolation.
///
/// ```
/// use rotor_edge_core::extraction::KeyphasorDetector;
/// let mut detector = KeyphasorDetector::new(1000, 200);
/// let marks = [0, 500, 1500, 2000, 900, 1100, 0, 1300].map(|count| detector.push(count));
/// // half-way between 500 and 1500; 900 to 1100 is noise on the mark; a whole new one
/// assert_eq!(marks, [None, None, Some(0.5), None, None, None, None, Some(300.0 / 1300.0)]);
/// ```
#[derive(Debug, Clone, Copy)]
pub struct KeyphasorDetector {
    threshold: i32,
    rearm: i32,
    before: Option<i32>,
    is_armed: bool,
}

impl KeyphasorDetector {
    /// A mark is a rise through `threshold` counts after a fall below `threshold − hysteresis`. For a notch, which makes
    /// the voltage fall, negate the samples and the threshold:
    ///
    /// ```
    /// use rotor_edge_core::extraction::KeyphasorDetector;
    /// let mut detector = KeyphasorDetector::new(-40_000, 1_000);
    /// let marks = [65_535, 60_000, 20_000_u16].map(|count| detector.push(-i32::from(count)));
    /// assert_eq!(marks, [None, None, Some(0.5)]);
    /// ```
    pub const fn new(threshold: i32, hysteresis: i32) -> Self {
        Self { threshold, rearm: threshold.saturating_sub(hysteresis), before: None, is_armed: false }
    }

    /// Forgets the samples before: for samples that do not follow them.
    ///
    /// ```
    /// use rotor_edge_core::extraction::KeyphasorDetector;
    /// let mut detector = KeyphasorDetector::new(1000, 200);
    /// detector.push(0);
    /// detector.restart();
    /// assert_eq!(detector.push(2000), None);
    /// ```
    pub fn restart(&mut self) {
        (self.before, self.is_armed) = (None, false);
    }

    /// Takes a sample; if the mark passed since the one before, how long before this one, in samples: 0 to 1, as
    /// [`Extractor::push`](super::Extractor::push) takes it.
    pub fn push(&mut self, count: i32) -> Option<f32> {
        let before = self.before.replace(count)?;
        self.is_armed |= before < self.rearm || count < self.rearm;
        if !self.is_armed || before >= self.threshold || count < self.threshold {
            return None;
        }
        self.is_armed = false;
        Some(count.abs_diff(self.threshold) as f32 / count.abs_diff(before) as f32)
    }
}
