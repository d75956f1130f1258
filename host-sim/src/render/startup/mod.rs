//! Text and sections of an answer of `startup`: the start-ups with their marks, the simple model and where it fails, the
//! models on the way to one that fits. Figures also draw the curves that the JSON leaves out.

mod story;
mod tables;
mod text;

use nalgebra::Complex;
use rotor_edge_desktop::startup::series::{Point, RunUp, series};
use rotor_edge_desktop::unbalance::G_MM;
use rotor_edge_desktop::units::rad_s;
use rotor_edge_desktop::units::rpm as to_rpm;

use crate::answers::startup::{EvaluatedStartup, StartupAnswer};
use crate::render::bode::bode_of;
use crate::render::orbit::{OrbitPanel, orbit};
use crate::render::trend::{Trend, trend};
use crate::render::wave::wave;
use crate::render::{Curve, Figure, PageTable, Section};
use crate::scale::rpm;
use tables::{
    ESTIMATE_COLUMNS, RUN_COLUMNS, estimate_caption, estimate_rows, model_lines, own_lines, pk_pk, run_rows,
    shift_lines, stage_columns, stage_rows,
};

pub use story::story;
pub use text::text;

type C = Complex<f64>;

/// The page of an answer; `evaluated` is the start-up that it is made from.
pub fn sections(answer: &StartupAnswer, evaluated: &EvaluatedStartup) -> Vec<Section> {
    let mut sections = vec![summary(answer, evaluated), bodes(answer, evaluated), errors(evaluated)];
    sections.extend([orbits(evaluated), waves(evaluated)].into_iter().filter(|s| !s.figures.is_empty()));
    sections
}

/// The two-degree model, the models up to one that fits, and the disk's own unbalance.
pub fn summary(answer: &StartupAnswer, evaluated: &EvaluatedStartup) -> Section {
    let mut paragraphs = model_lines(answer);
    paragraphs.extend(own_lines(answer));
    if let Some(improved) = &answer.improved {
        paragraphs.push(improved.summary.clone());
        for effect in &improved.effects {
            paragraphs.push(format!("{}: {}", effect.fitted.label, effect.explanation));
        }
    }
    paragraphs.extend(answer.remarks.iter().cloned());
    let estimates = PageTable {
        caption: estimate_caption(answer),
        columns: ESTIMATE_COLUMNS.map(String::from).to_vec(),
        rows: estimate_rows(answer).into_iter().map(|r| r.to_vec()).collect(),
    };
    let stages = PageTable {
        caption: format!(
            "From the simple model to one that fits: largest error over all runs in percent of the clearance ({:.0} µm)",
            answer.clearance_um
        ),
        columns: stage_columns(evaluated),
        rows: stage_rows(answer, &evaluated.bearings),
    };
    Section { heading: "Summary".into(), paragraphs, tables: vec![estimates, stages], figures: Vec::new() }
}

/// Every run along a direction, with its peak and half-power points.
pub fn bodes(answer: &StartupAnswer, evaluated: &EvaluatedStartup) -> Section {
    let found = &evaluated.found;
    let draw = |d: usize| {
        let direction = &found.directions[d];
        let points = |run: &RunUp| series(&evaluated.readings, &found.noise, run, direction);
        let curve = |run: &RunUp| Curve {
            label: run.label().to_string(),
            points: points(run).iter().map(|p| (to_rpm(p.speed_rad_s), p.motion_m)).collect(),
        };
        let marks: Vec<(f64, C)> = found
            .runs
            .iter()
            .zip(&found.seen)
            .filter_map(|(run, seen)| Some((points(run), seen[d].half_power.as_ref().ok()?)))
            .flat_map(|(points, (marks, _))| {
                let [before, after] = marks.half_power_rad_s;
                [before, marks.peak[0], after]
                    .into_iter()
                    .filter_map(move |w| Some((to_rpm(w), between(&points, w)?)))
            })
            .collect();
        let curves: Vec<Curve> = found.runs.iter().map(curve).collect();
        let caption = "Every run as measured; circles: the peak and both half-power points of each.";
        Figure::new(
            format!("Bode {}", direction.label),
            caption,
            bode_of("identified points", &marks, &curves),
        )
    };
    let mut paragraphs = vec!["Amplitude above, phase lag below, for every added mass.".to_string()];
    paragraphs.extend(shift_lines(answer));
    let mut figures: Vec<Figure> = (0..found.directions.len()).map(draw).collect();
    if let Some(own) = evaluated.own_kg_m() {
        figures.extend((0..found.directions.len()).map(|d| per_unbalance(evaluated, d, own)));
    }
    let tables = vec![PageTable {
        caption: "Peak and half-power points of every run".into(),
        columns: RUN_COLUMNS.map(String::from).to_vec(),
        rows: run_rows(answer).into_iter().map(|r| r.to_vec()).collect(),
    }];
    Section { heading: "Start-ups".into(), paragraphs, tables, figures }
}

