//! Long records whose truth is known, made on the full finite-element model: tracking itself works on shape
//! functions and on bearings by update, so that neither is checked by itself.

use std::f64::consts::TAU;
use std::path::Path;

use nalgebra::{Complex, DVector};
use rotor_edge_desktop::bearing::law::{BearingLaw, PRIOR_LOG_SD};
use rotor_edge_desktop::machine::drawing::{AddedUnbalance, EffectEntry, ParameterValue, Plane, Rotor, Run};
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::unbalance::g_mm_deg;
use rotor_edge_desktop::units::rad_s;

use super::random::{Moment, Random};

type C = Complex<f64>;

/// Scatter of a machine's bearings about its file's, as logarithms.
const BEARINGS_SD: f64 = 0.15;
/// Daily scatter of the unbalance's logarithm (rad of its angle).
const DRIFT_SD: f64 = 0.0035;
const ANGLE_SD: f64 = 0.006;
/// Share of days without a reading.
const MISSING: f64 = 0.02;
/// Offset of the seeds of what an overhaul draws.
const OVERHAULED: u64 = 10_000;
/// Offset of the seeds of what the oil's temperature draws, its usual value, and the error of its column.
const WARMTH: u64 = 30_000;
pub const USUAL_DEGC: f64 = 45.0;
const THERMOMETER_SD: f64 = 0.3;
/// Speeds of a run-up.
const RUNUP_SPEEDS: usize = 51;

/// What happens on one day and stays.
#[derive(Debug, Clone, Copy)]
pub enum Change {
    /// Factors on stiffness and damping of a bearing, along x and y.
    Bearing { index: usize, stiffness: [f64; 2], damping: [f64; 2] },
    /// A seal at a disk begins to act: direct and cross-coupled stiffness as a share of a bearing's.
    Seal { disk: usize, direct: f64, cross: f64 },
    /// A plane's unbalance is multiplied.
    Jump { plane: usize, factor: C },
    /// The shaft bends, m.
    Bow { height_m: f64 },
    /// The machine comes back from an outage of so many days with other bearings, and with these sizes in its planes, g·mm, at
    /// other angles.
    Overhaul { outage_days: usize, sizes_g_mm: [f64; 2] },
    /// A probe shows so many times the motion.
    Gain { probe: usize, factor: f64 },
    /// The phase reference is turned.
    PhaseReference { turn_deg: f64 },
}

/// A machine that records are made for.
#[derive(Debug, Clone, Copy)]
pub struct Machine {
    pub name: &'static str,
    file: &'static str,
    speed_rpm: f64,
    /// Smallest unbalance of a plane at the start, g·mm; the largest is two thirds more.
    size_g_mm: f64,
}

pub const TURBINE: Machine =
    Machine { name: "turbine", file: "records/rotor.toml", speed_rpm: 11_000.0, size_g_mm: 300.0 };
pub const COMPRESSOR: Machine = Machine {
    name: "compressor",
    file: "machines/single/case-015/rotor.toml",
    speed_rpm: 9_000.0,
    size_g_mm: 600.0,
};
pub const PUMP: Machine = Machine {
    name: "pump",
    file: "machines/single/case-013/rotor.toml",
    speed_rpm: 6_500.0,
    size_g_mm: 400.0,
};

/// A turbine and a generator on two bearings each.
pub const TURBINE_GENERATOR: Machine = Machine {
    name: "generator",
    file: "records/turbine_generator/rotor.toml",
    speed_rpm: 6_000.0,
    size_g_mm: 600.0,
};
/// A turbine on two bearings, with a fan and a third one.
pub const FAN_TRAIN: Machine = Machine {
    name: "fan train",
    file: "records/three_bearings/rotor.toml",
    speed_rpm: 8_000.0,
    size_g_mm: 400.0,
};
/// An impeller on a shaft with one bearing.
pub const OVERHUNG: Machine =
    Machine { name: "overhung", file: "records/overhung/rotor.toml", speed_rpm: 6_000.0, size_g_mm: 300.0 };
/// A turbine on oil films.
pub const ON_FILMS: Machine =
    Machine { name: "on films", file: "records/film/rotor.toml", speed_rpm: 9_000.0, size_g_mm: 300.0 };

