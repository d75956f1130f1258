//! The desk's commands for Python: words in, the JSON object of the command line out. What is around it is in `rotor_edge/`.

mod files;
mod tracker;
mod watched;

use pyo3::prelude::*;

#[pymodule]
mod _native {
    use std::ffi::OsString;
    use std::path::PathBuf;

    use pyo3::create_exception;
    use pyo3::exceptions::PyValueError;
    use pyo3::prelude::*;
    use rotor_edge::command;

    use crate::{files, watched};

    #[pymodule_export]
    use crate::tracker::Monitor;

    create_exception!(
        rotor_edge,
        Error,
        PyValueError,
        "Input that cannot be used; the sentence of the command line says what to mend."
    );

    /// What `rotor-edge WORDS` prints, where `--json` is among the words.
    #[pyfunction]
    #[pyo3(signature = (words, progress = None))]
    fn answer(py: Python<'_>, words: Vec<OsString>, progress: Option<Py<PyAny>>) -> PyResult<String> {
        said(watched::watched(py, progress, move |listener| command::object(words, listener))?)
    }

    /// A checked rotor: its file in TOML with everything that lies beside it, and the same in JSON.
    #[pyfunction]
    fn rotor(py: Python<'_>, path: PathBuf) -> PyResult<(String, String)> {
        said(py.detach(|| files::rotor(&path)))
    }

    /// A checked measurement in CSV; with a rotor, one that belongs to it.
    #[pyfunction]
    #[pyo3(signature = (path, rotor = None))]
    fn measurement(py: Python<'_>, path: PathBuf, rotor: Option<PathBuf>) -> PyResult<String> {
        said(py.detach(|| files::measurement(&path, rotor.as_deref())))
    }

    pub fn said<T>(result: anyhow::Result<T>) -> PyResult<T> {
        result.map_err(|error| Error::new_err(format!("{error:#}")))
    }

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("Error", module.py().get_type::<Error>())?;
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