/// Every run along a direction per unit of own and added unbalance.
fn per_unbalance(evaluated: &EvaluatedStartup, d: usize, own_kg_m: C) -> Figure {
    let found = &evaluated.found;
    let direction = &found.directions[d];
    let curve = |run: &RunUp| {
        let unbalance_g_mm = (own_kg_m + run.added_kg_m).norm() * G_MM;
        let points = series(&evaluated.readings, &found.noise, run, direction);
        let point = |p: &Point| (to_rpm(p.speed_rad_s), p.motion_m.norm() * 1e6 / unbalance_g_mm);
        (run.label().to_string(), points.iter().map(point).collect())
    };
    let drawn = Trend {
        along: "speed, rpm".into(),
        quantity: "µm 0-pk per g·mm".into(),
        curves: found.runs.iter().filter(|r| evaluated.is_known(r)).map(curve).collect(),
        ..Trend::default()
    };
    let caption = "Amplitude over own and added unbalance together: on a linear machine the curves are one.";
    Figure::new(format!("Per unbalance {}", direction.label), caption, trend(&drawn))
}

/// The motion between two readings.
fn between(points: &[Point], speed_rad_s: f64) -> Option<C> {
    let right = points.partition_point(|p| p.speed_rad_s < speed_rad_s).max(1);
    let (a, b) = (points.get(right - 1)?, points.get(right)?);
    let share = (speed_rad_s - a.speed_rad_s) / (b.speed_rad_s - a.speed_rad_s);
    Some(a.motion_m * (1.0 - share) + b.motion_m * share)
}

/// The simple model and, where there is one, the last.
fn models(evaluated: &EvaluatedStartup) -> Vec<(&'static str, usize)> {
    let last = evaluated.stages.len() - 1;
    let improved = evaluated.chain.is_some().then_some(("improved model", last));
    std::iter::once(("two-degree model", 0)).chain(improved).collect()
}

pub fn errors(evaluated: &EvaluatedStartup) -> Section {
    let found = &evaluated.found;
    let table = |speed: f64| {
        let rows = found.errors_at(&evaluated.readings, &evaluated.stages[0].motion, speed);
        let row = |e: &rotor_edge_desktop::startup::two_degree::ErrorAt| {
            vec![
                format!("{}, {}", found.runs[e.run].label(), evaluated.bearings[e.bearing]),
                pk_pk(&e.measured_m),
                pk_pk(&e.predicted_m),
                format!("{:.1}", e.error_m * 1e6),
                format!("{:.1} %", evaluated.percent(e.error_m)),
            ]
        };
        let columns = [
            "run and bearing",
            "measured, µm pk-pk",
            "predicted, µm pk-pk",
            "distance, µm 0-pk",
            "of the clearance",
        ];
        PageTable {
            caption: format!("Two-degree model at {}", rpm(speed)),
            columns: columns.map(String::from).to_vec(),
            rows: rows.iter().map(row).collect(),
        }
    };
    let by_speed = |stage: usize| {
        evaluated.found.worst_by_speed(
            &evaluated.readings,
            &evaluated.stages[stage].motion,
            evaluated.range_rpm,
        )
    };
    let line = |stage: usize, what: usize| {
        by_speed(stage).iter().map(|w| (to_rpm(rad_s(w[0])), evaluated.percent(w[what]))).collect::<Vec<_>>()
    };
    let mut curves: Vec<(String, Vec<(f64, f64)>)> =
        models(evaluated).into_iter().map(|(label, stage)| (label.to_string(), line(stage, 1))).collect();
    curves.push(("noise at that reading".into(), line(evaluated.stages.len() - 1, 2)));
    let drawn =
        Trend { along: "speed, rpm".into(), quantity: "% of clearance".into(), curves, ..Trend::default() };
    let caption = "The largest error over all runs and bearings at every measured speed.";
    Section {
        heading: "Errors".into(),
        paragraphs: vec![
            "The error is the largest distance between measured and predicted centre of the shaft at the same moment of \
             a turn, so it counts phase as well as amplitude."
                .into(),
        ],
        tables: evaluated.speeds_rpm.iter().map(|s| table(*s)).filter(|t| !t.rows.is_empty()).collect(),
        figures: vec![Figure::new("Error by speed", caption, trend(&drawn))],
    }
}

