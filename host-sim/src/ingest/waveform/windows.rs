//! The core's extraction over a whole recording, four probes at a time.

use std::array;

use rayon::prelude::*;
use rotor_edge_core::extraction::{Extraction, ExtractionConfig, ExtractionError, Extractor, Outcome};
use rotor_edge_core::reading::ProbeVector;

use super::counts::{ChannelCounts, CountsIter};
use super::mark::Mark;

/// Probes of an extractor; as many work side by side as there are groups.
const PROBES: usize = 4;

/// One probe in one window.
#[derive(Debug, Clone, Copy)]
pub struct ProbeWindow {
    pub vector: ProbeVector,
    /// Mean voltage above that of no count, V.
    pub gap_v: f32,
    pub is_clipped: bool,
    pub is_open: bool,
}

/// What the core says of one window.
#[derive(Debug, Clone)]
pub struct Window {
    /// The sample with which it ended.
    pub sample: usize,
    pub speed_rpm: f32,
    pub outcome: Outcome,
    pub drift: f32,
    pub probes: Vec<ProbeWindow>,
}

/// All windows of all probes; `mv_um` and `counts` go by probe.
///
/// # Errors
/// The setting that is not possible.
pub fn windows(
    config: &ExtractionConfig<PROBES>,
    mv_um: &[f32],
    counts: &[ChannelCounts],
    marks: &[Mark],
) -> Result<Vec<Window>, ExtractionError> {
    let groups: Vec<_> = counts.chunks(PROBES).zip(mv_um.chunks(PROBES)).collect();
    let run = |(counts, mv_um): &(&[ChannelCounts], &[f32])| of_group(config, mv_um, counts, marks);
    let extracted: Vec<Vec<(usize, Extraction<PROBES>)>> =
        groups.par_iter().map(run).collect::<Result<_, _>>()?;
    // windows go by the marks alone, so those of all groups are the same
    let windows = (0..extracted[0].len()).map(|w| {
        let (sample, first) = extracted[0][w];
        let of_group = |g: usize| {
            let found = extracted[g][w].1;
            (0..groups[g].0.len()).map(move |probe| seen(&found, probe))
        };
        Window {
            sample,
            speed_rpm: first.reading.speed_rpm,
            outcome: first.outcome,
            drift: first.drift,
            probes: (0..groups.len()).flat_map(of_group).collect(),
        }
    });
    Ok(windows.collect())
}

fn seen(found: &Extraction<PROBES>, probe: usize) -> ProbeWindow {
    ProbeWindow {
        vector: found.reading.probes()[probe],
        gap_v: found.reading.gaps_v()[probe],
        is_clipped: found.clipped >> probe & 1 == 1,
        is_open: found.open >> probe & 1 == 1,
    }
}

fn of_group(
    config: &ExtractionConfig<PROBES>,
    mv_um: &[f32],
    counts: &[ChannelCounts],
    marks: &[Mark],
) -> Result<Vec<(usize, Extraction<PROBES>)>, ExtractionError> {
    let config = ExtractionConfig {
        scale_mv_um: array::from_fn(|probe| mv_um.get(probe).copied().unwrap_or(1.0)),
        ..*config
    };
    let mut channels: Vec<CountsIter> = counts.iter().map(ChannelCounts::iter).collect();
    let mut extractor = Extractor::new(config)?;
    let mut coming = marks.iter().peekable();
    let mut found = Vec::new();
    for sample in 0..counts[0].len() {
        let mark = coming.next_if(|mark| mark.sample == sample).map(|mark| mark.age);
        let mut frame = [0; PROBES];
        for (place, channel) in frame.iter_mut().zip(&mut channels) {
            *place = channel.next().map_or(0, i32::from);
        }
        // a channel that is not there shows what the first does
        let first = frame[0];
        frame[channels.len()..].fill(first);
        let result = extractor.push(frame, mark);
        found.extend(result.map(|extraction| (sample, extraction)));
    }
    Ok(found)
}
