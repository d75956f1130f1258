//! Text and sections of an answer of `track`: the papers' figures for the user's record.

mod conditions;
mod sampling;
mod story;
mod text;

use super::trend::{Trend, trend};
use super::{Figure, PageTable, Section};
use crate::answers::shared::UnbalanceAnswer;
use crate::answers::track::{
    CaseAnswer, ConstantAnswer, EstimateAnswer, EventAnswer, JointAnswer, ReidentifiedAnswer, TrackAnswer,
};
use crate::answers::track_curves::{BandedCurve, CoefficientCurve, FeatureCurve, TrackCurves};
use crate::ingest::dates::Dates;

pub use story::story;
pub use text::text;

/// Residual over feature sum above which no model is right, %.
const RATIO_LIMIT: f64 = 100.0 / 3.0;

type UnbalanceOf = fn(&EstimateAnswer) -> UnbalanceAnswer;
type QuantityOf = fn(UnbalanceAnswer) -> f64;

/// Whether the model fits, features, unbalance, bearings, and samples of methods that sample.
pub fn sections(answer: &TrackAnswer, curves: &TrackCurves, dates: Dates) -> Vec<Section> {
    let page = TrackPage { answer, dates };
    let mut sections = vec![page.residuals(curves), page.features(&curves.features), page.unbalance(curves)];
    sections.push(page.bearings(&curves.coefficients));
    sections.extend(answer.sampling.as_ref().map(|of| sampling::section(of, &curves.posterior)));
    sections
}

/// When an event took place, and how sure that is.
fn when(event: &EventAnswer, dates: Dates) -> String {
    let [low, high] = event.interval_95_d;
    if low == high {
        dates.day(event.time_d)
    } else {
        format!("{} (95 %: {low:.0} to {high:.0})", dates.day(event.time_d))
    }
}

/// What happened, in words without a stop.
fn event_words(event: &EventAnswer) -> String {
    let changed = &event.changed;
    match (event.kind, event.gain, event.turn_deg) {
        ("restart", ..) => "bearings and unbalance start anew after an outage".into(),
        (_, Some(gain), _) => format!("{changed} changed by {:+.1} %", 100.0 * (gain - 1.0)),
        (_, _, Some(turn_deg)) => format!("{changed} turned by {turn_deg:+.1}°"),
        _ => format!("{changed} changed"),
    }
}

/// The evidence of an event, or that it needs none.
fn evidence(event: &EventAnswer) -> String {
    if event.stated { "stated".into() } else { format!("{:.0}", event.log_evidence) }
}

/// What an event leaves open until a run-up has been seen, if it does.
fn undiagnosed(track: &TrackAnswer, dates: Dates) -> Option<String> {
    let since = track.undiagnosed_since_d?;
    let mut events = track.joint.iter().flat_map(|joint| &joint.events);
    let event = events.find(|e| e.time_d == since);
    let taken_as = if event.is_some_and(|e| e.kind == "restart") {
        "leaves bearings and unbalance known from later readings alone; a run-up after that day would make the intervals narrower."
    } else if event.is_some_and(|e| e.is_elsewhere) {
        "is neither of the bearings nor of the unbalance; it can be a seal or a bow. The unbalance is assumed to continue from \
         its last value; a run-up after that day would show the cause."
    } else {
        "is attributed to the bearings. Near one speed a missing effect looks the same, and the unbalance may then be outside \
         its interval; a run-up after that day would show the cause."
    };
    Some(format!("The change on {} {taken_as}", dates.day(since)))
}

struct TrackPage<'a> {
    answer: &'a TrackAnswer,
    dates: Dates,
}