pub fn orbits(evaluated: &EvaluatedStartup) -> Section {
    let found = &evaluated.found;
    let measured = found.measured(&evaluated.readings);
    let mut figures = Vec::new();
    for run in &found.runs {
        for (b, bearing) in evaluated.bearings.iter().enumerate() {
            let [x, y] = found.directions_of(b)[..] else { continue };
            let labels: Vec<&str> = models(evaluated).into_iter().map(|(label, _)| label).collect();
            let panel = |speed: &f64| {
                let row = run.nearest(&evaluated.readings, *speed)?;
                let of = |m: &[Option<C>]| Some([m[x]?, m[y]?]);
                let stage = |(_, stage): (&str, usize)| of(&evaluated.stages[stage].motion[row]);
                Some(OrbitPanel {
                    speed_rpm: evaluated.readings[row].speed_rpm,
                    measured_m: of(&measured[row])?,
                    models_m: models(evaluated).into_iter().map(stage).collect::<Option<_>>()?,
                })
            };
            let panels: Vec<OrbitPanel> = evaluated.speeds_rpm.iter().filter_map(panel).collect();
            if panels.is_empty() {
                continue;
            }
            let title = format!("Orbits at {bearing}, run {}", run.label());
            figures.push(Figure::new(title, "Each panel has its own scale.", orbit(&labels, &panels)));
        }
    }
    let text = "The path of the shaft's centre, seen along the shaft; dots where the keyphasor fires.";
    Section { heading: "Orbits".into(), paragraphs: vec![text.into()], tables: Vec::new(), figures }
}

/// Time waves of the run with the largest mass.
pub fn waves(evaluated: &EvaluatedStartup) -> Section {
    let found = &evaluated.found;
    let measured = found.measured(&evaluated.readings);
    let Some(run) = found.runs.iter().max_by(|a, b| a.added_kg_m.norm().total_cmp(&b.added_kg_m.norm()))
    else {
        return Section::default();
    };
    let mut figures = Vec::new();
    for speed in &evaluated.speeds_rpm {
        let Some(row) = run.nearest(&evaluated.readings, *speed) else { continue };
        for (d, direction) in found.directions.iter().enumerate() {
            let Some(seen) = measured[row][d] else { continue };
            let says = |(label, stage): (&'static str, usize)| {
                Some((label, evaluated.stages[stage].motion[row][d]?))
            };
            let said: Vec<(&str, C)> = models(evaluated).into_iter().filter_map(says).collect();
            let title = format!("Time wave {}, {}", direction.label, rpm(evaluated.readings[row].speed_rpm));
            figures.push(Figure::new(title, "One turn of the shaft.", wave(seen, &said)));
        }
    }
    let text = format!("Run {}, the one with the largest mass.", run.label());
    Section { heading: "Time waves".into(), paragraphs: vec![text], tables: Vec::new(), figures }
}
