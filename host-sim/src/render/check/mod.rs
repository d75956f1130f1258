//! Text and sections of an answer of `check`. Tables and sentences come from the answer; figures also draw the curves that the
//! JSON leaves out.

mod sentences;
mod story;
mod tables;
mod text;

use nalgebra::Complex;
use rotor_edge_desktop::check::Check;
use rotor_edge_desktop::check::modes::Mode;
use rotor_edge_desktop::check::unbalance::ProbeResponse;
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::units::rpm;

use crate::answers::check::{CheckAnswer, TrialResponse};
use crate::render::bode::bode_of;
use crate::render::sketch::sketch;
use crate::render::text::capital;
use crate::render::trend::{Trend, trend};
use crate::render::{Curve, Figure, PageTable, Section};
use crate::scale::{number, three_digits};

pub use story::story;
pub use text::text;

/// Speed in rpm and phasor in m.
type Point = (f64, Complex<f64>);

/// Mode shapes that are drawn.
const SHAPES: usize = 6;

/// The page of an answer; `found` is the check that it is made from.
pub fn sections(answer: &CheckAnswer, found: &Check) -> Vec<Section> {
    let mut all = vec![machine(answer, found)];
    if !answer.warnings.is_empty() {
        all.push(Section {
            heading: "Numbers to look at again".into(),
            paragraphs: answer.warnings.clone(),
            ..Section::default()
        });
    }
    all.extend([critical(answer), modes(answer, found), shapes(found)]);
    let responses = answer.unbalance.iter().zip(&found.responses);
    all.extend(responses.map(|(response, (_, curves))| unbalance(answer, response, curves, &found.rotor)));
    all
}

fn table(caption: &str, columns: &[&str], rows: Vec<Vec<String>>) -> PageTable {
    let columns = columns.iter().map(|c| c.to_string()).collect();
    PageTable { caption: caption.into(), columns, rows }
}

/// The machine to scale, its static line and its bearings at the fastest speed.
pub fn machine(answer: &CheckAnswer, found: &Check) -> Section {
    let to = number(answer.range_rpm[1], 0);
    let mut paragraphs = vec![format!(
        "{} kg, centre of gravity at {:.4} m from the left end; looked at from {} to {to} rpm.",
        three_digits(answer.mass_kg),
        answer.centre_of_gravity_m,
        number(answer.range_rpm[0], 0),
    )];
    let mut figures = vec![Figure::new(
        "Machine",
        "To scale. Disks have the radius and width of a uniform disk of their mass and inertias; triangles are bearings, \
         arrows probes, dashed lines planes.",
        sketch("Machine", &found.rotor, &[]),
    )];
    match &found.statics {
        Ok(s) => {
            let sag = s.position_m.iter().zip(&s.sag_m).map(|(z, sag)| (*z, -sag * 1e6)).collect();
            figures.push(Figure::new(
                "Static line",
                "The shaft at rest under its own weight on rigid bearings in one line.",
                trend(&Trend {
                    along: "along the shaft, m".into(),
                    quantity: "height, µm".into(),
                    curves: vec![("shaft".into(), sag)],
                    is_curved: true,
                    ..Trend::default()
                }),
            ));
        }
        Err(why) => paragraphs.push(format!("Static loads are not known: {why}.")),
    }
    // eight coefficients do not fit a telephone beside each other
    let rows = tables::bearing_rows(answer);
    let part = |caption: String, range: std::ops::Range<usize>| {
        let (names, cells) = tables::part(&tables::BEARING_COLUMNS, &rows, range);
        table(&caption, &names, cells)
    };
    let tables = vec![
        part(format!("Static load, and place in the film at {to} rpm"), 1..4),
        part(format!("Stiffness at {to} rpm, N/m"), 4..8),
        part(format!("Damping at {to} rpm, N·s/m"), 8..12),
    ];
    Section { heading: "Machine".into(), paragraphs, tables, figures }
}

