//! One difference between a recorded answer and the present one.

use std::fmt;

/// A number, a word or a line that is not as recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// JSON path or line.
    pub place: String,
    pub recorded: String,
    pub now: String,
    /// Largest difference that would pass; `None` for words, which have to be equal.
    pub allowed: Option<f64>,
}

impl Difference {
    /// A difference in words, structure or integers.
    pub fn exact(place: &str, recorded: impl fmt::Display, now: impl fmt::Display) -> Self {
        Self { place: place.into(), recorded: recorded.to_string(), now: now.to_string(), allowed: None }
    }

    /// A difference in a number.
    pub fn number(place: &str, recorded: impl fmt::Display, now: impl fmt::Display, allowed: f64) -> Self {
        Self { allowed: Some(allowed), ..Self::exact(place, recorded, now) }
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "    {}", self.place)?;
        writeln!(f, "      recorded  {}", self.recorded)?;
        writeln!(f, "      now       {}", self.now)?;
        match self.allowed {
            Some(allowed) => write!(f, "      allowed   ±{allowed:.3e}"),
            None => write!(f, "      allowed   no difference"),
        }
    }
}
