//! Cascades of what was recorded: of a pair of probes forward and backward, of a probe alone without a sense.

use nalgebra::Complex;

use super::pairs::Pair;
use crate::ingest::waveform::ExtractedFile;
use crate::ingest::waveform::orders::Spectrum;
use crate::render::cascade::{Trace, cascade, tallest_um};
use crate::render::{Figure, Section, identifier};
use crate::scale::three_digits;

/// A speed that changes by less, relative, is one, and spectra are told apart by their time.
const ONE_SPEED: f64 = 0.05;

/// A figure for each pair, and for each probe without one; nothing where no spectrum is.
pub fn section(extracted: &[ExtractedFile], pairs: &[Pair]) -> Option<Section> {
    let alone = (0..extracted[0].probes.len()).filter(|probe| !pairs.iter().any(|pair| pair.has(*probe)));
    let alone: Vec<usize> = alone.collect();
    let of_file = |of: &ExtractedFile| {
        let full = pairs.iter().filter_map(|pair| full(pair, of));
        let half = alone.iter().filter_map(|probe| half(*probe, of));
        full.chain(half).collect::<Vec<_>>()
    };
    let figures: Vec<Figure> = extracted.iter().flat_map(of_file).collect();
    (!figures.is_empty()).then(|| Section {
        heading: "Spectra".into(),
        paragraphs: vec![
            "By order of the running speed, over whole turns with a Hann window. Of two probes at one place: what \
             whirls with the rotation to the right of zero, against it to the left."
                .into(),
        ],
        figures,
        ..Section::default()
    })
}

fn full(pair: &Pair, of: &ExtractedFile) -> Option<Figure> {
    let lines = |spectrum: &Spectrum| -> Option<Vec<(f64, f64)>> {
        let [a, b] = pair.probes.map(|probe| spectrum.probes[probe].as_ref());
        let xy: Vec<[Complex<f64>; 2]> = a?.iter().zip(b?).map(|(a, b)| pair.along_xy(*a, *b)).collect();
        let order = |line: usize| line as f64 / f64::from(spectrum.turns);
        // x + iy turns forward with the mean of (x + iy) e^{−iθ·order}, and backward with that of e^{+iθ·order}
        let i = Complex::<f64>::i();
        let backward = xy.iter().enumerate().skip(1).rev();
        let backward = backward.map(|(line, [x, y])| (-order(line), (x.conj() + i * y.conj()).norm()));
        let forward = xy.iter().enumerate().map(|(line, [x, y])| (order(line), (x + i * y).norm()));
        Some(backward.chain(forward).map(|(order, radius)| (order, 2.0 * radius)).collect())
    };
    figure(&format!("Cascade at {}", pair.name), of, &[-1.0, 1.0, 2.0], lines)
}

fn half(probe: usize, of: &ExtractedFile) -> Option<Figure> {
    let lines = |spectrum: &Spectrum| -> Option<Vec<(f64, f64)>> {
        let means = spectrum.probes[probe].as_ref()?.iter().enumerate();
        let order = |line: usize| line as f64 / f64::from(spectrum.turns);
        Some(means.map(|(line, mean)| (order(line), 4.0 * mean.norm())).collect())
    };
    figure(&format!("Cascade of probe {}", of.probes[probe].name), of, &[1.0, 2.0], lines)
}

/// `lines` are orders and amplitudes in µm peak to peak, of a spectrum that shows them.
fn figure(
    title: &str,
    of: &ExtractedFile,
    multiples: &[f64],
    lines: impl Fn(&Spectrum) -> Option<Vec<(f64, f64)>>,
) -> Option<Figure> {
    let speeds = || of.spectra.iter().map(|s| s.speed_rpm);
    let (lowest, highest) = (speeds().reduce(f64::min)?, speeds().reduce(f64::max)?);
    let is_run = highest > lowest * (1.0 + ONE_SPEED);
    let trace = |spectrum: &Spectrum| {
        let cpm = |(order, high): (f64, f64)| (order * spectrum.speed_rpm, high);
        Some(Trace {
            at: if is_run { spectrum.speed_rpm } else { spectrum.time_s },
            speed_rpm: spectrum.speed_rpm,
            lines: lines(spectrum)?.into_iter().map(cpm).collect(),
        })
    };
    let traces: Vec<Trace> = of.spectra.iter().filter_map(trace).collect();
    if traces.is_empty() {
        return None;
    }
    let run = of.run.as_ref().map_or(String::new(), |run| format!(", run {run}"));
    let title = format!("{title}{run}");
    let up = if is_run { "speed, rpm" } else { "time, s" };
    Some(Figure {
        id: identifier(&title),
        drawing: cascade(up, &traces, multiples).into(),
        caption: format!(
            "Each spectrum stands on its own foot, all to one scale; the tallest line is {} µm pk-pk.",
            three_digits(tallest_um(&traces))
        ),
        title,
    })
}
