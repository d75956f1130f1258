//! One scenario from the first reading to the verdict.

use std::collections::VecDeque;

use nalgebra::DVector;

use super::catalogue::{Interlude, Kind, Plan, TrueChange};
use super::dice::Dice;
use super::fault::{Instrument, Measured};
use super::judge::{Judgement, Observation, WRONG, judge};
use super::machine::{C, Condition, Machine, MachineKind, SLOWEST, UnbalanceError};
use super::monitor::{Monitor, Pace, claims_health};

/// A steady machine's speed scatters by this part.
const SPEED_SD: f64 = 0.001;
/// The speed of a machine of variable speed changes by this part from reading to reading at most.
const SPEED_STEP: f64 = 0.02;
/// From standstill to the rated speed.
const RUN_UP_S: f64 = 60.0;

/// What came of a scenario.
pub struct Outcome {
    pub kind: &'static str,
    pub machine: MachineKind,
    pub pace: Pace,
    pub plan: Plan,
    /// The worst unbalance told while the fault lasted.
    pub worst: UnbalanceError,
    pub judgement: Judgement,
}

/// Plays a kind of scenario with what the seed draws.
pub fn play(kind: &Kind, pace: Pace, seed: u64) -> Outcome {
    let mut dice = Dice::new(seed);
    let machine_kind = kind.machine(&mut dice);
    let machine = Machine::draw(machine_kind, &mut dice);
    let plan = kind.draw(&mut dice, &machine, pace);
    let mut scene = Scene::new(&machine, plan, pace, dice.seed());
    for _ in 0..pace.healthy {
        scene.step(None);
    }
    scene.interlude();
    scene.begins_s = scene.begins_s.min(scene.time_s);
    for reading in 0..pace.faulty {
        scene.step(Some(reading));
    }
    scene.observe();
    let judgement = judge(&scene.observations(), pace.age_limit_s());
    Outcome { kind: kind.name, machine: machine.kind, pace, plan, worst: scene.worst, judgement }
}

struct Scene<'a> {
    machine: &'a Machine,
    plan: Plan,
    pace: Pace,
    dice: Dice,
    instrument: Instrument,
    monitor: Monitor<'a>,
    time_s: f64,
    begins_s: f64,
    /// Present speed and the one that the machine goes to, relative to the rated one.
    speed: f64,
    aims_at: f64,
    /// Readings within the time that the monitor averages over.
    averaged: VecDeque<(f64, Measured)>,
    observed: Vec<(f64, Observation)>,
    worst: UnbalanceError,
    is_wrong: bool,
}

impl<'a> Scene<'a> {
    fn new(machine: &'a Machine, plan: Plan, pace: Pace, seed: u64) -> Self {
        let healthy = machine.shows(&machine.healthy());
        Self {
            machine,
            plan,
            pace,
            dice: Dice::new(seed),
            instrument: Instrument::new(machine.noise, healthy.iter().map(|y| y.norm()).collect()),
            monitor: Monitor::new(&machine.deployment, pace),
            time_s: 0.0,
            begins_s: f64::INFINITY,
            speed: 1.0,
            aims_at: 1.0,
            averaged: VecDeque::new(),
            observed: Vec::new(),
            worst: UnbalanceError::default(),
            is_wrong: false,
        }
    }

    /// One reading, `fault` readings after the fault began; and the time to the next.
    fn step(&mut self, fault: Option<usize>) {
        self.turn();
        let running = self.speed * (1.0 + SPEED_SD * self.dice.normal());
        self.read(running, fault);
    }

    fn read(&mut self, relative_speed: f64, fault: Option<usize>) {
        let unbalance = self.plan.change.map_or(C::from(1.0), |change| change.unbalance(fault));
        let speed_rpm = relative_speed * self.machine.rated_rpm;
        let condition = Condition { speed_rpm, unbalance, ..self.machine.healthy() };
        let shown = self.machine.shows(&condition);
        let mut measured = self.instrument.measure(speed_rpm, shown.as_slice(), &mut self.dice);
        let strength = fault.map_or(0.0, |reading| self.plan.course.strength(reading, &mut self.dice));
        if strength > 0.0 {
            self.instrument.spoil(self.plan.fault, strength, &mut measured, &mut self.dice);
        } else {
            self.instrument.remember(&measured);
        }
        if let Some(step_um) = self.plan.resolution_um {
            measured.round(step_um);
        }
        self.monitor.take(self.time_s, &measured);
        self.look_at_unbalance(&measured, &(&self.machine.unbalance_kg_m * unbalance), fault.is_some());
        self.wait(self.pace.period_s);
    }

