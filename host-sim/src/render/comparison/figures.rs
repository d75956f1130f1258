//! The figures of a comparison, run by run.

use nalgebra::Complex;
use rotor_edge_desktop::compare::{Comparison, ProbePair, probe_pairs};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;

use super::ComparedModel;
use crate::render::bode::{bode, peak_to_peak_um};
use crate::render::chart::Chart;
use crate::render::curve::Curve;
use crate::render::document::{Figure, Section};
use crate::render::orbit::{OrbitPanel, following};
use crate::render::polar::polar;
use crate::render::residual_map::{ResidualMap, residual_map};
use crate::render::trend::{Trend, trend};
use crate::scale::rpm;

/// A run whose speeds differ by less than this, relative to the fastest, is a record at one speed.
const ONE_SPEED: f64 = 0.1;
/// Columns of a heat map; more readings than this are gathered.
const MOST_COLUMNS: usize = 60;
/// Orbits of one bearing beside the one that follows a pointer.
const ORBITS_BESIDE: usize = 3;

/// Readings of one run, by ascending speed, or by time at one speed.
pub struct ReadingRun {
    name: Option<String>,
    rows: Vec<usize>,
    over: Over,
}

/// What the readings of a run differ in.
#[derive(Clone, Copy, PartialEq)]
enum Over {
    Speed,
    Time,
}

impl ReadingRun {
    /// All runs in the order of the measurement.
    pub fn of(readings: &[Reading]) -> Vec<Self> {
        let mut runs: Vec<Self> = Vec::new();
        for (row, reading) in readings.iter().enumerate() {
            match runs.iter_mut().find(|r| r.name == reading.run) {
                Some(run) => run.rows.push(row),
                None => runs.push(Self { name: reading.run.clone(), rows: vec![row], over: Over::Time }),
            }
        }
        for run in &mut runs {
            let speeds = || run.rows.iter().map(|row| readings[*row].speed_rpm);
            let (slowest, fastest) = (speeds().fold(f64::INFINITY, f64::min), speeds().fold(0.0, f64::max));
            if slowest < (1.0 - ONE_SPEED) * fastest {
                run.over = Over::Speed;
                run.rows.sort_by(|a, b| readings[*a].speed_rpm.total_cmp(&readings[*b].speed_rpm));
            }
        }
        runs
    }

    /// Rows of its readings, in its order.
    pub fn rows(&self) -> &[usize] {
        &self.rows
    }

    /// "Bode" or "Bode, run day 126".
    fn named(&self, what: &str) -> String {
        self.name.as_ref().map_or_else(|| what.to_string(), |run| format!("{what}, run {run}"))
    }

    /// A figure of this run, which points at the same reading as the others of it.
    pub fn figure(&self, kind: &str, place: &str, caption: String, chart: Chart) -> Figure {
        let group = Some(self.name.clone().unwrap_or_default());
        Figure::new(self.named(&format!("{kind} {place}")), caption, Chart { group, ..chart })
    }

    /// Where a reading lies along the run: speed in rpm, or days.
    pub fn place(&self, readings: &[Reading], row: usize) -> f64 {
        match self.over {
            Over::Speed => readings[row].speed_rpm,
            Over::Time => readings[row].time_d.unwrap_or(row as f64),
        }
    }

    /// Name and unit of that.
    pub fn along(&self, readings: &[Reading]) -> String {
        let dated = self.rows.iter().all(|row| readings[*row].time_d.is_some());
        match self.over {
            Over::Speed => "speed, rpm",
            Over::Time if dated => "time, days",
            Over::Time => "reading",
        }
        .into()
    }

