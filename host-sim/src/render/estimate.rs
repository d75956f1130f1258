//! Text, story and section of an answer of `estimate`.

use nalgebra::Complex;
use rotor_edge_desktop::significance::percent;

use super::regions::{Region, regions};
use super::text;
use super::{Figure, PageTable, Section, Story};
use crate::answers::estimate::{EstimatesAnswer, RunEstimateAnswer};
use crate::answers::shared::PlaneUnbalance;
use crate::scale::three_digits;

const COLUMNS: [&str; 7] =
    ["run", "plane", "unbalance, g·mm", "95 %", "angle", "stated", "by influence coefficients"];

/// Runs that the first screen names.
const MOST_NAMED: usize = 6;

/// The whole answer on a terminal.
pub fn text(answer: &EstimatesAnswer) -> String {
    let lines: Vec<String> = lines(answer).map(|line| format!("{line}\n")).collect();
    format!("{}\n{}\n{}", legend(answer), text::table(&COLUMNS, &rows(answer)), lines.concat())
}

/// The first screen of the page, beside the first plane.
pub fn story(answer: &EstimatesAnswer, next: (String, Option<String>)) -> Story {
    let planes = answer.estimates.iter().flat_map(|e| &e.planes);
    let half_widths = planes.map(|p| 0.5 * (p.interval_95[1] - p.interval_95[0]));
    let (least, most) =
        half_widths.fold((f64::INFINITY, 0.0_f64), |(least, most), half| (least.min(half), most.max(half)));
    let verdict = match &answer.estimates[..] {
        [only] => {
            let planes = only.planes.iter().map(|p| {
                let size = three_digits(p.unbalance_g_mm);
                format!("{size} g·mm at {:.0}° in plane {}", p.angle_deg, p.name)
            });
            let planes: Vec<String> = planes.collect();
            format!("Run {} has {} more than run {}.", only.run, planes.join(" and "), answer.base)
        }
        many => format!(
            "The unbalance of {} runs relative to run {}, to within {} to {} g·mm (95 %).",
            many.len(),
            answer.base,
            three_digits(least),
            three_digits(most)
        ),
    };
    let answers = [
        ("How sure", answer.determined.words.clone()),
        ("Sessions", answer.sessions.words.clone()),
        ("Stated weights", refuted_runs(answer).into_iter().collect()),
        ("Remarks", answer.remarks.clone()),
    ];
    let answers = answers.into_iter().filter(|(_, said)| !said.is_empty());
    Story {
        verdict,
        answers: answers.map(|(question, said)| (question, said.join(" "))).collect(),
        next,
        beside: (!answer.planes.is_empty()).then(|| figure(answer, 0)).into_iter().collect(),
        below: Vec::new(),
    }
}

/// The table of all runs, and the other planes with the region of every run.
pub fn section(answer: &EstimatesAnswer) -> Section {
    let table = PageTable {
        caption: legend(answer),
        columns: COLUMNS.map(String::from).to_vec(),
        rows: rows(answer).into_iter().map(|r| r.to_vec()).collect(),
    };
    Section {
        heading: "Unbalance by run".into(),
        paragraphs: lines(answer).collect(),
        tables: vec![table],
        figures: (1..answer.planes.len()).map(|j| figure(answer, j)).collect(),
    }
}

/// How the angles and magnitudes of the table are meant.
fn legend(answer: &EstimatesAnswer) -> String {
    format!(
        "Unbalance relative to run {}; angles from the keyphasor mark, with the rotation; intervals and regions are 95 %.",
        answer.base
    )
}

/// Conditions, what the data determine, sessions, weights that cannot be true, remarks.
fn lines(answer: &EstimatesAnswer) -> impl Iterator<Item = String> {
    let determined = answer.determined.words.iter().cloned();
    let sessions = answer.sessions.words.iter().cloned();
    std::iter::once(conditions(answer))
        .chain(determined)
        .chain(sessions)
        .chain(refuted(answer))
        .chain(answer.remarks.iter().cloned())
}

