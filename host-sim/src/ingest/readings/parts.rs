//! Records of parts of a table, which threads read at once, put together in the order of the rows.

use super::record::{LOST, Record, SourcedReading};

impl Record {
    /// A record of the same probes and conditions without readings.
    pub(super) fn empty(&self) -> Self {
        Self {
            probes: self.probes.clone(),
            conditions: self.conditions.clone(),
            tables: self.tables,
            ..Self::default()
        }
    }

    /// Reserves memory for this many further readings, because a growing vector is in memory twice.
    pub(super) fn reserve(&mut self, readings: usize) {
        self.samples.reserve(readings);
        self.phasors.reserve(readings * self.probes.len());
        self.held.reserve(readings * self.probes.len());
        self.condition_values.reserve(readings * self.conditions.len());
    }

    /// Adds the readings of a part that began as [`Self::empty`].
    pub(super) fn append(&mut self, part: Self) {
        let places: Vec<usize> = part.probes.iter().map(|name| self.probe(name)).collect();
        let runs: Vec<u32> = part.runs.iter().map(|name| self.run_named(name)).collect();
        let of_here = |sample: SourcedReading| SourcedReading {
            run: sample.run.map(|run| runs[run as usize]),
            ..sample
        };
        let before = self.phasors.len();
        if self.gaps_v.is_empty() && !part.gaps_v.is_empty() {
            self.gaps_v.resize(before, f64::NAN);
        }
        let has_gaps = !self.gaps_v.is_empty() || !part.gaps_v.is_empty();
        self.samples.extend(part.samples.into_iter().map(of_here));
        put(&mut self.phasors, &part.phasors, &places, self.probes.len(), LOST);
        put(&mut self.held, &part.held, &places, self.probes.len(), false);
        put(&mut self.gaps_v, &part.gaps_v, &places, self.probes.len(), f64::NAN);
        if has_gaps {
            self.gaps_v.resize(self.phasors.len(), f64::NAN);
        }
        self.condition_values.extend(part.condition_values);
        self.skipped.add(&part.skipped);
        self.no_measurement += part.no_measurement;
    }
}

/// Adds rows of the probes of a part to those of all, where the probes of the part have these places.
fn put<T: Copy>(all: &mut Vec<T>, part: &[T], places: &[usize], probes: usize, without: T) {
    if places.iter().copied().eq(0..probes) {
        all.extend(part);
        return;
    }
    for row in part.chunks(places.len().max(1)) {
        let from = all.len();
        all.resize(from + probes, without);
        for (place, value) in places.iter().zip(row) {
            all[from + place] = *value;
        }
    }
}
