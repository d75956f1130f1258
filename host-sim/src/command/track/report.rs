//! What `track --report` says: the papers' figures for the user's record.

use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::track::{Interval, ReadingEstimate, Track};
use rotor_edge_desktop::unbalance::{G_MM, g_mm_deg, static_and_dynamic};

use super::super::dates::Dates;
use super::output::{undiagnosed, when};
use super::sampling;
use crate::answers::names::coefficient_names;
use crate::answers::track::{CaseAnswer, EventAnswer, ReidentifiedAnswer, TrackAnswer};
use crate::render::trend::{Trend, trend};
use crate::render::{Figure, PageTable, Section, identifier};
use crate::scale::three_digits;

type Points = Vec<(f64, f64)>;

pub fn sections(
    rotor: &Rotor,
    record: &[Reading],
    track: &Track,
    answer: &TrackAnswer,
    dates: Dates,
) -> Vec<Section> {
    let mut sections = vec![residuals(answer, track, dates), features(rotor, record, track, dates)];
    sections.extend([unbalance(rotor, track, dates), parameters(rotor, track, dates)]);
    if let (Some(answer), Some(sampling)) = (&answer.sampling, &track.sampling) {
        sections.push(sampling::section(rotor, answer, sampling));
    }
    sections
}

fn over_time(estimates: &[ReadingEstimate], value: impl Fn(&ReadingEstimate) -> f64) -> Points {
    estimates.iter().map(|e| (e.time_d, value(e))).collect()
}

/// A figure over time with the record's flags and re-identifications.
fn figure(track: &Track, dates: Dates, title: &str, quantity: &str, caption: &str, parts: Trend) -> Figure {
    let elsewhere = track.joint.iter().flat_map(|joint| &joint.events).filter(|e| e.scope.elsewhere);
    let elsewhere = elsewhere.map(|e| (e.time_d, "no bearing explains".to_string()));
    let events = track.reidentified.iter().map(|r| (r.since_d, "new bearings".to_string())).chain(elsewhere);
    let drawn = Trend {
        along: dates.axis(),
        quantity: quantity.into(),
        events: events.collect(),
        flags: track.flags.iter().map(|f| f.time_d).collect(),
        ..parts
    };
    Figure {
        id: identifier(title),
        title: title.into(),
        caption: caption.into(),
        drawing: trend(&drawn).into(),
    }
}

fn residuals(answer: &TrackAnswer, track: &Track, dates: Dates) -> Section {
    let name = answer.method;
    let mut curves = vec![(name.to_string(), over_time(&track.estimates, |e| e.residual.e_um))];
    if name != "fixed" {
        curves.push(("bearings constant".into(), over_time(&track.fixed, |e| e.residual.e_um)));
    }
    let sums = vec![("feature sum".into(), over_time(&track.estimates, |e| e.residual.f_um))];
    let ratio = vec![(name.to_string(), over_time(&track.estimates, |e| 100.0 * e.residual.ratio()))];
    let percent = |r: Option<f64>| r.map_or("–".to_string(), |r| format!("{:.2} %", 100.0 * r));
    let mut paragraphs = vec![format!(
        "Method {name}: the mean residual is smaller than with constant bearings by {} over the record, and by {} from \
         the event on.",
        percent(answer.reduction_against_fixed.whole),
        percent(answer.reduction_against_fixed.after_event)
    )];
    paragraphs.extend(answer.remarks.iter().cloned().chain(undiagnosed(answer, dates)));
    let found = answer.joint.as_ref().filter(|joint| !joint.events.is_empty());
    let found = found.map(|joint| events(&joint.events, dates));
    let cases = answer.reidentified.iter().filter(|r| !r.cases.is_empty()).map(|r| cases(r, dates));
    Section {
        heading: "Does the model fit?".into(),
        paragraphs,
        tables: found.into_iter().chain(cases).collect(),
        figures: vec![
            figure(
                track,
                dates,
                "Residual",
                "residual, µm",
                "A step up that stays is an event; marks below are flags.",
                Trend { curves, ..Trend::default() },
            ),
            figure(
                track,
                dates,
                "Feature sum",
                "feature sum, µm",
                "How much the machine moves.",
                Trend { curves: sums, ..Trend::default() },
            ),
            figure(
                track,
                dates,
                "Residual over feature sum",
                "residual / feature sum, %",
                "Above a third the model is wrong, whatever it was before.",
                Trend { curves: ratio, ..Trend::default() },
            ),
        ],
    }
}

