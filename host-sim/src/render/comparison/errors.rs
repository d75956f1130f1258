//! How far models are from the measurement over speed, beside what noise does.

use nalgebra::Complex;
use rotor_edge_desktop::compare::{ProbePair, probe_pairs};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;

use super::ComparedModel;
use super::figures::ReadingRun;
use crate::render::document::Figure;
use crate::render::trend::{Trend, trend};

/// √χ² of two components that noise exceeds in one case of twenty.
const NOISE_95: f64 = 2.4477;

/// Diameters, µm: of the circle that model and measurement are apart, and of that which noise makes in 19 of 20 readings,
/// where it is known.
type Error = (f64, Option<f64>);

/// Of every probe, and of the forward and backward whirl at every bearing, all models in one figure each.
pub fn figures(
    run: &ReadingRun,
    rotor: &Rotor,
    readings: &[Reading],
    models: &[ComparedModel],
) -> Vec<Figure> {
    let probes = (0..rotor.probe.len()).map(|probe| {
        let error = |model: &ComparedModel, row: usize| {
            let off = model.prediction.predicted_m[row][probe] - readings[row].probes[probe]?;
            Some((2e6 * off.norm(), model.sd_m(readings, row, probe).map(|sd| 2e6 * NOISE_95 * sd)))
        };
        figure(run, &format!("probe {}", rotor.probe[probe].name), readings, models, &error)
    });
    let pairs = probe_pairs(rotor);
    let whirls = pairs.iter().flat_map(|pair| {
        ["forward", "backward"].into_iter().enumerate().map(|(way, name)| {
            let error = |model: &ComparedModel, row: usize| whirl_error(pair, way, model, readings, row);
            let of = format!("{name} whirl at bearing {}", rotor.bearing[pair.bearing].name);
            figure(run, &of, readings, models, &error)
        })
    });
    probes.chain(whirls).collect()
}

/// In one sense of whirl.
fn whirl_error(
    pair: &ProbePair,
    way: usize,
    model: &ComparedModel,
    readings: &[Reading],
    row: usize,
) -> Option<Error> {
    let read = |probe: usize| readings[row].probes[probe];
    let [a, b] = pair.probes;
    let off = |probe: usize| Some(model.prediction.predicted_m[row][probe] - read(probe)?);
    let apart = pair.whirl([off(a)?, off(b)?])[way].norm();
    // independent probes: each acts through its own share of the circle
    let share = |probe: usize| {
        let unit = pair.probes.map(|p| Complex::from(f64::from(u8::from(p == probe))));
        Some((pair.whirl(unit)[way].norm() * model.sd_m(readings, row, probe)?).powi(2))
    };
    let sd = share(a).zip(share(b)).map(|(a, b)| (a + b).sqrt());
    Some((2e6 * apart, sd.map(|sd| 2e6 * NOISE_95 * sd)))
}

fn figure(
    run: &ReadingRun,
    of: &str,
    readings: &[Reading],
    models: &[ComparedModel],
    error: &dyn Fn(&ComparedModel, usize) -> Option<Error>,
) -> Figure {
    let along = |model: &ComparedModel| {
        let at = |row: &usize| Some((run.place(readings, *row), error(model, *row)?));
        run.rows().iter().filter_map(at).collect::<Vec<_>>()
    };
    let curve = |model: &ComparedModel| {
        let points = along(model).into_iter().map(|(at, (off, _))| (at, off)).collect();
        (model.prediction.label.clone(), points)
    };
    let noise = models.last().map(along).unwrap_or_default();
    let band: Vec<_> = noise.into_iter().filter_map(|(at, (_, noise))| Some([at, 0.0, noise?])).collect();
    let drawn = Trend {
        along: run.along(readings),
        quantity: "error, µm pk-pk".into(),
        curves: models.iter().map(curve).collect(),
        bands: (!band.is_empty()).then(|| ("noise, 95 %".into(), band)).into_iter().collect(),
        ..Trend::default()
    };
    let caption = "|model − measurement| as a phasor. Noise stays in the band in 19 of 20 readings.".into();
    run.figure("Error of", of, caption, trend(&drawn))
}