    /// Bode, polar and orbits over speed; amplitudes over time where there is one speed.
    pub fn sections(&self, rotor: &Rotor, readings: &[Reading], models: &[ComparedModel]) -> Vec<Section> {
        let section = |what: &str, text: &str, figures: Vec<Figure>| Section {
            heading: self.named(what),
            paragraphs: vec![text.into()],
            tables: vec![],
            figures,
        };
        let probes = 0..rotor.probe.len();
        let mut sections = Vec::new();
        if self.over == Over::Time {
            let figures = probes.map(|i| self.trend(rotor, readings, models, i)).collect();
            let text = "All readings are at one speed. Look for the day on which model and measurement part.";
            sections.push(section("Amplitude over time", text, figures));
        } else {
            let figures = probes.clone().map(|i| self.bode(rotor, readings, models, i)).collect();
            let text = "Circles are measured, lines are the model. Look for the speeds where they part: at a \
                        resonance, at the top of the range, or everywhere.";
            sections.push(section("Bode", text, figures));
            let figures = probes.map(|i| self.polar(rotor, readings, models, i)).collect();
            let text = "The keyphasor mark is at 0°, the shaft turns counter-clockwise and the lag grows \
                        clockwise. A loop is a resonance; a constant shift of all circles is runout or bow.";
            sections.push(section("Polar", text, figures));
        }
        let orbits: Vec<Figure> =
            probe_pairs(rotor).iter().filter_map(|pair| self.orbits(rotor, readings, models, pair)).collect();
        if !orbits.is_empty() {
            let text = "The path of the shaft's centre, seen along the shaft with x to the right and y up; the \
                        shaft turns counter-clockwise. Dots: where the keyphasor fires. Arrows: direction of \
                        precession.";
            sections.push(section("Orbits", text, orbits));
        }
        sections
    }

    fn measured(&self, readings: &[Reading], probe: usize) -> Vec<(f64, Complex<f64>)> {
        let point = |row: &usize| Some((self.place(readings, *row), readings[*row].probes[probe]?));
        self.rows.iter().filter_map(point).collect()
    }

    fn curves(&self, readings: &[Reading], models: &[ComparedModel], probe: usize) -> Vec<Curve> {
        let points = |m: &ComparedModel| {
            let point = |row: &usize| (self.place(readings, *row), m.prediction.predicted_m[*row][probe]);
            self.rows.iter().map(point).collect()
        };
        models.iter().map(|m| Curve { label: m.prediction.label.clone(), points: points(m) }).collect()
    }

    fn bode(&self, rotor: &Rotor, readings: &[Reading], models: &[ComparedModel], probe: usize) -> Figure {
        let caption =
            "Amplitude above; phase lag below, later further down. A resonance is a peak with a lag \
                       that grows by about 180°."
                .into();
        self.figure(
            "Bode",
            &rotor.probe[probe].name,
            caption,
            bode(&self.measured(readings, probe), &self.curves(readings, models, probe)),
        )
    }

    fn polar(&self, rotor: &Rotor, readings: &[Reading], models: &[ComparedModel], probe: usize) -> Figure {
        let caption =
            "Phasor over speed, µm pk-pk against phase lag; the rotation is counter-clockwise.".into();
        self.figure(
            "Polar",
            &rotor.probe[probe].name,
            caption,
            polar(&self.measured(readings, probe), &self.curves(readings, models, probe)),
        )
    }

    fn trend(&self, rotor: &Rotor, readings: &[Reading], models: &[ComparedModel], probe: usize) -> Figure {
        let amplitude = |points: Vec<(f64, Complex<f64>)>| {
            points.into_iter().map(|(at, y)| (at, peak_to_peak_um(y))).collect::<Vec<_>>()
        };
        let drawn = Trend {
            along: self.along(readings),
            quantity: "µm pk-pk".into(),
            measured: Some(("measured".into(), amplitude(self.measured(readings, probe)))),
            curves: self
                .curves(readings, models, probe)
                .into_iter()
                .map(|c| (c.label, amplitude(c.points)))
                .collect(),
            ..Trend::default()
        };
        let caption = "Amplitude of the 1x vibration.".into();
        self.figure("Amplitude", &rotor.probe[probe].name, caption, trend(&drawn))
    }