    /// Lets the machine of variable speed go where it goes.
    fn turn(&mut self) {
        if !self.plan.varies_speed {
            return;
        }
        if self.dice.happens(0.03) {
            self.aims_at = self.dice.between(SLOWEST, 1.0);
        }
        self.speed += (self.aims_at - self.speed).clamp(-SPEED_STEP, SPEED_STEP);
    }

    fn wait(&mut self, seconds: f64) {
        self.observe();
        self.time_s += seconds;
        // just before the next reading
        self.monitor.poll(self.time_s - 1e-5);
        self.observe_at(self.time_s - 1e-5);
    }

    fn observe(&mut self) {
        self.observe_at(self.time_s);
    }

    fn observe_at(&mut self, time_s: f64) {
        let status = self.monitor.status(time_s);
        self.observed.push((time_s, Observation { since_s: 0.0, is_wrong: self.is_wrong, status }));
    }

    /// Compares what the monitor told with the truth. Under a fault of all probes, what the readings say without any bound
    /// counts as well, unless the monitor says at once that it does not believe them.
    fn look_at_unbalance(&mut self, measured: &Measured, truth: &DVector<C>, is_faulty: bool) {
        let error = self.monitor.unbalance_kg_m().map(|found| UnbalanceError::of(&found, truth));
        self.is_wrong = error.is_some_and(|error| error.exceeds(WRONG));
        if !is_faulty {
            return;
        }
        self.worst = error.map_or(self.worst, |error| self.worst.or_worse(error));
        if self.plan.fault.is_common() {
            let free = self.free_fit(measured);
            let is_believed = claims_health(&self.monitor.status(self.time_s));
            self.is_wrong |=
                is_believed && free.is_some_and(|u| UnbalanceError::of(&u, truth).exceeds(WRONG));
        }
    }

    /// The unbalance that fits the mean of the readings of the monitor's averaging time.
    fn free_fit(&mut self, measured: &Measured) -> Option<DVector<C>> {
        let average_s = f64::from(self.pace.thresholds().average_s);
        self.averaged.push_back((self.time_s, measured.clone()));
        while self.averaged.front().is_some_and(|(time_s, _)| self.time_s - time_s > average_s) {
            self.averaged.pop_front();
        }
        let readings: Vec<DVector<C>> =
            self.averaged.iter().filter_map(|(_, reading)| reading.phasors()).collect();
        let mean = readings.iter().sum::<DVector<C>>() / C::from(readings.len() as f64);
        let is_speed = measured.speed_rpm > 0.05 * self.machine.rated_rpm;
        (is_speed && !readings.is_empty()).then(|| self.machine.fit(measured.speed_rpm, &mean))
    }

    fn interlude(&mut self) {
        let Some(pause_s) = self.plan.pause_s else { return };
        match self.plan.interlude {
            Interlude::None => {}
            Interlude::PowerOff => {
                self.time_s += pause_s;
                self.monitor.cut_power(self.time_s);
            }
            Interlude::Silence => {
                self.time_s += pause_s;
                self.monitor.poll(self.time_s);
            }
            Interlude::Standstill => {
                let ends_s = self.time_s + pause_s;
                while self.time_s < ends_s {
                    self.monitor.take_standstill(self.time_s);
                    self.time_s += self.pace.period_s;
                }
                self.begins_s = self.time_s;
                let run_up = (RUN_UP_S / self.pace.period_s) as usize;
                for step in 1..run_up {
                    self.read(step as f64 / run_up as f64, Some(0));
                }
            }
        }
    }

    /// All that was seen, by the time since the fault began; what an interlude shows is neither before nor under the fault.
    fn observations(&self) -> Vec<Observation> {
        let since = |(time_s, o): &(f64, Observation)| Observation { since_s: time_s - self.begins_s, ..*o };
        self.observed.iter().map(since).collect()
    }
}

impl TrueChange {
    /// True unbalance over that before, so many readings after the fault began.
    fn unbalance(self, fault: Option<usize>) -> C {
        let since = fault.map_or(0.0, |reading| reading as f64 - self.after as f64);
        let part = (since / self.over as f64).clamp(0.0, 1.0);
        C::from_polar(self.factor.powf(part), part * self.turn_deg.to_radians())
    }
}

impl Measured {
    pub fn round(&mut self, step_um: f64) {
        let step_m = step_um * 1e-6;
        let to_step = |value: f64| (value / step_m).round() * step_m;
        for y in self.probes.iter_mut().flatten() {
            *y = C::new(to_step(y.re), to_step(y.im));
        }
    }

    fn phasors(&self) -> Option<DVector<C>> {
        let probes: Option<Vec<C>> = self.probes.iter().copied().collect();
        probes.map(DVector::from_vec)
    }
}
