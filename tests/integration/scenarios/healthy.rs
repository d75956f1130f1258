//! Healthy machines: bearings that wander, loads, restarts, loss of power. No flag may come of it.

use std::collections::BTreeMap;
use std::fmt;

use rotor_edge_core::state::Reason;

use super::dice::Dice;
use super::fault::Instrument;
use super::machine::{C, Condition, Machine, MachineKind, SLOWEST};
use super::monitor::{Monitor, Pace, claims_health};

const DAY_S: f64 = 86_400.0;
/// Logarithm of each bearing's stiffness and damping: random walk a day, and the days after which it is back.
const BEARING_WALK: f64 = 0.02;
const BEARING_DAYS: f64 = 10.0;
/// The same of the unbalance, size and angle.
const UNBALANCE_WALK: f64 = 0.01;
const UNBALANCE_DAYS: f64 = 10.0;
/// A load changes stiffness and damping of all bearings by this factor.
const LOAD: f64 = 1.15;
const SPEED_SD: f64 = 0.001;
const SPEED_STEP: f64 = 0.02;

/// How often something ordinary happens: probabilities a reading, and times in readings.
#[derive(Debug, Clone, Copy, Default)]
pub struct Routine {
    pub stops: f64,
    pub standstill: [usize; 2],
    pub run_up: [usize; 2],
    pub power_cycles: f64,
    pub load_steps: f64,
    /// The machine runs at several speeds.
    pub varies_speed: bool,
}

impl Routine {
    /// Of a machine that is read once a minute: a stop in three days, a load step a day, a power cycle in four days.
    pub const MONTH: Self = Self {
        stops: 1.0 / 4_320.0,
        standstill: [60, 360],
        run_up: [3, 5],
        power_cycles: 1.0 / 5_760.0,
        load_steps: 1.0 / 1_440.0,
        varies_speed: false,
    };

    /// The same read once an hour.
    pub const HOURLY_MONTH: Self = Self {
        stops: 1.0 / 72.0,
        standstill: [1, 6],
        run_up: [1, 2],
        power_cycles: 1.0 / 96.0,
        load_steps: 1.0 / 24.0,
        varies_speed: false,
    };

    /// More restarts than a machine has, at a pace of readings each second or faster.
    pub fn restarts(pace: Pace) -> Self {
        let in_readings = |s: f64| (s / pace.period_s) as usize;
        Self {
            stops: 1.0 / 1_500.0,
            standstill: [20.0, 120.0].map(in_readings),
            run_up: [40.0, 150.0].map(in_readings),
            power_cycles: 1.0 / 3_000.0,
            load_steps: 1.0 / 1_000.0,
            varies_speed: false,
        }
    }
}

/// What the monitor said of a healthy machine.
#[derive(Default)]
pub struct Health {
    pub title: String,
    /// Readings at speed, after the reference was taken.
    pub readings: usize,
    /// Those of them after which it did not say that all is well, by what it said.
    pub untracked: BTreeMap<String, usize>,
    pub false_flags: Vec<String>,
}

impl fmt::Display for Health {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let untracked: usize = self.untracked.values().sum();
        let share = 100.0 * untracked as f64 / self.readings.max(1) as f64;
        write!(f, "{}: {} readings, {untracked} ({share:.2} %) not tracking", self.title, self.readings)?;
        self.untracked.iter().try_for_each(|(said, number)| write!(f, ", {said} {number}"))?;
        write!(f, "; {} false flags", self.false_flags.len())?;
        self.false_flags.iter().try_for_each(|flag| write!(f, "\n    {flag}"))
    }
}

/// What the machine does at present; counts are readings left.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Doing {
    Running,
    Standing { left: usize, is_told: bool },
    RunningUp { left: usize, of: usize },
}

struct Life<'a> {
    machine: &'a Machine,
    pace: Pace,
    routine: Routine,
    dice: Dice,
    instrument: Instrument,
    resolution_um: f64,
    monitor: Monitor<'a>,
    time_s: f64,
    doing: Doing,
    load: f64,
    speed: f64,
    aims_at: f64,
    /// Logarithms of stiffness and damping, and of the unbalance.
    bearings: Vec<[f64; 2]>,
    unbalance: C,
    /// Readings at speed since the monitor was new.
    at_speed: usize,
    last_event: String,
    health: Health,
}

/// Lives through `readings` periods of a pace.
pub fn live(kind: MachineKind, pace: Pace, readings: usize, routine: Routine, seed: u64) -> Health {
    let mut dice = Dice::new(seed);
    let machine = Machine::draw(kind, &mut dice);
    let instrument = Instrument::new(machine.noise, vec![0.0; machine.probes()]);
    let title =
        format!("{}, {}{}", kind.name(), pace.name, if routine.varies_speed { ", speed varies" } else { "" });
    let mut life = Life {
        machine: &machine,
        pace,
        routine,
        instrument,
        resolution_um: dice.pick(&[1e-5, 0.001, 0.01, 0.05]),
        monitor: Monitor::new(&machine.deployment, pace),
        time_s: 0.0,
        doing: Doing::Running,
        load: 1.0,
        speed: 1.0,
        aims_at: 1.0,
        bearings: vec![[0.0; 2]; machine.healthy().bearings.len()],
        unbalance: C::from(0.0),
        at_speed: 0,
        last_event: "start".to_string(),
        health: Health { title, ..Health::default() },
        dice,
    };
    for _ in 0..readings {
        life.step();
    }
    life.health
}