    fn orbits(
        &self,
        rotor: &Rotor,
        readings: &[Reading],
        models: &[ComparedModel],
        pair: &ProbePair,
    ) -> Option<Figure> {
        let comparison = &models.first()?.comparison;
        let panel = |row: &usize| {
            let [a, b] = pair.probes;
            let read = [readings[*row].probes[a]?, readings[*row].probes[b]?];
            let modelled =
                |m: &ComparedModel| pair.xy([a, b].map(|probe| m.prediction.predicted_m[*row][probe]));
            Some(OrbitPanel {
                speed_rpm: readings[*row].speed_rpm,
                measured_m: pair.xy(read),
                models_m: models.iter().map(modelled).collect(),
            })
        };
        let all: Vec<(f64, OrbitPanel)> =
            self.rows.iter().filter_map(|row| Some((self.place(readings, *row), panel(row)?))).collect();
        let worst = self.worst(comparison, pair, &self.whole(readings, pair))?;
        let beside = self.telling(readings, pair, worst);
        let panels: Vec<OrbitPanel> = std::iter::once(&worst).chain(&beside).filter_map(panel).collect();
        let labels: Vec<&str> = models.iter().map(|m| m.prediction.label.as_str()).collect();
        let caption = format!(
            "Each panel has its own scale. The first follows a pointer in the run's other figures; it begins at {}, where the \
             model is furthest off.",
            rpm(readings[worst].speed_rpm)
        );
        let place = format!("at bearing {}", rotor.bearing[pair.bearing].name);
        Some(self.figure("Orbits", &place, caption, following(&labels, &panels, &all)))
    }

    /// Of these rows, the one furthest from the model.
    fn worst(&self, comparison: &Comparison, pair: &ProbePair, rows: &[usize]) -> Option<usize> {
        rows.iter()
            .copied()
            .max_by(|a, b| misfit(comparison, pair, *a).total_cmp(&misfit(comparison, pair, *b)))
    }

    /// Rows with readings of both probes.
    fn whole(&self, readings: &[Reading], pair: &ProbePair) -> Vec<usize> {
        let is_whole = |row: &usize| pair.probes.iter().all(|p| readings[*row].probes[*p].is_some());
        self.rows.iter().copied().filter(is_whole).collect()
    }

    /// Rows worth an orbit beside the worst, in the order of the run: the largest, the last, the middle.
    fn telling(&self, readings: &[Reading], pair: &ProbePair, worst: usize) -> Vec<usize> {
        let whole = self.whole(readings, pair);
        let size = |row: usize| -> f64 {
            pair.probes.iter().filter_map(|p| readings[row].probes[*p]).map(|y| y.norm_sqr()).sum()
        };
        let largest = whole.iter().copied().max_by(|a, b| size(*a).total_cmp(&size(*b)));
        let evenly = [0.5, 0.75, 0.25].map(|share| whole.get((share * whole.len() as f64) as usize).copied());
        let mut chosen: Vec<usize> = Vec::new();
        for row in [largest, whole.last().copied()].into_iter().chain(evenly).flatten() {
            if chosen.len() < ORBITS_BESIDE && row != worst && !chosen.contains(&row) {
                chosen.push(row);
            }
        }
        whole.into_iter().filter(|row| chosen.contains(row)).collect()
    }

    /// Residual of all probes along the run, `of` one model.
    pub fn residual_map(
        &self,
        of: &str,
        rotor: &Rotor,
        readings: &[Reading],
        comparison: &Comparison,
    ) -> Figure {
        let columns: Vec<&[usize]> = self.rows.chunks(self.rows.len().div_ceil(MOST_COLUMNS)).collect();
        let middle = |rows: &&[usize]| {
            rows.iter().map(|row| self.place(readings, *row)).sum::<f64>() / rows.len() as f64
        };
        let sigmas = |probe: usize| {
            let cell = |rows: &&[usize]| {
                let errors = rows.iter().filter_map(|row| comparison.standardised[*row][probe]);
                let (sum, count) = errors.fold((0.0, 0), |(s, n), e| (s + 0.5 * e.norm_sqr(), n + 1));
                (count > 0).then(|| (sum / f64::from(count)).sqrt())
            };
            columns.iter().map(cell).collect()
        };
        let map = ResidualMap {
            along: self.along(readings),
            columns: columns.iter().map(middle).collect(),
            probes: rotor.probe.iter().map(|p| p.name.clone()).collect(),
            sigmas: (0..rotor.probe.len()).map(sigmas).collect(),
        };
        let caption =
            "Each cell: model less measurement in standard deviations σ of the noise, root mean square \
                       of both components. One dark row is a probe or what is beside it; dark columns are a \
                       resonance."
                .into();
        self.figure("Residual", &format!("map{of}"), caption, residual_map(&map))
    }
}

/// How far one reading of a bearing is from the model, squared standard deviations.
fn misfit(comparison: &Comparison, pair: &ProbePair, row: usize) -> f64 {
    pair.probes.iter().filter_map(|p| comparison.standardised[row][*p]).map(|e| e.norm_sqr()).sum()
}
