//! What boards start from, made from the sample machine: the model of phase I, the model with the seal that
//! acts from day 125 on, and the record.

use anyhow::Result;
use rotor_edge::edge::{Deployment, EdgeModel, encoded};
use rotor_edge::sample;
use rotor_edge_core::reading::Reading;
use rotor_edge_desktop::diagnose::improve;
use rotor_edge_desktop::identify::{PhaseOneConfig, identify};
use rotor_edge_desktop::measurement;
use rotor_edge_desktop::rotor_file;

/// Bytes of a reading: the speed and eight features, f32, little endian.
pub const READING_BYTES: usize = 36;

/// The sample as a board sees it.
pub struct BoardSample {
    /// Made by phase I from the first three days and the commissioning run-up.
    pub model: EdgeModel,
    /// Made by `improve` from the run-up of day 126.
    pub better: EdgeModel,
    /// Every row of the record; a lost probe is [`ProbeVector::LOST`](rotor_edge_core::reading::ProbeVector::LOST).
    pub readings: Vec<Reading>,
}

impl BoardSample {
    /// Identifies, improves and reads.
    ///
    /// # Errors
    /// None, as long as the sample's own tests pass.
    pub fn make() -> Result<Self> {
        let (rotor, record, runup) = sample::load()?;
        let first: Vec<_> = record[..3].iter().chain(&runup).cloned().collect();
        let identified = identify(&rotor, &first, &PhaseOneConfig::default())?.rotor;
        let fastest_rpm = record.iter().chain(&runup).map(|r| r.speed_rpm).fold(0.0, f64::max);
        let deployment = Deployment::new(&identified, fastest_rpm)?;
        let drawing = rotor_file::parse("sample rotor.toml", sample::ROTOR)?;
        let later = measurement::parse("sample runup-day126.csv", sample::RUNUP_DAY_126, &drawing)?;
        let better = Deployment::new(&improve(&drawing, &later, |_| ())?.rotor, fastest_rpm)?;
        let readings = record.iter().map(|r| deployment.reading(r)).collect();
        Ok(Self { model: deployment.edge, better: better.edge, readings })
    }

    /// The readings one after another, [`READING_BYTES`] each.
    pub fn reading_bytes(&self) -> Vec<u8> {
        let features = |r: &Reading| r.probes().iter().flat_map(|p| [p.cos_um, p.sin_um]).collect::<Vec<_>>();
        let values = self.readings.iter().flat_map(|r| [r.speed_rpm].into_iter().chain(features(r)));
        values.flat_map(f32::to_le_bytes).collect()
    }
}

/// A model as it is deployed.
///
/// # Panics
/// Never: the buffer has room for the largest.
pub fn model_bytes(model: &EdgeModel) -> Vec<u8> {
    encoded(model).expect("the buffer has room for the largest model")
}