impl Life<'_> {
    fn step(&mut self) {
        self.happen();
        self.wander();
        match self.doing {
            Doing::Running => self.read(self.speed),
            Doing::RunningUp { left, of } => self.read(1.0 - left as f64 / of as f64),
            Doing::Standing { is_told: true, .. } => self.monitor.take_standstill(self.time_s),
            Doing::Standing { .. } => self.monitor.poll(self.time_s),
        }
        self.judge();
        self.time_s += self.pace.period_s;
        self.doing = match self.doing {
            Doing::Standing { left: 0, .. } => {
                let [least, most] = self.routine.run_up;
                let of = self.dice.whole(least, most);
                self.event("run-up");
                Doing::RunningUp { left: of - 1, of }
            }
            Doing::Standing { left, is_told } => Doing::Standing { left: left - 1, is_told },
            Doing::RunningUp { left: 0, .. } | Doing::Running => Doing::Running,
            Doing::RunningUp { left, of } => Doing::RunningUp { left: left - 1, of },
        };
    }

    fn event(&mut self, what: &str) {
        self.last_event = format!("{what} at {:.0} s", self.time_s);
    }

    fn happen(&mut self) {
        if self.doing != Doing::Running || self.at_speed < self.pace.healthy {
            return;
        }
        let Routine { stops, standstill: [least, most], power_cycles, load_steps, .. } = self.routine;
        if self.dice.happens(stops) {
            let left = self.dice.whole(least, most);
            self.doing = Doing::Standing { left, is_told: self.dice.happens(0.5) };
            self.event("stop");
        } else if self.dice.happens(power_cycles) {
            self.monitor.cut_power(self.time_s);
            self.event("power cycle");
        } else if self.dice.happens(load_steps) {
            self.load = if self.load == 1.0 { LOAD } else { 1.0 };
            self.event("load step");
        }
    }

    /// Bearings and unbalance as an Ornstein–Uhlenbeck process; the speed as it is asked for.
    fn wander(&mut self) {
        let days = self.pace.period_s / DAY_S;
        let back = |days_back: f64| (-days / days_back).exp();
        for log in self.bearings.iter_mut().flatten() {
            *log = *log * back(BEARING_DAYS) + BEARING_WALK * days.sqrt() * self.dice.normal();
        }
        let pushed = self.dice.normals() * (UNBALANCE_WALK * days.sqrt());
        self.unbalance = self.unbalance * back(UNBALANCE_DAYS) + pushed;
        if self.routine.varies_speed {
            if self.dice.happens(0.01) {
                self.aims_at = self.dice.between(SLOWEST, 1.0);
            }
            self.speed += (self.aims_at - self.speed).clamp(-SPEED_STEP, SPEED_STEP);
        }
    }

    fn read(&mut self, relative_speed: f64) {
        let relative_speed = relative_speed * (1.0 + SPEED_SD * self.dice.normal());
        let speed_rpm = (relative_speed * self.machine.rated_rpm).max(1.0);
        let bearings = self.bearings.iter().map(|logs| logs.map(|log| self.load * log.exp())).collect();
        let shown = self.machine.shows(&Condition { speed_rpm, unbalance: self.unbalance.exp(), bearings });
        let mut measured = self.instrument.measure(speed_rpm, shown.as_slice(), &mut self.dice);
        measured.round(self.resolution_um);
        self.monitor.take(self.time_s, &measured);
    }

    fn judge(&mut self) {
        let status = self.monitor.status(self.time_s);
        if status.cause != Reason::None {
            let said = format!("at {:.0} s: {:?} after {}", self.time_s, status.cause, self.last_event);
            self.health.false_flags.push(said);
            self.monitor = Monitor::new(&self.machine.deployment, self.pace);
            self.monitor.cut_power(self.time_s + self.pace.period_s);
            self.at_speed = 0;
            return;
        }
        if self.doing != Doing::Running {
            return;
        }
        self.at_speed += 1;
        if self.at_speed > self.pace.healthy {
            self.health.readings += 1;
            if !claims_health(&status) {
                let said = format!("{:?}: {:?}", status.state, status.reason);
                *self.health.untracked.entry(said).or_default() += 1;
            }
        }
    }
}

/// Nobody is told of a fault that is not there.
#[track_caller]
pub fn assert_no_false_flag(all: &[Health]) {
    assert_false_flags_at_most(0, all);
}

/// For a life in which today's detection raises false flags: no more than these.
#[track_caller]
pub fn assert_false_flags_at_most(most: usize, all: &[Health]) {
    all.iter().for_each(|health| println!("{health}"));
    let flags: usize = all.iter().map(|health| health.false_flags.len()).sum();
    assert!(flags <= most, "{flags} false flags, at most {most}");
    assert!(all.iter().all(|health| health.readings > 0));
}

#[test]
fn healthy_days_and_restarts_raise_no_flag() {
    let month = live(MachineKind::Turbine, Pace::ALL[2], 2 * 1_440, Routine::MONTH, 3);
    let hours = live(MachineKind::Fan, Pace::ALL[1], 3_000, Routine::restarts(Pace::ALL[1]), 4);
    let daily = live(MachineKind::ThreeBearings, Pace::ALL[4], 1_000, Routine::default(), 5);
    assert_no_false_flag(&[month, hours, daily]);
}