/// How the second plane's unbalance goes along.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Course {
    /// As the first's: it grows and drifts.
    Grows,
    /// In a straight line through zero to the other side.
    ThroughZero,
    /// A hundredth of what it would be.
    AlmostNothing,
}

/// When readings are taken, and at what speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Schedule {
    /// Once a day at one speed.
    Daily,
    /// From twenty minutes to three days apart.
    Irregular,
    /// As the load asks: for some days at a time at one of three speeds, and at two on the day of a change.
    Speeds,
    /// With stops of some days to some weeks.
    Stops,
}

/// Where the machine has unbalance, and its file planes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Planes {
    /// In the two that its file states.
    Stated,
    /// In the first of them.
    First,
    /// In a third as well, at this share of the shaft's length.
    Further(f64),
}

/// What a record is made by.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    pub machine: Machine,
    pub seed: u64,
    pub days: usize,
    /// Standard deviation of each bearing's wander, as a logarithm; in turn, of more than two bearings.
    pub wander: [f64; 2],
    /// Every coefficient wanders by itself, and not along one load and temperature.
    pub apart: bool,
    /// Growth of the unbalance's logarithm from the first day to the last is drawn up to this.
    pub growth: f64,
    pub course: Course,
    pub event: Option<(usize, Change)>,
    pub schedule: Schedule,
    /// Share of a probe's readings that are lost.
    pub lost: f64,
    /// A weight is set into a plane on a day, kg·m, and the rotor's file says so.
    pub shot: Option<(usize, usize, C)>,
    pub planes: Planes,
    /// The record has the oil's temperature; the stiffness of each bearing changes by this logarithm for 10 °C, and its
    /// damping by a third more.
    pub heat: Option<[f64; 2]>,
}

impl Plan {
    /// Nothing happens; bearings wander by a tenth.
    pub fn quiet(machine: Machine, seed: u64) -> Self {
        Self {
            machine,
            seed,
            days: 460,
            wander: [0.11, 0.085],
            apart: false,
            growth: 0.6,
            course: Course::Grows,
            event: None,
            schedule: Schedule::Daily,
            lost: 0.0,
            shot: None,
            planes: Planes::Stated,
            heat: None,
        }
    }
}

/// A record, its run-ups, and the truth.
pub struct Record {
    pub rotor: Rotor,
    pub readings: Vec<Reading>,
    pub runup: Vec<Reading>,
    /// Of the day after the event, and that day.
    pub later: Option<(f64, Vec<Reading>)>,
    /// Unbalance of each plane at each reading, kg·m.
    pub unbalance_kg_m: Vec<Vec<C>>,
}

/// One bearing over the record: its own constants, and how each axis follows the load and the temperature.
#[derive(Default)]
struct Bearing {
    stiffness: [f64; 2],
    damping: [f64; 2],
    /// The file's constants, k_xx k_yy c_xx c_yy.
    made: [f64; 4],
    /// Of each coefficient (k_xx k_yy c_xx c_yy): all the same, unless they wander apart.
    wander: [Vec<f64>; 4],
    /// Change of each logarithm per unit of its wander.
    along: [f64; 4],
    /// Change of the stiffness's logarithm at each moment by the temperature.
    heat: Vec<f64>,
    /// Logarithms of the numbers of a law other than constants, at each moment.
    numbers: Option<Vec<Vec<f64>>>,
}

