//! What every bus can do.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

use anyhow::Result;
use rotor_edge_core::can::Frame;

/// Time since the first call in this process. It never goes back.
pub fn monotonic() -> Duration {
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed()
}

/// One participant's place on a real bus.
pub trait CanBus: Send {
    /// Puts a frame on the bus.
    ///
    /// # Errors
    /// If the bus is gone or takes nothing any more.
    fn send(&mut self, frame: &Frame) -> Result<()>;

    /// The next frame of another participant; `None` if none came in time. A timeout of zero only looks.
    ///
    /// # Errors
    /// If the bus is gone.
    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>>;

    /// Which bus this is, for messages.
    fn description(&self) -> String;

    /// Extended, remote and error frames, and what could not be read as a frame: none of it is ours.
    fn passed_over(&self) -> u64 {
        0
    }

    /// Time on this bus since an arbitrary start: simulated on a simulated bus. It never goes back.
    fn now(&self) -> Duration {
        monotonic()
    }
}

impl<B: CanBus + ?Sized> CanBus for Box<B> {
    fn send(&mut self, frame: &Frame) -> Result<()> {
        (**self).send(frame)
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>> {
        (**self).receive(timeout)
    }

    fn description(&self) -> String {
        (**self).description()
    }

    fn passed_over(&self) -> u64 {
        (**self).passed_over()
    }

    fn now(&self) -> Duration {
        (**self).now()
    }
}
