//! Marks of the keyphasor, and what is made of them.

/// Intervals that differ by less are alike, relative to their mean.
pub const ALIKE: f64 = 0.1;
/// A mark that is missing or too many shifts nothing by more than this part of a turn.
pub const OFF_BEAT: f64 = 0.15;
/// Turns without a mark that are filled in, at most.
pub const LONGEST_FILL: usize = 4;
/// So many gaps at equal distances are a wheel's, or one pulse's that fails in each of its turns.
const FEWEST_GAPS: usize = 3;
/// A mark between two samples may be known to one sample only, and so may the length between two.
pub const SAMPLE: f64 = 1.0 + 1e-6;

/// A moment between two samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mark {
    /// The sample after it.
    pub sample: usize,
    /// How long before that sample, in samples, 0 to 1.
    pub age: f32,
}

impl Mark {
    /// At so many samples since the first.
    pub fn between(at: f64) -> Self {
        let sample = at.ceil();
        Self { sample: sample as usize, age: (sample - at) as f32 }
    }

    /// Samples since the first.
    pub fn at(self) -> f64 {
        self.sample as f64 - f64::from(self.age)
    }
}

/// Marks, one a turn, as they are meant.
#[derive(Debug, Default)]
pub struct Repaired {
    pub marks: Vec<Mark>,
    /// Marks that were left out as they came between two turns.
    pub extra: usize,
    /// Marks that did not come and were put in.
    pub filled: usize,
    /// Turns from one gap to the next, where these are equal.
    pub gap_every: Option<usize>,
    /// How many repeat, where marks come at unequal distances throughout.
    pub unequal: Option<UnequalMarks>,
}

/// Marks of a turn that come at unequal distances, turn by turn.
#[derive(Debug, Clone, PartialEq)]
pub struct UnequalMarks {
    /// Parts of a turn from each to the next.
    pub parts: Vec<f64>,
}

/// Lengths between marks, samples.
pub fn intervals(marks: &[Mark]) -> Vec<f64> {
    marks.windows(2).map(|pair| pair[1].at() - pair[0].at()).collect()
}

/// The distance of places that are equally far from one another, each a run of neighbours.
pub fn equal_steps(places: &[usize]) -> Option<usize> {
    let starts: Vec<usize> =
        (0..places.len()).filter(|i| *i == 0 || places[*i] != places[i - 1] + 1).map(|i| places[i]).collect();
    let mut steps = starts.windows(2).map(|pair| pair[1] - pair[0]);
    let first = steps.next()?;
    (starts.len() >= FEWEST_GAPS && steps.all(|step| step == first)).then_some(first)
}