/// Undamped critical speeds, and their map over the bearings' stiffness.
pub fn critical(answer: &CheckAnswer) -> Section {
    let map = &answer.critical_speed_map;
    let most = map.speeds_rpm.iter().map(Vec::len).max().unwrap_or(0);
    let curve = |i: usize| {
        let at = |(k, all): (&f64, &Vec<f64>)| all.get(i).map(|rpm| (*k, *rpm));
        (format!("{}.", i + 1), map.stiffness_n_m.iter().zip(&map.speeds_rpm).filter_map(at).collect())
    };
    let drawn = Trend {
        along: "stiffness of every bearing, N/m".into(),
        quantity: "critical speed, rpm".into(),
        curves: (0..most).map(curve).collect(),
        events: vec![(map.own_n_m, "as drawn".into())],
        is_log: true,
        ..Trend::default()
    };
    let meant = "Without dampers and with the symmetric part of the bearings' stiffness. Unbalance excites a critical speed by \
                 the share of its motion that turns forward.";
    let mut paragraphs = vec![meant.to_string()];
    let mut listed = Vec::new();
    match sentences::no_critical_speed(answer) {
        Some(why) => paragraphs.push(why.into()),
        None => listed.push(table(
            "On the bearings as they are",
            &tables::CRITICAL_COLUMNS,
            tables::critical_rows(answer),
        )),
    }
    Section {
        heading: "Undamped critical speeds".into(),
        paragraphs,
        tables: listed,
        figures: vec![Figure::new(
            "Critical speed map",
            "Forward critical speeds if every bearing had this stiffness in all directions; where a curve is flat, the \
             bearings are stiffer than the shaft and their damping does little.",
            trend(&drawn),
        )],
    }
}

/// Damped modes over speed: log decrements and damped critical speeds.
pub fn modes(answer: &CheckAnswer, found: &Check) -> Section {
    let decrement = |branch: &(usize, Vec<usize>)| {
        let points: Vec<_> =
            found.campbell.along(branch).map(|m| (rpm(m.speed_rad_s), m.log_decrement())).collect();
        points
    };
    // the least damped say where the machine is in danger
    let mut least: Vec<_> = found.campbell.branches.iter().filter(|b| b.1.len() > 1).map(decrement).collect();
    let lowest = |points: &[(f64, f64)]| points.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
    least.sort_by(|a, b| lowest(a).total_cmp(&lowest(b)));
    least.truncate(4);
    let curves = least.into_iter().enumerate().map(|(i, points)| (format!("{}.", i + 1), points)).collect();
    let drawn = Trend {
        along: "speed, rpm".into(),
        quantity: "log decrement".into(),
        curves,
        events: (answer.stability_threshold.iter())
            .filter(|t| !t.from_the_first)
            .map(|t| (t.speed_rpm, "unstable".into()))
            .collect(),
        ..Trend::default()
    };
    let caption = format!("At {} rpm", number(answer.range_rpm[1], 0));
    let mut paragraphs = Vec::new();
    let mut listed = Vec::new();
    match sentences::no_damped_critical_speed(answer) {
        Some(why) => paragraphs.push(format!("Damped critical speeds: {why}")),
        None => {
            listed.push(table("Damped critical speeds", &tables::DAMPED_COLUMNS, tables::damped_rows(answer)))
        }
    }
    paragraphs.extend(sentences::strongly_damped_critical(answer));
    paragraphs.extend(sentences::failing_margins(answer));
    let without = tables::without_amplitude_rows(answer);
    if !without.is_empty() {
        paragraphs.push("A critical speed of a mode without damping has no amplitude.".into());
        listed.push(table("Without amplitude", &tables::WITHOUT_COLUMNS, without));
    }
    listed.push(table(&caption, &tables::MODE_COLUMNS, tables::mode_rows(answer, true)));
    let strong = tables::mode_rows(answer, false);
    if !strong.is_empty() {
        let caption = format!("{caption}, {}", sentences::strongly_damped_caption());
        listed.push(table(&caption, &tables::MODE_COLUMNS, strong));
    }
    let real = tables::real_rows(answer);
    if !real.is_empty() {
        listed.push(table(&format!("{caption}, without oscillation"), &tables::REAL_COLUMNS, real));
    }
    Section {
        heading: "Damped modes".into(),
        paragraphs,
        tables: listed,
        figures: vec![Figure::new(
            "Log decrement",
            "Of the least damped modes; below zero the machine is unstable.",
            trend(&drawn),
        )],
    }
}

