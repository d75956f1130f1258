//! `replay --better`: the days after an event, with the model as it was and with a better one.

use std::path::Path;

use anyhow::{Result, bail};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::rotor_file;

use crate::answers::replay::{BetterAnswer, ReplayAnswer};
use crate::edge::Deployment;
use crate::render::trend::{Trend, trend};
use crate::render::{Figure, PageTable, Section};
use crate::replay::{self, AnsweredReading, Flag, Replay, ReplayConfig, day, flags};

/// A better model's answers from one day on.
pub struct Better {
    label: String,
    since_d: f64,
    answers: Vec<AnsweredReading>,
    raised: Vec<Flag>,
}

impl Better {
    /// Deploys the model of a file to a fresh controller and plays the record from a day on; from its
    /// beginning if there is none.
    ///
    /// # Errors
    /// If the file cannot be deployed, or there is no reading from that day on.
    pub fn play(
        path: &Path,
        record: &[Reading],
        since_d: Option<f64>,
        fastest_rpm: f64,
        config: &ReplayConfig,
    ) -> Result<Self> {
        let rotor = rotor_file::read(path)?;
        if rotor.plane.iter().any(|p| p.unbalance_g_mm.is_none()) {
            bail!("{}: [[plane]]: unbalance_g_mm is missing; `rotor-edge improve` writes it", path.display());
        }
        let since_d = since_d.unwrap_or(day(record, 0));
        let from = (0..record.len()).find(|row| day(record, *row) >= since_d);
        let Some(from) = from else {
            bail!("--since {since_d}: the record has no reading from that day on, expected an earlier day")
        };
        let deployment = Deployment::new(&rotor, fastest_rpm)?;
        let config = ReplayConfig { power_cuts_d: Vec::new(), ..config.clone() };
        let played = replay::run(&deployment, &record[from..], &config, |_| ())?;
        let raised = flags(&record[from..], &played.answers);
        let answers = played.answers.iter().map(|a| AnsweredReading { row: a.row + from, ..*a }).collect();
        let kinds: Vec<String> = rotor
            .effect
            .iter()
            .map(|e| e.at.as_ref().map_or_else(|| e.kind.clone(), |at| format!("{}@{at}", e.kind)))
            .filter(|label| !deployment.left_out.contains(label))
            .collect();
        let label =
            if kinds.is_empty() { "better model".into() } else { format!("with {}", kinds.join(", ")) };
        Ok(Self { label, since_d, answers, raised })
    }

    /// Mean residual over feature sum from the day on, of the model as it was and of this one.
    fn ratios(&self, record: &[Reading], before: &Replay) -> [f64; 2] {
        let mean = |answers: &[AnsweredReading]| {
            let after = answers.iter().filter(|a| day(record, a.row) >= self.since_d);
            let ratios: Vec<f64> = after.map(|a| f64::from(a.result.ratio)).collect();
            ratios.iter().sum::<f64>() / ratios.len().max(1) as f64
        };
        [mean(&before.answers), mean(&self.answers)]
    }

    /// Against the model as it was.
    pub fn answer(&self, record: &[Reading], before: &Replay) -> BetterAnswer {
        let [residual_ratio_before, residual_ratio_after] = self.ratios(record, before);
        let flagged = |answers: &[AnsweredReading]| {
            answers.iter().filter(|a| day(record, a.row) >= self.since_d && a.flagged()).count()
        };
        BetterAnswer {
            since_d: self.since_d,
            residual_ratio_before,
            residual_ratio_after,
            flags: self.raised.iter().map(|f| f.time_d).collect(),
            label: self.label.clone(),
            flagged: [flagged(&before.answers), flagged(&self.answers)],
        }
    }
}

/// The residual before and after.
fn table(better: &BetterAnswer) -> PageTable {
    let row = |label: &str, ratio: f64| vec![label.to_string(), format!("{:.1}", 100.0 * ratio)];
    PageTable {
        caption: format!("Residual from day {:.0} on, of the features", better.since_d),
        columns: ["model", "residual, %"].map(String::from).to_vec(),
        rows: vec![
            row("as it was", better.residual_ratio_before),
            row(&better.label, better.residual_ratio_after),
        ],
    }
}

/// The residual over time, and the page below the first screen with the unbalance.
pub fn trends(
    answer: &ReplayAnswer,
    rotor: &Rotor,
    record: &[Reading],
    played: &Replay,
    better: Option<&Better>,
) -> (Figure, Vec<Section>) {
    let series = |value: &dyn Fn(&AnsweredReading) -> f64| {
        let points = |answers: &[AnsweredReading]| {
            answers.iter().map(|a| (day(record, a.row), value(a))).collect::<Vec<_>>()
        };
        let mut curves = vec![("model as it was".to_string(), points(&played.answers))];
        curves.extend(better.map(|b| (b.label.clone(), points(&b.answers))));
        curves
    };
    let figure = |title: String, quantity: &str, caption: &str, curves| {
        let drawn = Trend {
            along: answer.job.dates.axis(),
            quantity: quantity.into(),
            curves,
            flags: answer.flags.iter().map(|f| f.time_d).collect(),
            begin: answer.job.dates.iso(0.0),
            ..Trend::default()
        };
        Figure::new(title, caption, trend(&drawn))
    };
    let fallen = if better.is_some() { " The better model brings it back to the noise." } else { "" };
    let residual = figure(
        "Residual".into(),
        "residual / features, %",
        &format!("What the model does not explain. A step up that stays is a change of the machine.{fallen}"),
        series(&|a| 100.0 * f64::from(a.result.ratio)),
    );
    let plane = |k: usize| {
        figure(
            format!("Unbalance in plane {}", rotor.plane[k].name),
            "unbalance, g·mm",
            "While the model does not fit, its error is in the unbalance.",
            series(&|a| {
                let [x, y] = a.result.unbalance_g_mm[k];
                f64::from(x.hypot(y))
            }),
        )
    };
    let section = Section {
        heading: "Unbalance".into(),
        paragraphs: Vec::new(),
        tables: answer.better.iter().map(table).collect(),
        figures: (0..rotor.plane.len()).map(plane).collect(),
    };
    (residual, vec![section])
}
