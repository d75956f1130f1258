//! A shared bus on a simulated clock: several programs in one process, each in a thread of its own, none of which waits in
//! real time.
//!
//! One program runs at a time, and its work takes no simulated time. When all of them wait for frames, the frames on the
//! [`VirtualBus`] go over the wire and its clock moves on to the next arrival or the end of the next wait. The program that
//! made the bus is the main program. A run repeats exactly, as no thread overtakes another.

#[cfg(test)]
mod tests;

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use anyhow::{Result, bail};
use rotor_edge_core::can::Frame;

use super::can_bus::CanBus;
use super::reconnecting::Join;
use super::virtual_bus::{BusConfig, Port, VirtualBus};
use crate::clock::Clock;

/// Index of the main program.
const MAIN: usize = 0;

/// The bus, held by its main program. All other programs fail when it is dropped.
pub struct SimulatedBus {
    shared: Arc<Shared>,
}

struct Shared {
    state: Mutex<SimulationState>,
    changed: Condvar,
}

struct SimulationState {
    wire: VirtualBus,
    programs: Vec<Program>,
    running: usize,
    /// The server of the bus is there.
    is_up: bool,
    /// Connections made before the server last went away are dead.
    epoch: u64,
    /// The main program has left, or no program can ever go on.
    is_over: bool,
}

#[derive(Default)]
struct Program {
    /// `None` while it runs.
    wait: Option<Wait>,
    is_killed: bool,
    has_ended: bool,
}

#[derive(Clone, Copy)]
enum Wait {
    /// For a frame on a connection, or for a time without one.
    Until { connection: Option<(Port, u64)>, end_us: u64 },
    /// For the end of another program.
    End(usize),
}

/// One connection of a program.
pub struct SimulatedPort {
    shared: Arc<Shared>,
    program: usize,
    port: Port,
    epoch: u64,
}

/// A program beside the main one.
pub struct Running<T> {
    shared: Arc<Shared>,
    program: usize,
    thread: JoinHandle<T>,
}

/// Joins a simulated bus again for one program.
pub struct SimulatedJoin {
    shared: Arc<Shared>,
    program: usize,
}

/// A program's clock: zero at its start.
pub struct SimulatedClock {
    shared: Arc<Shared>,
    start_us: u64,
}

impl SimulatedBus {
    pub fn new(config: BusConfig) -> Self {
        let state = SimulationState {
            wire: VirtualBus::new(config, 0),
            programs: vec![Program::default()],
            running: MAIN,
            is_up: true,
            epoch: 0,
            is_over: false,
        };
        Self { shared: Arc::new(Shared { state: Mutex::new(state), changed: Condvar::new() }) }
    }

    /// A connection of the main program.
    pub fn join(&self) -> SimulatedPort {
        self.shared.connect(MAIN)
    }

    /// Starts a program with a connection of its own.
    pub fn start<T: Send + 'static>(
        &self,
        work: impl FnOnce(SimulatedPort) -> T + Send + 'static,
    ) -> Running<T> {
        let shared = self.shared.clone();
        let program = {
            let mut state = shared.lock();
            let wait = Some(Wait::Until { connection: None, end_us: state.wire.now_us() });
            state.programs.push(Program { wait, ..Program::default() });
            state.programs.len() - 1
        };
        let port = shared.connect(program);
        let thread = std::thread::spawn(move || {
            let ends = Ends { shared: port.shared.clone(), program };
            ends.shared.await_turn(program);
            work(port)
        });
        Running { shared, program, thread }
    }

    /// Passes time in the main program.
    pub fn pass(&self, time: Duration) {
        self.shared.wait(MAIN, None, time);
    }

    /// The server ends: every connection is dead.
    pub fn go_away(&self) {
        self.shared.lock().is_up = false;
    }

    /// The server is there again, and can be joined.
    pub fn come_back(&self) {
        let mut state = self.shared.lock();
        state.is_up = true;
        state.epoch += 1;
    }

    /// Time since the bus began.
    pub fn now(&self) -> Duration {
        self.shared.now()
    }
}

impl Drop for SimulatedBus {
    fn drop(&mut self) {
        self.shared.lock().is_over = true;
        self.shared.changed.notify_all();
    }
}

impl<T> Running<T> {
    /// Ends it at once, as by a loss of power: its connections fail. Its result is what it makes of that.
    ///
    /// # Panics
    /// If it panicked.
    pub fn kill(self) -> T {
        self.shared.lock().programs[self.program].is_killed = true;
        self.end()
    }

    /// Waits until it ends by itself.
    ///
    /// # Panics
    /// If it panicked.
    pub fn end(self) -> T {
        let mut state = self.shared.lock();
        state.programs[MAIN].wait = Some(Wait::End(self.program));
        state.schedule();
        drop(state);
        self.shared.await_turn(MAIN);
        self.thread.join().expect("the program panicked")
    }
}

/// Marks a program as ended, also by a panic.
struct Ends {
    shared: Arc<Shared>,
    program: usize,
}

