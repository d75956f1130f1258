//! What is said of the samples of `bayes`: how good they are, day by day, and where those of the last day lie.

use crate::answers::track::{QualityAnswer, SamplingAnswer};
use crate::answers::track_curves::PosteriorSamples;
use crate::render::bars::{Bar, bars};
use crate::render::text::table;
use crate::render::trend::{Trend, trend};
use crate::render::{Figure, PageTable, Section, identifier};
use crate::scale::three_digits;

/// Classes of a histogram.
const CLASSES: usize = 10;
/// R-hat above which a day's chains are said not to have met.
const NOT_MET: f64 = 1.02;

/// What each line of the table is about, with its figures.
fn lines(sampling: &SamplingAnswer) -> Vec<(String, &QualityAnswer)> {
    let own = sampling.sampler;
    let adaptive = sampling.paper.as_ref().and_then(|paper| paper.adaptive_metropolis.as_ref());
    let rows = [
        (format!("{own}, median day"), sampling.median.as_ref()),
        (format!("{own}, worst of all days"), sampling.worst.as_ref()),
        ("adaptive Metropolis, median day".to_string(), adaptive),
    ];
    rows.into_iter().filter_map(|(what, quality)| Some((what, quality?))).collect()
}

/// Whether the chains met, in one sentence.
fn met(sampling: &SamplingAnswer) -> String {
    let apart: Vec<f64> =
        sampling.days.iter().filter(|q| q.r_hat > NOT_MET).filter_map(|q| q.time_d).collect();
    match apart[..] {
        [] => format!("The chains converged on every day: R-hat is {NOT_MET} or less."),
        [first, ..] => format!(
            "On {} of {} days, the first of them day {first:.0}, the chains did not converge (R-hat above {NOT_MET}): the \
             mean of such a day depends on their starting points.",
            apart.len(),
            sampling.days.len()
        ),
    }
}

const COLUMNS: [&str; 5] = ["sampler", "accepted", "R-hat", "effective samples, bulk", "tails"];

fn rows(sampling: &SamplingAnswer) -> Vec<Vec<String>> {
    let row = |(what, q): (String, &QualityAnswer)| {
        vec![
            what,
            format!("{:.1} %", 100.0 * q.acceptance),
            format!("{:.3}", q.r_hat),
            format!("{:.0}", q.effective_samples),
            format!("{:.0}", q.effective_samples_tail),
        ]
    };
    lines(sampling).into_iter().map(row).collect()
}

pub fn text(sampling: &SamplingAnswer) -> String {
    let mut text =
        format!("\nSampling, {} chains of {} proposals a day\n", sampling.chains, sampling.proposals);
    text += &table(&COLUMNS, &rows(sampling));
    text + &format!("  {}\n", met(sampling))
}

fn over_days(sampling: &SamplingAnswer) -> [Figure; 2] {
    let over = |figure: fn(&QualityAnswer) -> f64| {
        sampling.days.iter().filter_map(|q| Some((q.time_d?, figure(q)))).collect::<Vec<_>>()
    };
    let draw = |title: &str, quantity: &str, caption: &str, curves| {
        let drawn =
            Trend { along: "time, days".into(), quantity: quantity.into(), curves, ..Trend::default() };
        Figure::new(title, caption, trend(&drawn))
    };
    [
        draw(
            "R-hat",
            "R-hat",
            "1 when the chains of a day agree; above 1.02 its mean depends on where they began.",
            vec![("R-hat".into(), over(|q| q.r_hat))],
        ),
        draw(
            "Effective samples",
            "effective samples",
            "Independent samples that a day's mean (bulk) and the ends of its intervals (tails) are worth.",
            vec![
                ("bulk".into(), over(|q| q.effective_samples)),
                ("tails".into(), over(|q| q.effective_samples_tail)),
            ],
        ),
    ]
}

/// Where the samples of the last day lie.
fn histogram(samples: &PosteriorSamples) -> Figure {
    let PosteriorSamples { name, unit, values } = samples;
    let (low, high) =
        values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    let width = ((high - low) / CLASSES as f64).max(f64::MIN_POSITIVE);
    let mut counts = [0_usize; CLASSES];
    for v in values {
        counts[(((v - low) / width) as usize).min(CLASSES - 1)] += 1;
    }
    let most = counts.iter().copied().max().unwrap_or(1).max(1) as f64;
    let bar = |(i, count): (usize, &usize)| Bar {
        label: format!(
            "{} to {} {unit}",
            three_digits(low + width * i as f64),
            three_digits(low + width * (i + 1) as f64)
        ),
        share: *count as f64 / most,
        value: format!("{:.1} %", 100.0 * *count as f64 / values.len() as f64),
        emphasised: true,
        floor: None,
    };
    Figure {
        id: identifier(&format!("posterior {name}")),
        drawing: bars(&counts.iter().enumerate().map(bar).collect::<Vec<_>>()).into(),
        title: name.clone(),
        caption: "Posterior of the last day. As wide as its prior where one speed cannot tell.".into(),
    }
}

pub fn section(answer: &SamplingAnswer, posterior: &[PosteriorSamples]) -> Section {
    Section {
        heading: "Sampling".into(),
        paragraphs: vec![format!(
            "{} chains of {} proposals a day, from starts of their own. {}",
            answer.chains,
            answer.proposals,
            met(answer)
        )],
        tables: vec![PageTable {
            caption: "Quality of the samples".into(),
            columns: COLUMNS.map(String::from).to_vec(),
            rows: rows(answer),
        }],
        figures: over_days(answer).into_iter().chain(posterior.iter().map(histogram)).collect(),
    }
}
