//! Work on a thread of its own while the caller's waits for news of it, for signals and for nothing else.

use std::panic::resume_unwind;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread::Builder;
use std::time::Duration;

use anyhow::Result;
use pyo3::prelude::*;
use rotor_edge::command::Listener;

/// How long a signal may wait.
const PATIENCE: Duration = Duration::from_millis(50);
/// As much as a program's first thread has, which runs the same work on the command line.
const STACK_BYTES: usize = 8 << 20;

enum News<T> {
    Step(usize, Option<usize>),
    Done(Result<T>),
}

/// What unwinds work whose answer nobody waits for.
struct Abandoned;

/// Does the work with the interpreter released. `progress` is called with the steps done and of how many. A signal, or an
/// exception of `progress`, ends the waiting at once, and the work at its next step.
pub fn watched<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(Listener) -> Result<T> + Send + 'static,
) -> PyResult<Result<T>> {
    let (sender, news) = channel();
    let worker = Builder::new().stack_size(STACK_BYTES).spawn(move || {
        let told = |done, of| {
            if sender.send(News::Step(done, of)).is_err() {
                resume_unwind(Box::new(Abandoned));
            }
        };
        let answer = work(Listener::Program(&told));
        // whoever does not wait any more needs no answer
        let _ = sender.send(News::Done(answer));
    })?;
    py.detach(move || {
        loop {
            match news.recv_timeout(PATIENCE) {
                Ok(News::Done(answer)) => return Ok(answer),
                Ok(News::Step(done, of)) => Python::attach(|py| match &progress {
                    Some(told) => told.call1(py, (done, of)).map(drop),
                    None => Ok(()),
                })?,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => match worker.join() {
                    Err(panic) => resume_unwind(panic),
                    Ok(()) => unreachable!("a worker that ends has sent its answer"),
                },
            }
            Python::attach(|py| py.check_signals())?;
        }
    })
}