impl Drop for Ends {
    fn drop(&mut self) {
        let mut state = self.shared.lock();
        state.programs[self.program].has_ended = true;
        if state.running == self.program {
            state.schedule();
        }
        self.shared.changed.notify_all();
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, SimulationState> {
        // a panic in one program leaves the state whole
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn connect(self: &Arc<Self>, program: usize) -> SimulatedPort {
        let mut state = self.lock();
        let port = state.wire.join();
        SimulatedPort { shared: self.clone(), program, port, epoch: state.epoch }
    }

    fn now(&self) -> Duration {
        Duration::from_micros(self.lock().wire.now_us())
    }

    /// Lets others run until a frame has arrived, the connection fails or the time is over.
    fn wait(&self, program: usize, connection: Option<(Port, u64)>, time: Duration) {
        let mut state = self.lock();
        let end_us = state.wire.now_us().saturating_add(time.as_micros() as u64);
        state.programs[program].wait = Some(Wait::Until { connection, end_us });
        state.schedule();
        drop(state);
        self.await_turn(program);
    }

    fn await_turn(&self, program: usize) {
        self.changed.notify_all();
        let mut state = self.lock();
        while !state.is_over && (state.running != program || state.programs[program].wait.is_some()) {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

impl SimulationState {
    fn is_dead(&self, epoch: u64) -> bool {
        !self.is_up || epoch != self.epoch
    }

    /// Gives the turn to the next program that can go on; moves the clock on until there is one.
    fn schedule(&mut self) {
        loop {
            if let Some(next) = (0..self.programs.len()).find(|program| self.can_go_on(*program)) {
                self.programs[next].wait = None;
                self.running = next;
                return;
            }
            if self.wire.transmit_one().is_some() {
                continue;
            }
            let ends = self.programs.iter().filter(|p| !p.has_ended).filter_map(|p| match p.wait {
                Some(Wait::Until { end_us, .. }) => Some(end_us),
                _ => None,
            });
            let Some(next_us) = ends.chain(self.wire.next_arrival_us()).min() else {
                self.is_over = true;
                return;
            };
            self.wire.wait_until(next_us);
        }
    }

    fn can_go_on(&self, program: usize) -> bool {
        let Program { wait, is_killed, has_ended } = &self.programs[program];
        !has_ended
            && match *wait {
                None => false,
                Some(Wait::End(other)) => self.programs[other].has_ended,
                Some(Wait::Until { connection, end_us }) => {
                    let is_ready = |(port, epoch)| self.is_dead(epoch) || self.wire.has_arrived(port);
                    *is_killed || end_us <= self.wire.now_us() || connection.is_some_and(is_ready)
                }
            }
    }
}

impl SimulatedPort {
    /// Joins again after the server went away and came back.
    pub fn rejoining(&self) -> SimulatedJoin {
        SimulatedJoin { shared: self.shared.clone(), program: self.program }
    }

    /// A clock that is zero now.
    pub fn clock(&self) -> SimulatedClock {
        let start_us = self.shared.lock().wire.now_us();
        SimulatedClock { shared: self.shared.clone(), start_us }
    }

    fn check(&self, state: &SimulationState) -> Result<()> {
        if state.is_over {
            bail!("the simulation is over");
        }
        if state.programs[self.program].is_killed {
            bail!("the program was killed");
        }
        if state.is_dead(self.epoch) {
            bail!("{}: the server has closed the connection", self.description());
        }
        Ok(())
    }
}

impl CanBus for SimulatedPort {
    fn send(&mut self, frame: &Frame) -> Result<()> {
        let mut state = self.shared.lock();
        self.check(&state)?;
        state.wire.send(self.port, *frame);
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>> {
        let is_here = self.shared.lock().wire.has_arrived(self.port);
        if !is_here && !timeout.is_zero() {
            self.shared.wait(self.program, Some((self.port, self.epoch)), timeout);
        }
        let mut state = self.shared.lock();
        self.check(&state)?;
        Ok(state.wire.receive(self.port).map(|(_, frame)| frame))
    }

    fn description(&self) -> String {
        "simulated bus".into()
    }

    fn now(&self) -> Duration {
        self.shared.now()
    }
}

impl Drop for SimulatedPort {
    fn drop(&mut self) {
        // what it sent stays on the wire, what it would hear is nobody's
        self.shared.lock().wire.leave(self.port);
    }
}

impl Join for SimulatedJoin {
    fn join(&mut self) -> Result<Box<dyn CanBus>> {
        if !self.shared.lock().is_up {
            bail!("simulated bus: nobody listens");
        }
        Ok(Box::new(self.shared.connect(self.program)))
    }

    fn now(&self) -> Duration {
        self.shared.now()
    }

    fn wait(&mut self, time: Duration) {
        self.shared.wait(self.program, None, time);
        let state = self.shared.lock();
        let is_ended = state.is_over || state.programs[self.program].is_killed;
        drop(state);
        // a bus that reconnects never fails, so that nothing else would end its program
        assert!(!is_ended, "the program was killed without a bus");
    }
}

impl Clock for SimulatedClock {
    fn now_us(&self) -> u64 {
        self.shared.lock().wire.now_us() - self.start_us
    }
}
