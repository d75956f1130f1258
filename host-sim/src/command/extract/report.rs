//! What `extract --report` writes.

use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::units::SECONDS_A_DAY;

use super::pairs::{Pair, pairs};
use super::{readings, spectra};
use crate::ingest::waveform::{ExtractedFile, Probe};
use crate::render::bode::bode;
use crate::render::centreline::centreline;
use crate::render::orbit::{OrbitPanel, orbit};
use crate::render::trend::{Trend, trend};
use crate::render::{Curve, Figure, PageTable, Section, identifier};
use crate::scale::rpm;

/// Orbits of a run, at most.
const ORBITS: usize = 4;
/// Speeds that differ by less are one, relative.
const ONE_SPEED: f64 = 0.02;

/// The probe that moves most.
pub fn largest(extracted: &[ExtractedFile]) -> usize {
    let size = |probe: usize| {
        let sizes = readings(extracted).filter_map(|r| r.probes[probe]).map(|vector| vector.norm());
        sizes.fold(0.0, f64::max)
    };
    (0..extracted[0].probes.len()).max_by(|a, b| size(*a).total_cmp(&size(*b))).unwrap_or(0)
}

/// What stands below the first screen, which shows the probe `largest`; `account` is what was done, in sentences.
pub fn sections(
    extracted: &[ExtractedFile],
    rotor: Option<&Rotor>,
    account: Vec<String>,
    largest: usize,
) -> Vec<Section> {
    let each = extracted.iter().flat_map(|of| of.losses.iter().map(|loss| (&of.file, loss)));
    let losses = each.map(|(file, loss)| {
        let probe = loss.probe.clone().unwrap_or_else(|| "all".into());
        vec![file.clone(), probe, loss.why.into(), loss.windows.to_string(), format!("{:.3}", loss.first_s)]
    });
    let lost = PageTable {
        caption: "Lost readings".into(),
        columns: ["file", "probe", "why", "windows", "first, s"].map(String::from).to_vec(),
        rows: losses.collect(),
    };
    let tables = if lost.rows.is_empty() { Vec::new() } else { vec![lost] };
    let figures = vec![speed(extracted)];
    let readings = Section { heading: "Readings".into(), paragraphs: account, tables, figures };
    let probes = (0..extracted[0].probes.len()).filter(|probe| *probe != largest);
    let bodes = Section {
        heading: "1x of the other probes".into(),
        figures: probes.map(|probe| of_probe(extracted, probe)).collect(),
        ..Section::default()
    };
    let pairs = pairs(rotor, &extracted[0].probes);
    let orbits = Section {
        heading: "Orbits".into(),
        paragraphs: vec![seen_along(
            rotor,
            "The path of the shaft's centre at 1x; dots where the keyphasor's mark is.",
        )],
        figures: pairs
            .iter()
            .flat_map(|pair| extracted.iter().filter_map(move |of| orbits_of(pair, of)))
            .collect(),
        ..Section::default()
    };
    let centrelines = Section {
        heading: "Shaft centreline".into(),
        paragraphs: vec![seen_along(
            rotor,
            "Where the mean gap voltages say that the shaft's centre was, from where it was in the first reading (dot).",
        )],
        figures: pairs.iter().filter_map(|pair| centreline_of(pair, extracted)).collect(),
        ..Section::default()
    };
    let paths = [orbits, centrelines].into_iter().filter(|section| !section.figures.is_empty());
    let spectra = spectra::section(extracted, &pairs);
    let bodes = Some(bodes).filter(|bodes| !bodes.figures.is_empty());
    std::iter::once(readings).chain(bodes).chain(paths).chain(spectra).collect()
}

fn seen_along(rotor: Option<&Rotor>, what: &str) -> String {
    let axes = match rotor {
        Some(_) => "Seen along the shaft, by the angles of the probes.",
        None => "x and y are the directions of the probes; with --rotor, those of the machine.",
    };
    format!("{what} {axes}")
}

/// At up to four speeds from the lowest to the highest.
fn orbits_of(pair: &Pair, of: &ExtractedFile) -> Option<Figure> {
    let mut panels: Vec<OrbitPanel> = (of.readings.iter())
        .filter_map(|r| {
            let measured_m = pair.phasors_m(r)?;
            Some(OrbitPanel { speed_rpm: r.speed_rpm, measured_m, models_m: Vec::new() })
        })
        .collect();
    panels.sort_by(|a, b| a.speed_rpm.total_cmp(&b.speed_rpm));
    let [lowest, highest] = [panels.first()?, panels.last()?].map(|panel| panel.speed_rpm);
    let steps = if highest > lowest * (1.0 + ONE_SPEED) { ORBITS - 1 } else { 0 };
    let nearest = |step: usize| {
        let wanted = lowest + (highest - lowest) * step as f64 / steps.max(1) as f64;
        let off = |panel: &&OrbitPanel| (panel.speed_rpm - wanted).abs();
        panels.iter().min_by(|a, b| off(a).total_cmp(&off(b))).cloned()
    };
    let mut chosen: Vec<OrbitPanel> = (0..=steps).filter_map(nearest).collect();
    chosen.dedup();
    let run = of.run.as_ref().map_or(String::new(), |run| format!(", run {run}"));
    let title = format!("Orbits at {}{run}", pair.name);
    Some(Figure {
        id: identifier(&title),
        drawing: orbit(&[], &chosen).into(),
        caption: "Each panel has its own scale.".into(),
        title,
    })
}

fn centreline_of(pair: &Pair, extracted: &[ExtractedFile]) -> Option<Figure> {
    let first = readings(extracted).next()?;
    let run = |of: &ExtractedFile| {
        let place = |r: &Reading| pair.moved_um(first, r, &of.probes).map(|[x, y]| (x, y));
        let places: Vec<_> = of.readings.iter().filter_map(place).collect();
        let [from, to] = [of.readings.first()?, of.readings.last()?].map(|r| rpm(r.speed_rpm));
        let named = of.run.as_ref().map_or(String::new(), |run| format!("{run}: "));
        (!places.is_empty()).then(|| (format!("{named}{from} to {to}"), places))
    };
    let runs: Vec<_> = extracted.iter().filter_map(run).collect();
    let title = format!("Centreline at {}", pair.name);
    (!runs.is_empty()).then(|| Figure {
        id: identifier(&title),
        drawing: centreline(&runs).into(),
        caption: "Positive as the vibration of each probe is.".into(),
        title,
    })
}

fn speed(extracted: &[ExtractedFile]) -> Figure {
    let points = readings(extracted).filter_map(|r| Some((SECONDS_A_DAY * r.time_d?, r.speed_rpm)));
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
        drawing: trend(&over_time).into(),
    }
}

/// Amplitude and phase lag of a probe over speed.
pub fn of_probe(extracted: &[ExtractedFile], probe: usize) -> Figure {
    let point = |r: &Reading| Some((r.speed_rpm, r.probes[probe]?));
    let points: Vec<_> = readings(extracted).filter_map(point).collect();
    let curve = |of: &ExtractedFile| {
        let mut points: Vec<_> = of.readings.iter().filter_map(point).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        Some(Curve { label: of.run.clone()?, points })
    };
    let runs: Vec<Curve> = extracted.iter().filter_map(curve).collect();
    let Probe { name, channel, .. } = &extracted[0].probes[probe];
    let title = format!("Probe {name}");
    Figure {
        id: identifier(&title),
        caption: format!(
            "Channel {channel}: amplitude, and phase lag behind the keyphasor's mark, over speed."
        ),
        drawing: bode(&points, &runs).into(),
        title,
    }
}