/// What happened, and how sure that is.
fn events(events: &[EventAnswer], dates: Dates) -> PageTable {
    let row = |e: &EventAnswer| vec![when(e, dates), e.changed.clone(), format!("{:.0}", e.log_evidence)];
    PageTable {
        caption: "Events: first day of the new state, and the logarithm of how much more probable the record is with it"
            .into(),
        columns: ["when", "what changed", "log evidence"].map(String::from).to_vec(),
        rows: events.iter().map(row).collect(),
    }
}

/// The four cases of a re-identification.
fn cases(r: &ReidentifiedAnswer, dates: Dates) -> PageTable {
    let row = |c: &CaseAnswer| {
        let taken = if c.case == r.case { "taken" } else { "" };
        let numbers =
            [format!("{:.3}", c.residual_um), c.unknowns.to_string(), format!("{:.1}", c.criterion)];
        let name = [format!("case {}", c.case)];
        name.into_iter().chain(numbers).chain([taken.to_string()]).collect()
    };
    PageTable {
        caption: format!("Re-identification on {}: the four cases", dates.day(r.time_d)),
        columns: ["case", "residual, µm", "unknowns", "criterion", ""].map(String::from).to_vec(),
        rows: r.cases.iter().map(row).collect(),
    }
}

/// Calculated against measured features, the two probes of each bearing.
fn features(rotor: &Rotor, record: &[Reading], track: &Track, dates: Dates) -> Section {
    let mut figures = Vec::new();
    for (p, probe) in rotor.probe.iter().enumerate() {
        for (part, sign) in [("cos", false), ("sin", true)] {
            let take = |y: &nalgebra::Complex<f64>| if sign { -y.im * 1e6 } else { y.re * 1e6 };
            let measured: Points = track
                .estimates
                .iter()
                .filter_map(|e| Some((e.time_d, take(record[e.row].probes[p].as_ref()?))))
                .collect();
            let calculated = over_time(&track.estimates, |e| take(&e.calculated_m[p]));
            figures.push(figure(
                track,
                dates,
                &format!("{} {part}", probe.name),
                "feature, µm",
                &format!("Bearing {}: calculated against measured.", probe.bearing),
                Trend {
                    measured: Some(("measured".into(), measured)),
                    curves: vec![("calculated".into(), calculated)],
                    ..Trend::default()
                },
            ));
        }
    }
    Section { heading: "Calculated and measured features".into(), figures, ..Section::default() }
}

/// A curve in its interval, where there is one.
fn with_ends(
    track: &Track,
    name: &str,
    value: impl Fn(&ReadingEstimate) -> f64,
    ends: impl Fn(&ReadingEstimate) -> Option<Interval>,
) -> Trend {
    let curves = vec![(name.to_string(), over_time(&track.estimates, value))];
    let of = |e: &ReadingEstimate| ends(e).map(|ends| [e.time_d, ends.low, ends.high]);
    let band: Vec<_> = track.estimates.iter().filter_map(of).collect();
    Trend { curves, band: (!band.is_empty()).then(|| ("95 % interval".into(), band)), ..Trend::default() }
}

fn scaled(interval: Interval, factor: f64) -> Interval {
    Interval { low: interval.low * factor, high: interval.high * factor }
}