impl TrackPage<'_> {
    fn over_time(&self, value: impl Fn(&EstimateAnswer) -> f64) -> Vec<(f64, f64)> {
        self.answer.estimates.iter().map(|e| (e.time_d, value(e))).collect()
    }

    /// A figure over time with the record's flags and re-identifications.
    fn figure(&self, title: &str, quantity: &str, caption: &str, parts: Trend) -> Figure {
        let answer = self.answer;
        let elsewhere = answer.joint.iter().flat_map(|joint| &joint.events).filter(|e| e.is_elsewhere);
        let elsewhere = elsewhere.map(|e| (e.time_d, "no bearing explains".to_string()));
        let named = answer.joint.iter().flat_map(|joint| &joint.events).filter(|e| e.kind != "machine");
        let named: Vec<(f64, String)> = named.map(|e| (e.time_d, e.kind.to_string())).collect();
        let is_named = |time_d: f64| named.iter().any(|n| n.0 == time_d);
        let refitted = answer.reidentified.iter().filter(|r| !is_named(r.since_d));
        let refitted = refitted.map(|r| (r.since_d, self::refitted(r)));
        let of_unbalance = answer.flags.iter().filter(|f| f.cause == "unbalance");
        let jumped = of_unbalance.map(|f| (f.since_d, "unbalance jumped".to_string()));
        let events = refitted.chain(jumped).chain(elsewhere).chain(named.iter().cloned());
        let drawn = Trend {
            along: self.dates.axis(),
            quantity: quantity.into(),
            events: events.collect(),
            flags: answer.flags.iter().map(|f| f.time_d).collect(),
            begin: self.dates.iso(0.0),
            ..parts
        };
        Figure::new(title, caption, trend(&drawn))
    }

    fn residuals(&self, drawn: &TrackCurves) -> Section {
        let (answer, dates) = (self.answer, self.dates);
        let name = answer.method;
        let mut curves = vec![(name.to_string(), self.over_time(|e| e.residual_um))];
        if name != "fixed" {
            curves.push(("bearings constant".into(), drawn.residual_fixed_um.clone()));
        }
        let sums = vec![("feature sum".into(), drawn.feature_sum_um.clone())];
        let ratio = vec![(name.to_string(), self.over_time(|e| 100.0 * e.residual_ratio))];
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
        let of = |curves| Trend { curves, ..Trend::default() };
        let limited = Trend { limits: vec![("model is wrong".into(), RATIO_LIMIT)], ..of(ratio) };
        Section {
            heading: "Does the model fit?".into(),
            paragraphs,
            tables: found.into_iter().chain(cases).collect(),
            figures: vec![
                self.figure(
                    "Residual",
                    "residual, µm 0-pk",
                    "A step up that stays is an event; marks below are flags.",
                    of(curves),
                ),
                self.figure("Feature sum", "feature sum, µm 0-pk", "How much the machine moves.", of(sums)),
                self.figure(
                    "Residual over feature sum",
                    "residual / feature sum, %",
                    "Above a third the model is wrong, whatever it was before.",
                    limited,
                ),
            ],
        }
    }

    /// Calculated against measured features, the two components of each probe.
    fn features(&self, curves: &[FeatureCurve]) -> Section {
        let one = |feature: &FeatureCurve| {
            self.figure(
                &feature.name,
                "feature, µm 0-pk",
                &format!("Bearing {}: calculated against measured.", feature.bearing),
                Trend {
                    measured: Some(("measured".into(), feature.measured.clone())),
                    curves: vec![("calculated".into(), feature.calculated.clone())],
                    ..Trend::default()
                },
            )
        };
        Section {
            heading: "Calculated and measured features".into(),
            figures: curves.iter().map(one).collect(),
            ..Section::default()
        }
    }

    /// U and α of each plane, static and dynamic.
    fn unbalance(&self, curves: &TrackCurves) -> Section {
        let caption = "Band: 95 % interval, where the method states one.";
        let mut figures = Vec::new();
        for plane in &curves.planes {
            let name = &plane.name;
            let (size, angle) = (banded("U", &plane.size_g_mm), banded("α", &plane.angle_deg));
            figures.push(self.figure(&format!("Unbalance of plane {name}"), "U, g·mm", caption, size));
            figures.push(self.figure(&format!("Angle of plane {name}"), "α, degrees", caption, angle));
        }
        let parts: [(&str, UnbalanceOf); 2] =
            [("static", |e| e.static_unbalance), ("dynamic", |e| e.dynamic)];
        for (kind, of) in parts {
            let quantities: [(&str, &str, QuantityOf); 2] = [
                ("Size", "unbalance, g·mm", |u| u.unbalance_g_mm),
                ("Angle", "angle, degrees", |u| u.angle_deg),
            ];
            for (what, quantity, value) in quantities {
                let curves = vec![(kind.to_string(), self.over_time(|e| value(of(e))))];
                figures.push(self.figure(
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
    fn bearings(&self, coefficients: &[CoefficientCurve]) -> Section {
        let one = |coefficient: &CoefficientCurve| {
            let CoefficientCurve { name, unit, curve } = coefficient;
            let quantity = if unit.is_empty() { name.clone() } else { format!("{name}, {unit}") };
            self.figure(
                &format!("Coefficient {}", name.replace('_', " ")),
                &quantity,
                "Band: 95 % interval, where the method states one.",
                banded(name, curve),
            )
        };
        Section {
            heading: "Bearings".into(),
            tables: self.answer.joint.iter().map(constants).collect(),
            figures: coefficients.iter().map(one).collect(),
            ..Section::default()
        }
    }
}

/// What was fitted anew after an event, by its case.
fn refitted(r: &ReidentifiedAnswer) -> String {
    match (r.case, r.of_bearings) {
        (3 | 4, 2) => "both bearings refitted".into(),
        (3 | 4, 3..) => "several bearings refitted".into(),
        _ => format!("bearing {} refitted", r.bearing),
    }
}

/// A curve in its interval, where there is one.
fn banded(name: &str, curve: &BandedCurve) -> Trend {
    let band = &curve.interval_95;
    Trend {
        curves: vec![(name.to_string(), curve.points.clone())],
        bands: (!band.is_empty()).then(|| ("95 % interval".into(), band.clone())).into_iter().collect(),
        ..Trend::default()
    }
}

/// The constant part of the bearings from each event on.
fn constants(joint: &JointAnswer) -> PageTable {
    let row = |since_d: f64, c: &ConstantAnswer| {
        let origin = if c.from_data { "the data" } else { "its prior: the data do not tell" };
        let [low, high] = c.interval_95;
        let numbers =
            [format!("{since_d:.0}"), format!("{:.3e}", c.value), format!("{low:.3e} to {high:.3e}")];
        [c.name.clone()].into_iter().chain(numbers).chain([origin.to_string()]).collect::<Vec<_>>()
    };
    let rows = joint.states.iter().flat_map(|state| state.bearings.iter().map(|c| row(state.since_d, c)));
    PageTable {
        caption: "Constant part of the bearings, and whether one speed could tell it".into(),
        columns: ["coefficient", "from day", "value", "95 % interval", "from"].map(String::from).to_vec(),
        rows: rows.collect(),
    }
}

/// What happened, and how sure that is.
fn events(events: &[EventAnswer], dates: Dates) -> PageTable {
    let row = |e: &EventAnswer| vec![when(e, dates), e.changed.clone(), evidence(e)];
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
        columns: ["case", "residual, µm 0-pk", "unknowns", "criterion", ""].map(String::from).to_vec(),
        rows: r.cases.iter().map(row).collect(),
    }
}