/// Mode shapes at the fastest speed.
pub fn shapes(found: &Check) -> Section {
    let last = found.fastest_modes();
    let one = |m: &Mode| {
        let title = format!("Shape at {} rpm", number(rpm(m.frequency_rad_s()), 0));
        let curve = |name: &str, along: &[Complex<f64>]| {
            let largest = along
                .iter()
                .copied()
                .fold(Complex::from(0.0), |a, b| if b.norm() > a.norm() { b } else { a });
            let turn =
                if largest.norm() > 0.0 { largest.conj() / largest.norm() } else { Complex::from(1.0) };
            let points = found.stations_m.iter().zip(along).map(|(z, v)| (*z, (v * turn).re)).collect();
            (name.to_string(), points)
        };
        let bearings = found.rotor.bearing.iter().map(|b| (b.position_m, b.name.clone())).collect();
        let drawn = Trend {
            along: "along the shaft, m".into(),
            quantity: "of the largest".into(),
            curves: vec![curve("x", &m.x), curve("y", &m.y)],
            events: bearings,
            is_curved: true,
            ..Trend::default()
        };
        let caption = format!(
            "{} whirl, {}; each direction at the instant of its own largest motion.",
            capital(m.whirl.name()),
            match m.is_undamped() {
                true => "undamped".to_string(),
                false => format!("log decrement {}", three_digits(m.log_decrement())),
            }
        );
        Figure::new(title, caption, trend(&drawn))
    };
    Section {
        heading: "Mode shapes".into(),
        paragraphs: vec![format!("At {} rpm, the lowest first.", number(found.range_rpm[1], 0))],
        figures: unique(last.iter().take(SHAPES).map(one).collect()),
        ..Section::default()
    }
}

/// Two modes of one frequency to the last rpm would have one name.
fn unique(mut figures: Vec<Figure>) -> Vec<Figure> {
    for i in 1..figures.len() {
        let same = figures[..i].iter().filter(|f| f.title == figures[i].title).count();
        if same > 0 {
            figures[i].id = format!("{}-{}", figures[i].id, same + 1);
        }
    }
    figures
}

/// Maxima, and their margins where the running range was stated: beside each other they do not fit a telephone.
fn peaks(response: &TrialResponse) -> Vec<PageTable> {
    let rows = tables::peak_rows(response);
    if rows.is_empty() {
        return Vec::new();
    }
    let part = |columns: &[usize]| -> (Vec<&str>, Vec<Vec<String>>) {
        let names = columns.iter().map(|c| tables::PEAK_COLUMNS[*c]).collect();
        (names, rows.iter().map(|r| columns.iter().map(|c| r[*c].clone()).collect()).collect())
    };
    let (names, cells) = part(&[0, 1, 2, 3]);
    let mut all = vec![table("Maxima", &names, cells)];
    if rows.iter().any(|r| r[5] != "–") {
        let (names, cells) = part(&[0, 1, 5, 6, 7]);
        all.push(table("Separation from the running range", &names, cells));
    }
    all
}

/// The response to an unbalance: maxima in tables, the curves of each bearing's probes in figures.
pub fn unbalance(
    answer: &CheckAnswer,
    response: &TrialResponse,
    curves: &[ProbeResponse],
    rotor: &Rotor,
) -> Section {
    let trial = response.trial;
    let mut by_bearing: Vec<(String, Vec<Curve>, Vec<Point>)> = Vec::new();
    for (curve, probe) in curves.iter().zip(&rotor.probe) {
        let peak = |speed_rpm: f64| {
            curve
                .points
                .iter()
                .min_by(|a, b| (a.0 - speed_rpm).abs().total_cmp(&(b.0 - speed_rpm).abs()))
                .copied()
        };
        let peaks = curve.peaks.iter().filter_map(|p| peak(p.speed_rpm));
        let curve = Curve { label: curve.probe.clone(), points: curve.points.clone() };
        match by_bearing.iter_mut().find(|(name, ..)| *name == probe.bearing) {
            Some((_, curves, circles)) => {
                curves.push(curve);
                circles.extend(peaks);
            }
            None => by_bearing.push((probe.bearing.clone(), vec![curve], peaks.collect())),
        }
    }
    let figures = by_bearing
        .iter()
        .map(|(bearing, curves, circles)| {
            let title = format!("Bearing {bearing}, {trial}");
            Figure::new(title, "Amplitude and phase lag over speed.", bode_of("maximum", circles, curves))
        })
        .collect();
    let gap = (!answer.critical_speeds_without_amplitude.is_empty()).then(|| {
        "The curves have a gap of 5 % on either side of each critical speed that has no amplitude."
            .to_string()
    });
    Section {
        heading: format!("Unbalance response, {trial}"),
        paragraphs: std::iter::once(sentences::unbalance(answer, response))
            .chain(sentences::missing_peaks(answer, response))
            .chain(sentences::between_resonances(response))
            .chain(gap)
            .collect(),
        tables: peaks(response),
        figures,
    }
}