impl Plan {
    pub fn make(&self) -> Record {
        let mut random = Random::new(self.seed);
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests").join(self.machine.file);
        let mut rotor = rotor_file::read(&path).unwrap();
        match self.planes {
            Planes::Stated => {}
            Planes::First => rotor.plane.truncate(1),
            Planes::Further(share) => {
                let (name, position_m) = (format!("at {share}"), share * rotor.length_m());
                rotor.plane.push(Plane { name, position_m, ..rotor.plane[0].clone() });
            }
        }
        let moments = random.moments(self);
        let mut bearings: Vec<Bearing> =
            (0..rotor.bearing.len()).map(|b| self.bearing(&rotor, b, &moments, &mut random)).collect();
        let mut warmth = Random::new(self.seed + WARMTH);
        let oil_degc = warmth.temperature(&moments);
        for (bearing, per_ten) in bearings.iter_mut().zip(self.heat.unwrap_or_default()) {
            bearing.heat = oil_degc.iter().map(|t| per_ten * (t - USUAL_DEGC) / 10.0).collect();
        }
        let mut planes: Vec<Vec<C>> = rotor.plane.iter().map(|_| self.plane(&mut random)).collect();
        for (day, u) in planes.iter_mut().skip(1).take(1).flatten().enumerate() {
            *u *= match self.course {
                Course::Grows => 1.0,
                Course::ThroughZero => 1.0 - 2.0 * day as f64 / self.days as f64,
                Course::AlmostNothing => 0.01,
            };
        }
        // between two days the drift goes straight on
        let drifted = |u: &[C], time_d: f64| {
            let day = (time_d as usize).min(self.days - 1);
            u[day] + (u[(day + 1).min(self.days - 1)] - u[day]) * time_d.fract()
        };
        let new_rad: Vec<f64> = {
            let mut random = Random::new(self.seed + OVERHAULED);
            rotor.plane.iter().map(|_| TAU * random.uniform()).collect()
        };
        let jump = |plane: usize, time_d: f64| match self.event {
            Some((from, Change::Jump { plane: p, factor })) if p == plane && time_d >= from as f64 => factor,
            Some((from, Change::Overhaul { sizes_g_mm, .. })) if time_d >= from as f64 => {
                C::from_polar(sizes_g_mm[plane] * 1e-6, new_rad[plane]) / planes[plane][from]
            }
            _ => C::from(1.0),
        };
        let factor = |probe: usize, time_d: f64| match self.event {
            Some((from, _)) if time_d < from as f64 => C::from(1.0),
            Some((_, Change::Gain { probe: p, factor })) if p == probe => C::from(factor),
            Some((_, Change::PhaseReference { turn_deg })) => C::from_polar(1.0, turn_deg.to_radians()),
            _ => C::from(1.0),
        };
        let stands = |time_d: f64| match self.event {
            Some((from, Change::Overhaul { outage_days, .. })) => {
                (from.saturating_sub(outage_days) as f64..from as f64).contains(&time_d)
            }
            _ => false,
        };
        let shot = |plane: usize, time_d: f64| match self.shot {
            Some((from, p, weight)) if p == plane && time_d >= from as f64 => weight,
            _ => C::from(0.0),
        };
        let unbalance_at = |time_d: f64| -> Vec<C> {
            let of = |(j, u): (usize, &Vec<C>)| drifted(u, time_d) * jump(j, time_d) + shot(j, time_d);
            planes.iter().enumerate().map(of).collect()
        };
        let (mut readings, mut unbalance_kg_m) = (Vec::new(), Vec::new());
        for (k, moment) in moments.iter().enumerate() {
            if random.uniform() < MISSING || stands(moment.time_d) {
                continue;
            }
            let speed_rpm = self.machine.speed_rpm * moment.speed * (1.0 + 0.0023 * random.normal());
            let machine = Model::finite_elements(&self.state(&rotor, &bearings, k, moment.time_d));
            let unbalance = unbalance_at(moment.time_d);
            let mut probes = measured(&machine, &rotor, speed_rpm, &unbalance, &mut random);
            probes.iter_mut().enumerate().for_each(|(p, y)| *y = y.map(|y| y * factor(p, moment.time_d)));
            if self.lost > 0.0 {
                probes.iter_mut().filter(|_| random.uniform() < self.lost).for_each(|y| *y = None);
            }
            let run = self.shot.map(|(from, ..)| run_name(moment.time_d >= from as f64).into());
            let shown_degc = oil_degc[k] + THERMOMETER_SD * warmth.normal();
            readings.push(Reading {
                run,
                conditions: if self.heat.is_some() { vec![Some(shown_degc)] } else { vec![] },
                time_d: Some(moment.time_d),
                speed_rpm,
                probes,
                ..Reading::default()
            });
            unbalance_kg_m.push(unbalance);
        }
        let mut runup = |day: usize| -> Vec<Reading> {
            let k = moments.iter().position(|m| m.time_d >= day as f64).unwrap();
            let machine = Model::finite_elements(&self.state(&rotor, &bearings, k, day as f64));
            let speed =
                |i: usize| self.machine.speed_rpm * (0.15 + 0.9 * i as f64 / (RUNUP_SPEEDS - 1) as f64);
            let unbalance = unbalance_at(day as f64);
            let run = if self.shot.is_some() { run_name(false).into() } else { format!("day {day}") };
            (0..RUNUP_SPEEDS)
                .map(|i| Reading {
                    run: Some(run.clone()),
                    speed_rpm: speed(i),
                    probes: measured(&machine, &rotor, speed(i), &unbalance, &mut random),
                    ..Reading::default()
                })
                .collect()
        };
        let (first, later) = (runup(0), self.event.map(|(day, _)| ((day + 1) as f64, runup(day + 1))));
        if let Some((_, plane, weight)) = self.shot {
            let [magnitude_g_mm, angle_deg] = g_mm_deg(weight);
            let position_m = rotor.plane[plane].position_m;
            let weights = [vec![], vec![AddedUnbalance { position_m, magnitude_g_mm, angle_deg }]];
            rotor.run = [false, true]
                .into_iter()
                .zip(weights)
                .map(|(after, added_unbalance)| Run {
                    name: run_name(after).into(),
                    added_unbalance,
                    slow_roll: false,
                })
                .collect();
        }
        Record { rotor, readings, runup: first, later, unbalance_kg_m }
    }

