//! The controller's core as an object: a reading in, the JSON object of what it says out.

use std::path::PathBuf;

use pyo3::prelude::*;
use rotor_edge::command::tracker::Tracker;

use crate::_native::said;

/// A monitor of one machine, without a bus.
#[pyclass]
pub struct Monitor(Tracker);

#[pymethods]
impl Monitor {
    #[new]
    #[pyo3(signature = (rotor, fastest_rpm, slow_roll, settings, seed))]
    fn new(
        py: Python<'_>,
        rotor: PathBuf,
        fastest_rpm: Option<f64>,
        slow_roll: Option<PathBuf>,
        settings: Vec<String>,
        seed: u64,
    ) -> PyResult<Self> {
        let made = py.detach(|| Tracker::new(&rotor, fastest_rpm, slow_roll.as_deref(), &settings, seed));
        Ok(Self(said(made)?))
    }

    fn read(
        &mut self,
        py: Python<'_>,
        time_s: f64,
        speed_rpm: f64,
        cos_sin_um: Vec<[f64; 2]>,
    ) -> PyResult<String> {
        said(py.detach(|| self.0.read(time_s, speed_rpm, &cos_sin_um)))
    }

    fn wait(&mut self, py: Python<'_>, time_s: f64) -> PyResult<String> {
        said(py.detach(|| self.0.wait(time_s)))
    }
}
