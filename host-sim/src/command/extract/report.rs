//! What `extract --report` writes.

use rotor_edge_desktop::measurement::Reading;

use super::readings;
use crate::extract::Extracted;
use crate::report::bode::bode;
use crate::report::trend::{Trend, trend};
use crate::report::{Curve, Figure, Section, Table, identifier};

/// The whole report; `account` is what was done, in sentences.
pub fn sections(extracted: &[Extracted], account: Vec<String>) -> Vec<Section> {
    let each = extracted.iter().flat_map(|of| of.losses.iter().map(|loss| (&of.file, loss)));
    let losses = each.map(|(file, loss)| {
        let probe = loss.probe.clone().unwrap_or_else(|| "all".into());
        vec![file.clone(), probe, loss.why.into(), loss.windows.to_string(), format!("{:.3}", loss.first_s)]
    });
    let lost = Table {
        caption: "Lost readings".into(),
        columns: ["file", "probe", "why", "windows", "first, s"].map(String::from).to_vec(),
        rows: losses.collect(),
    };
    let tables = if lost.rows.is_empty() { Vec::new() } else { vec![lost] };
    let figures = vec![speed(extracted)];
    let readings = Section { heading: "Readings".into(), paragraphs: account, tables, figures };
    let probes = 0..extracted[0].probes.len();
    let bodes = Section {
        heading: "1x of each probe".into(),
        figures: probes.map(|probe| of_probe(extracted, probe)).collect(),
        ..Section::default()
    };
    vec![readings, bodes]
}

fn speed(extracted: &[Extracted]) -> Figure {
    let points = readings(extracted).filter_map(|r| Some((86_400.0 * r.time_d?, r.speed_rpm)));
    let over_time = Trend {
        along: "time, s".into(),
        quantity: "speed, rpm".into(),
        measured: Some(("readings".into(), points.collect())),
        ..Trend::default()
    };
    let title = "Speed over time";
    Figure {
        id: identifier(title),
        title: title.into(),
        caption: "A gap is where readings were lost.".into(),
        svg: trend(title, &over_time),
    }
}

fn of_probe(extracted: &[Extracted], probe: usize) -> Figure {
    let point = |r: &Reading| Some((r.speed_rpm, r.probes[probe]?));
    let points: Vec<_> = readings(extracted).filter_map(point).collect();
    let curve = |of: &Extracted| {
        let mut points: Vec<_> = of.readings.iter().filter_map(point).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        Some(Curve { label: of.run.clone()?, points })
    };
    let runs: Vec<Curve> = extracted.iter().filter_map(curve).collect();
    let (name, channel) = &extracted[0].probes[probe];
    let title = format!("Probe {name}");
    Figure {
        id: identifier(&title),
        caption: format!(
            "Channel {channel}: amplitude, and phase lag behind the keyphasor's mark, over speed."
        ),
        svg: bode(&title, &points, &runs),
        title,
    }
}