/// U and α of each plane, static and dynamic.
fn unbalance(rotor: &Rotor, track: &Track, dates: Dates) -> Section {
    let mut figures = Vec::new();
    for (j, plane) in rotor.plane.iter().enumerate() {
        let size = with_ends(
            track,
            "U",
            |e| g_mm_deg(e.unbalance_kg_m[j])[0],
            |e| Some(scaled(e.spread.as_ref()?.magnitude_kg_m[j], G_MM)),
        );
        let angle = with_ends(
            track,
            "α",
            |e| g_mm_deg(e.unbalance_kg_m[j])[1],
            |e| Some(scaled(e.spread.as_ref()?.angle_rad[j], 180.0 / std::f64::consts::PI)),
        );
        let caption = "Band: 95 % interval, where the method states one.";
        figures.push(figure(
            track,
            dates,
            &format!("Unbalance of plane {}", plane.name),
            "U, g·mm",
            caption,
            size,
        ));
        figures.push(figure(
            track,
            dates,
            &format!("Angle of plane {}", plane.name),
            "α, degrees",
            caption,
            angle,
        ));
    }
    for (k, kind) in ["static", "dynamic"].iter().enumerate() {
        for (part, what, quantity) in [(0, "Size", "unbalance, g·mm"), (1, "Angle", "angle, degrees")] {
            let split =
                |e: &ReadingEstimate| static_and_dynamic(&rotor.plane_positions_m(), &e.unbalance_kg_m);
            let value = |e: &ReadingEstimate| g_mm_deg(split(e)[k])[part];
            let curves = vec![(kind.to_string(), over_time(&track.estimates, value))];
            figures.push(figure(
                track,
                dates,
                &format!("{what} of the {kind} unbalance"),
                quantity,
                "Static: sum of the planes. Dynamic: half the difference of the first and the last, at the first.",
                Trend { curves, ..Trend::default() },
            ));
        }
    }
    Section { heading: "Unbalance".into(), figures, ..Section::default() }
}

/// Bearing coefficients over time, and what the data say of them.
fn parameters(rotor: &Rotor, track: &Track, dates: Dates) -> Section {
    let names = coefficient_names(rotor);
    let figures = names.iter().enumerate().map(|(i, name)| {
        let (unit, factor) = if i < names.len() / 2 { ("MN/m", 1e-6) } else { ("kN·s/m", 1e-3) };
        let ends = |e: &ReadingEstimate| {
            let log = e.spread.as_ref()?.logs[i];
            Some(Interval { low: log.low.exp() * factor, high: log.high.exp() * factor })
        };
        let trend = with_ends(track, name, |e| e.logs[i].exp() * factor, ends);
        let title = format!("Coefficient {}", name.replace('_', " "));
        figure(
            track,
            dates,
            &title,
            &format!("{name}, {unit}"),
            "Band: 95 % interval, where the method states one.",
            trend,
        )
    });
    let row = |(since, all): &(f64, Vec<rotor_edge_desktop::track::ConstantPart>)| {
        let one = |(name, c): (&String, &rotor_edge_desktop::track::ConstantPart)| {
            let origin = if c.from_data { "the data" } else { "its prior: the data do not tell" };
            let numbers = [format!("{since:.0}"), format!("{:.3e}", c.log.exp()), three_digits(100.0 * c.sd)];
            [name.clone()].into_iter().chain(numbers).chain([origin.to_string()]).collect::<Vec<_>>()
        };
        names.iter().zip(all).map(one).collect::<Vec<_>>()
    };
    let table = track.joint.as_ref().map(|joint| PageTable {
        caption: "Constant part of the bearings, and whether one speed could tell it".into(),
        columns: ["coefficient", "from day", "value", "± %", "from"].map(String::from).to_vec(),
        rows: joint.constants.iter().flat_map(row).collect(),
    });
    Section {
        heading: "Bearings".into(),
        tables: table.into_iter().collect(),
        figures: figures.collect(),
        ..Section::default()
    }
}
