//! The unbalance on the last day that the model fits, with what the record says of its certainty.

use anyhow::Result;
use nalgebra::{Complex, DVector};
use rotor_edge_desktop::diagnose::PlaneUnbalances;
use rotor_edge_desktop::identify::{PhaseOne, SolvedReading, noise_scale, unbalance_covariance};
use rotor_edge_desktop::machine::drawing::{Noise, Rotor};
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::unbalance::G_MM;

use crate::answers::findings::DeterminedAnswer;
use crate::answers::replay::{KnownUnbalance, LastUnbalance};
use crate::bus::decoded::planes_of;
use crate::edge::Deployment;
use crate::replay::{AnsweredReading, day};

/// Of the last reading that the controller judged, and neither flagged nor suspected.
///
/// # Errors
/// If the model is singular at a speed of the record.
pub fn last(
    rotor: &Rotor,
    deployment: &Deployment,
    record: &[Reading],
    answers: &[AnsweredReading],
    phase_one: Option<&PhaseOne>,
) -> Result<LastUnbalance> {
    let fits = |answer: &&AnsweredReading| answer.judged() && !answer.flagged() && !answer.suspicious();
    let found = |answer: &AnsweredReading| SolvedReading {
        reading: &record[answer.row],
        unbalance_kg_m: DVector::from_iterator(
            rotor.plane.len(),
            planes_of(&answer.result).iter().map(|[x, y]| Complex::new(f64::from(*x), f64::from(*y)) / G_MM),
        ),
    };
    let Some(answer) = answers.iter().rfind(fits) else {
        return Ok(LastUnbalance::Unknown { why: "the model fits no reading of this record".into() });
    };
    let noise = Noise::of(rotor, record);
    let fitted: Vec<SolvedReading> = answers.iter().filter(fits).map(found).collect();
    let scale = noise_scale(rotor, &deployment.desktop, &noise, &fitted)?;
    let model = phase_one.map(PhaseOne::model_uncertainty);
    let newest = found(answer);
    let time_d = day(record, answer.row);
    let Some(covariance) = unbalance_covariance(rotor, &newest, &noise, scale, model.as_ref())? else {
        let why = format!("the reading of day {time_d:.0} has fewer numbers than the planes have unknowns");
        return Ok(LastUnbalance::Unknown { why });
    };
    let names = rotor.plane.iter().map(|p| p.name.as_str());
    Ok(LastUnbalance::Known(KnownUnbalance {
        time_d,
        determined: DeterminedAnswer::of(
            &PlaneUnbalances::new(names, newest.unbalance_kg_m.as_slice(), &covariance),
            true,
        ),
        noise_scale: scale,
        with_bearings: model.is_some(),
        outdated: answers.last().is_some_and(|newest| !fits(&newest)),
    }))
}
