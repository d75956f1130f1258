//! The machine in a story: where something is missing, how probable it is elsewhere, and how the shaft moves.

use nalgebra::DVector;
use rotor_edge_desktop::bearing::Law;
use rotor_edge_desktop::diagnose::{BestFit, Candidate};
use rotor_edge_desktop::machine::drawing::Bearing;
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::units::rad_s;

use crate::render::Figure;
use crate::render::sketch::{Mark, sketch};
use crate::render::trend::{Trend, trend};
use crate::scale::rpm;

/// Places less probable than this are not marked.
const WORTH_MARKING: f64 = 0.01;

/// An effect in words, such as "seal at disk 3".
pub fn words(candidate: &Candidate) -> String {
    let kind = candidate.effect.replace('_', " ");
    candidate.at.as_ref().map_or_else(|| kind.clone(), |at| format!("{kind} at {at}"))
}

/// Where a bearing, a disk, a probe or an end of this name is, m from the left end.
pub fn position_m(rotor: &Rotor, name: &str) -> Option<f64> {
    let bearing = rotor.bearing.iter().map(|b| (&b.name, b.position_m));
    let disk = rotor.disk.iter().map(|d| (&d.name, d.position_m));
    let probe = rotor.probe.iter().map(|p| (&p.name, p.position_m));
    let named = bearing.chain(disk).chain(probe).find(|(own, _)| *own == name).map(|(_, z)| z);
    named.or_else(|| (name == "left end").then_some(0.0))
}

/// The machine with every place that something may be missing at; `main` are the effects that the page is about.
pub fn figure(rotor: &Rotor, candidates: &[Candidate], main: &[&Candidate]) -> Figure {
    let is_main = |at: &str| main.iter().any(|c| c.at.as_deref() == Some(at));
    let mut marks: Vec<Mark> = Vec::new();
    let mut elsewhere = Vec::new();
    for c in main {
        match c.at.as_deref().and_then(|at| position_m(rotor, at)) {
            Some(position_m) => {
                marks.push(Mark { position_m, text: c.effect.replace('_', " "), is_main: true })
            }
            None => elsewhere.push(words(c)),
        }
    }
    let mut places: Vec<&str> = candidates.iter().filter_map(|c| c.at.as_deref()).collect();
    places.sort_unstable();
    places.dedup();
    for at in places {
        let here = candidates.iter().filter(|c| c.at.as_deref() == Some(at));
        let probability: f64 = here.map(|c| c.probability).filter(|p| p.is_finite()).sum();
        let Some(position_m) = position_m(rotor, at).filter(|_| probability >= WORTH_MARKING) else {
            continue;
        };
        marks.push(Mark { position_m, text: format!("{:.0} %", 100.0 * probability), is_main: is_main(at) });
    }
    let mut caption = String::from(
        "To scale; triangles are bearings, arrows probes, dashed lines planes. Rings: where one missing effect alone would be, \
         with its probability there.",
    );
    if !elsewhere.is_empty() {
        caption += &format!(" Of the machine as a whole, or of a run: {}.", elsewhere.join(", "));
    }
    Figure::new("Machine", caption, sketch("The machine to scale", rotor, &marks))
}

/// How far the whole shaft moves at one speed by each model, without trial weights; nothing where a model cannot say.
pub fn deflection(models: &[(String, &BestFit)], speed_rpm: f64) -> Option<Figure> {
    let mut curves = Vec::new();
    let mut clearances = Vec::new();
    for (label, best) in models {
        let unbalance_kg_m = DVector::from_column_slice(&best.unbalance_kg_m);
        let shaft = Model::finite_elements(&best.rotor).deflection(rad_s(speed_rpm), &unbalance_kg_m).ok()?;
        let point =
            |d: &rotor_edge_desktop::model::deflection::Deflection| (d.position_m, 2e6 * d.largest_m());
        curves.push((label.clone(), shaft.iter().map(point).collect::<Vec<_>>()));
        let clearance = |b: &Bearing| match &b.law {
            Law::Film(law) => Some((b.position_m, 2e6 * law.film.radial_clearance_m)),
            _ => None,
        };
        clearances = best.rotor.bearing.iter().filter_map(clearance).collect();
    }
    let rotor = &models.last()?.1.rotor;
    let caption = "Longest diameter of the orbit along the shaft, from the fitted unbalance alone; circles: the whole clearance of \
                   oil films, where the file states it.";
    Some(Figure::new(
        format!("How the shaft moves at {}", rpm(speed_rpm)),
        caption,
        trend(&Trend {
            along: "along the shaft, m".into(),
            quantity: "µm pk-pk".into(),
            measured: (!clearances.is_empty()).then(|| ("clearance".into(), clearances)),
            curves,
            events: rotor.bearing.iter().map(|b| (b.position_m, b.name.clone())).collect(),
            ..Trend::default()
        }),
    ))
}
