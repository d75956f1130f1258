//! The controller's core for programs that are no shell: the model that `deploy` would send, a reading at a time, no bus.

use std::path::Path;

use anyhow::{Result, anyhow, bail};
use rotor_edge_core::can::MonitorResult;
use rotor_edge_core::node::NodeConfig;
use rotor_edge_core::state::Status;
use rotor_edge_core::thresholds::Thresholds;
use rotor_edge_desktop::measurement::{Reading, phasor_m};

use super::deployable;
use super::detector_arguments::checked;
use super::setting::Setting;
use crate::answers::tracker::MonitoredAnswer;
use crate::edge::Deployment;
use crate::node::Bench;

/// A monitor of one machine.
pub struct Tracker {
    deployment: Deployment,
    bench: Bench,
}

impl Tracker {
    /// A monitor with the model of a rotor's file, as `rotor-edge deploy` makes it; `settings` are thresholds as
    /// `rotor-edge thresholds` names them, `seed` is that of the particle swarm.
    ///
    /// # Errors
    /// One sentence on the file or the threshold that cannot be used.
    pub fn new(
        rotor: &Path,
        fastest_rpm: Option<f64>,
        slow_roll: Option<&Path>,
        settings: &[String],
        seed: u64,
    ) -> Result<Self> {
        let deployment = deployable::of_file(rotor, fastest_rpm, slow_roll)?;
        let settings = settings.iter().map(|text| text.parse()).collect::<Result<Vec<Setting>>>()?;
        let mut config = NodeConfig::new(1);
        config.track.seed = seed;
        config.thresholds = checked(Thresholds::DEFAULT, &settings)?;
        let bench = Bench::new(&deployment.edge, config)?;
        Ok(Self { deployment, bench })
    }

    /// What it makes of a reading, as one JSON object: `cos_sin_um` holds cosine and sine of each probe, zero to peak, in the
    /// order of the rotor's file; a lost probe's are not numbers. Time is in seconds since the start.
    ///
    /// # Errors
    /// If time goes back, or there are more or fewer probes than the rotor's file has.
    pub fn read(&mut self, time_s: f64, speed_rpm: f64, cos_sin_um: &[[f64; 2]]) -> Result<String> {
        let time_us = self.time_us(time_s)?;
        let probes = self.deployment.edge.description().probes.len();
        if cos_sin_um.len() != probes {
            bail!("the reading has {} probes, expected {probes} as in the rotor's file", cos_sin_um.len());
        }
        let phasor =
            |[cos, sin]: &[f64; 2]| (cos.is_finite() && sin.is_finite()).then(|| phasor_m(*cos, *sin));
        let measured =
            Reading { speed_rpm, probes: cos_sin_um.iter().map(phasor).collect(), ..Reading::default() };
        let (result, status) = self.bench.read(time_us, &self.deployment.reading(&measured));
        text(&status, result.as_ref())
    }

    /// What it says of itself when no reading has come until then, as one JSON object.
    ///
    /// # Errors
    /// If time goes back.
    pub fn wait(&mut self, time_s: f64) -> Result<String> {
        let time_us = self.time_us(time_s)?;
        text(&self.bench.wait(time_us), None)
    }

    fn time_us(&self, time_s: f64) -> Result<u64> {
        let before_s = self.bench.time_us() as f64 * 1e-6;
        let time_us = (time_s * 1e6).round();
        // beyond this, not every µs is a number
        if !(0.0..=2f64.powi(53)).contains(&time_us) || (time_us as u64) < self.bench.time_us() {
            return Err(anyhow!("the time {time_s} s cannot be, expected seconds from {before_s} on"));
        }
        Ok(time_us as u64)
    }
}

fn text(status: &Status, result: Option<&MonitorResult>) -> Result<String> {
    Ok(serde_json::to_string(&MonitoredAnswer::of(status, result))?)
}
