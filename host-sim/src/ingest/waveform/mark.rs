//! A mark of the keyphasor.

/// A moment between two samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mark {
    /// The sample after it.
    pub sample: usize,
    /// How long before that sample, in samples, 0 to 1.
    pub age: f32,
}

impl Mark {
    /// Samples since the first.
    pub fn at(self) -> f64 {
        self.sample as f64 - f64::from(self.age)
    }
}