    fn bearing(&self, rotor: &Rotor, index: usize, moments: &[Moment], random: &mut Random) -> Bearing {
        let law = rotor.bearing[index].law.as_law();
        let Some(own) = rotor.bearing[index].constants() else {
            return Bearing {
                numbers: Some(self.numbers(law, index, moments, random)),
                ..Bearing::default()
            };
        };
        let made = [own.stiffness_n_m.xx, own.stiffness_n_m.yy, own.damping_n_s_m.xx, own.damping_n_s_m.yy];
        let mut scattered = |c: [f64; 2]| c.map(|c| c * (BEARINGS_SD * random.normal()).exp());
        let stiffness = scattered([own.stiffness_n_m.xx, own.stiffness_n_m.yy]);
        let damping = scattered([own.damping_n_s_m.xx, own.damping_n_s_m.yy]);
        let along = [
            random.between(0.8, 1.2),
            random.between(0.8, 1.2),
            -random.between(0.7, 1.5),
            -random.between(0.7, 1.5),
        ];
        let common = random.wander(moments, self.wander[index % 2]);
        let own = |k| match self.apart && k > 0 {
            true => random.wander(moments, self.wander[index % 2]),
            false => common.clone(),
        };
        let heat = vec![0.0; moments.len()];
        Bearing { stiffness, damping, made, wander: [0, 1, 2, 3].map(own), along, heat, numbers: None }
    }

    /// Logarithms of a law's numbers at each moment: scattered about the stated ones and following one wander, each the less the
    /// better it is known.
    fn numbers(
        &self,
        law: &dyn BearingLaw,
        index: usize,
        moments: &[Moment],
        random: &mut Random,
    ) -> Vec<Vec<f64>> {
        let common = random.wander(moments, self.wander[index % 2]);
        let mut paths = Vec::new();
        for unknown in law.unknowns() {
            let width = unknown.prior_sd / PRIOR_LOG_SD;
            let start = unknown.stated + BEARINGS_SD * width * random.normal();
            let along = width * random.between(-2.0, 2.0);
            paths.push(common.iter().map(|w| start + along * w).collect::<Vec<f64>>());
        }
        (0..moments.len()).map(|k| paths.iter().map(|path| path[k]).collect()).collect()
    }

    fn plane(&self, random: &mut Random) -> Vec<C> {
        let size = self.machine.size_g_mm * random.between(1.0, 5.0 / 3.0) * 1e-6;
        let (start_rad, growth) = (TAU * random.uniform(), random.between(self.growth / 6.0, self.growth));
        let logs = random.drift(self.days, DRIFT_SD);
        let angles = random.drift(self.days, ANGLE_SD);
        let of_day = |(day, (log, angle)): (usize, (&f64, &f64))| {
            let grown = log + growth * day as f64 / self.days as f64;
            C::from_polar(size * grown.exp(), start_rad + angle)
        };
        logs.iter().zip(&angles).enumerate().map(of_day).collect()
    }