/// Runs whose stated weights cannot be true, in one sentence; the lines further down hold all.
fn refuted_runs(answer: &EstimatesAnswer) -> Option<String> {
    let runs: Vec<&str> = answer.refuted_runs.iter().map(|r| r.run.as_str()).collect();
    match &runs[..] {
        [] => None,
        [_] => refuted(answer).next(),
        many => {
            let (first, more) = many.split_at(MOST_NAMED.min(many.len()));
            let more = if more.is_empty() { String::new() } else { format!(" and {} more", more.len()) };
            Some(format!(
                "The stated weights of {} runs are wrong: {}{more}. The list below compares what was stated and found.",
                many.len(),
                first.join(", ")
            ))
        }
    }
}

/// Runs whose stated weights cannot be true.
fn refuted(answer: &EstimatesAnswer) -> impl Iterator<Item = String> {
    answer.refuted_runs.iter().map(|r| {
        format!(
            "The stated weights of run {} are wrong ({} probable): stated {}; found {}.",
            r.run,
            percent(r.probability),
            placed(&r.stated),
            placed(&r.found)
        )
    })
}

fn conditions(answer: &EstimatesAnswer) -> String {
    let each = answer.condition.iter().map(|c| {
        let condition = c.condition.unwrap_or(f64::INFINITY);
        match c.speed_rpm {
            Some(speed_rpm) => format!("{condition:.1} at {speed_rpm:.0} rpm"),
            None => format!("{condition:.1} of all speeds together"),
        }
    });
    format!("Condition of the influence of the planes: {}.", each.collect::<Vec<_>>().join(", "))
}

fn at(u: &PlaneUnbalance) -> String {
    match u.unbalance_g_mm {
        0.0 => "0".into(),
        size => format!("{size:.1} at {:.0}°", u.angle_deg),
    }
}

/// One unbalance a plane, in words.
fn placed(unbalance: &[PlaneUnbalance]) -> String {
    unbalance.iter().map(|u| format!("{} in {}", at(u), u.name)).collect::<Vec<_>>().join(", ")
}

/// One row a run and plane.
fn rows(answer: &EstimatesAnswer) -> Vec<[String; COLUMNS.len()]> {
    let mut rows = Vec::new();
    for e in &answer.estimates {
        for (j, p) in e.planes.iter().enumerate() {
            let of = |all: &Option<Vec<PlaneUnbalance>>| all.as_ref().map_or("–".into(), |u| at(&u[j]));
            rows.push([
                e.run.clone(),
                p.name.clone(),
                format!("{:.1}", p.unbalance_g_mm),
                format!("{:.1} to {:.1}", p.interval_95[0], p.interval_95[1]),
                format!("{:.0}°", p.angle_deg),
                of(&e.stated),
                of(&e.influence.planes),
            ]);
        }
    }
    rows
}

fn figure(answer: &EstimatesAnswer, j: usize) -> Figure {
    let phasor = |size: f64, angle_deg: f64| Complex::from_polar(size, angle_deg.to_radians());
    let region = |e: &RunEstimateAnswer| Region {
        found: phasor(e.planes[j].unbalance_g_mm, e.planes[j].angle_deg),
        stated: e.stated.as_ref().map(|stated| phasor(stated[j].unbalance_g_mm, stated[j].angle_deg)),
        semi_axes: e.planes[j].region.semi_axes_g_mm,
        major_deg: e.planes[j].region.major_deg,
    };
    let title = format!("Unbalance in plane {}", answer.planes[j]);
    Figure {
        id: format!("regions-{}", j + 1),
        caption:
            "Each run as estimated, in the ellipse that holds it with 95 %, and a line to what was stated."
                .into(),
        drawing: regions(&answer.estimates.iter().map(region).collect::<Vec<_>>()).into(),
        title,
    }
}