    /// The machine at the `k`th moment, which is at this time.
    fn state(&self, rotor: &Rotor, bearings: &[Bearing], k: usize, time_d: f64) -> Rotor {
        let mut rotor = rotor.clone();
        for (i, b) in bearings.iter().enumerate() {
            if let Some(numbers) = &b.numbers {
                rotor.bearing[i].law.as_law_mut().assign(&numbers[k]);
                continue;
            }
            let law = rotor.bearing[i].constants_mut().unwrap();
            let heated = |i: usize| if i < 2 { b.heat[k] } else { 4.0 / 3.0 * b.heat[k] };
            let [kx, ky, cx, cy] = std::array::from_fn(|i| (b.along[i] * b.wander[i][k] + heated(i)).exp());
            (law.stiffness_n_m.xx, law.stiffness_n_m.yy) = (b.stiffness[0] * kx, b.stiffness[1] * ky);
            (law.damping_n_s_m.xx, law.damping_n_s_m.yy) = (b.damping[0] * cx, b.damping[1] * cy);
        }
        match self.event {
            Some((from, change)) if time_d >= from as f64 => apply(change, &mut rotor, bearings, self.seed),
            _ => {}
        }
        rotor
    }
}

/// Name of the runs before and after a weight was set.
fn run_name(after: bool) -> &'static str {
    if after { "balanced" } else { "as found" }
}

fn apply(change: Change, rotor: &mut Rotor, bearings: &[Bearing], seed: u64) {
    match change {
        Change::Bearing { index, stiffness, damping } => {
            let law = rotor.bearing[index].constants_mut().unwrap();
            law.stiffness_n_m.xx *= stiffness[0];
            law.stiffness_n_m.yy *= stiffness[1];
            law.damping_n_s_m.xx *= damping[0];
            law.damping_n_s_m.yy *= damping[1];
        }
        Change::Seal { disk, direct, cross } => {
            let (k, c) = (bearings[1].stiffness[0], bearings[1].damping[0]);
            let parameters = [("k", direct * k), ("q", cross * k), ("c", direct * c)];
            rotor.effect.push(EffectEntry {
                kind: "seal".into(),
                at: Some(rotor.disk[disk].name.clone()),
                parameters: parameters.map(|(name, v)| (name.into(), ParameterValue::Real(v))).into(),
            });
        }
        Change::Bow { height_m } => rotor.effect.push(EffectEntry {
            kind: "shaft_bow".into(),
            at: None,
            parameters: [("m".into(), ParameterValue::Phasor([height_m, 0.3 * height_m]))].into(),
        }),
        Change::Overhaul { .. } => {
            // others of the same make: what was scattered about the file's is scattered anew
            let mut random = Random::new(seed + 2 * OVERHAULED);
            for (bearing, old) in rotor.bearing.iter_mut().zip(bearings) {
                let law = bearing.constants_mut().unwrap();
                let mut anew = |old: f64, made: f64| made / old * (BEARINGS_SD * random.normal()).exp();
                law.stiffness_n_m.xx *= anew(old.stiffness[0], old.made[0]);
                law.stiffness_n_m.yy *= anew(old.stiffness[1], old.made[1]);
                law.damping_n_s_m.xx *= anew(old.damping[0], old.made[2]);
                law.damping_n_s_m.yy *= anew(old.damping[1], old.made[3]);
            }
        }
        Change::Jump { .. } | Change::Gain { .. } | Change::PhaseReference { .. } => {}
    }
}

/// What the probes show at a speed, with the noise that the rotor's file states.
fn measured(
    machine: &Model,
    rotor: &Rotor,
    speed_rpm: f64,
    unbalance_kg_m: &[C],
    random: &mut Random,
) -> Vec<Option<C>> {
    let noise = rotor.noise.unwrap();
    let shown = machine.response(rad_s(speed_rpm)).unwrap().at(&DVector::from_row_slice(unbalance_kg_m));
    let disturbed = |y: &C| {
        let sd_m = noise.sigma_m(*y);
        Some(y + C::new(random.normal(), random.normal()) * sd_m)
    };
    shown.iter().map(disturbed).collect()
}
