//! Machines whose truth is known, each with a model that is wrong by ordinary amounts.

use nalgebra::{Complex, DMatrix, DVector};
use rotor_edge::edge::Deployment;
use rotor_edge::sample;
use rotor_edge_desktop::bearing::support::SupportLaw;
use rotor_edge_desktop::machine::drawing::{Noise, Rotor};
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::unbalance::G_MM;
use rotor_edge_desktop::units::rad_s;

use super::dice::Dice;

pub type C = Complex<f64>;

/// Standard deviation of the logarithm of each true bearing coefficient about the model's.
const BEARING_LOG_SD: f64 = 0.05;
/// A machine whose model is further off than this before any fault was never identified.
const ERROR_TO_BEGIN_WITH: UnbalanceError = UnbalanceError { size: 0.12, angle_deg: 8.0 };
/// Misfit over the vibration, without noise, that an identified model leaves at most.
const MISFIT_TO_BEGIN_WITH: f64 = 0.05;
/// The slowest speed that a machine of variable speed runs at, relative to the rated one.
pub const SLOWEST: f64 = 0.7;

/// One rotor with the speed and the unbalance that it has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MachineKind {
    /// The sample: two bearings, four probes, two planes.
    Turbine,
    /// An overhung fan with two probes at one bearing, and one plane.
    Fan,
    /// Three bearings, six probes, two planes.
    ThreeBearings,
}

impl MachineKind {
    pub const ALL: [Self; 3] = [Self::Turbine, Self::Fan, Self::ThreeBearings];

    pub fn name(self) -> &'static str {
        match self {
            Self::Turbine => "turbine",
            Self::Fan => "fan",
            Self::ThreeBearings => "three bearings",
        }
    }

    fn rotor(self) -> Rotor {
        let parse = |text| rotor_file::parse("a scenario's rotor", text).unwrap();
        match self {
            Self::Turbine => sample::load().unwrap().0,
            Self::Fan => parse(include_str!("fan.toml")),
            Self::ThreeBearings => parse(include_str!("three-bearings.toml")),
        }
    }

    fn rated_rpm(self) -> f64 {
        match self {
            Self::Turbine => 11_000.0,
            Self::Fan => 2_200.0,
            Self::ThreeBearings => 3_600.0,
        }
    }

    /// Ordinary size of a plane's unbalance, g·mm.
    fn unbalance_g_mm(self) -> f64 {
        match self {
            Self::Turbine => 900.0,
            Self::Fan => 4_000.0,
            Self::ThreeBearings => 6_000.0,
        }
    }
}

/// How far an unbalance is off: its size relative to the true one, and its angle; the worst of all planes in each.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct UnbalanceError {
    pub size: f64,
    pub angle_deg: f64,
}

impl UnbalanceError {
    pub fn of(found: &DVector<C>, truth: &DVector<C>) -> Self {
        let of_plane = |(found, truth): (&C, &C)| {
            let ratio = found / truth;
            // the angle of nothing is no angle
            let angle_deg = if ratio.norm() < 1e-3 { 180.0 } else { ratio.arg().to_degrees().abs() };
            Self { size: (ratio.norm() - 1.0).abs(), angle_deg }
        };
        found.iter().zip(truth).map(of_plane).fold(Self::default(), Self::or_worse)
    }

    pub fn or_worse(self, other: Self) -> Self {
        Self { size: self.size.max(other.size), angle_deg: self.angle_deg.max(other.angle_deg) }
    }

    /// Beyond another one in either.
    pub fn exceeds(self, limit: Self) -> bool {
        self.size > limit.size || self.angle_deg > limit.angle_deg
    }
}

/// What the machine does at one instant.
#[derive(Debug, Clone)]
pub struct Condition {
    pub speed_rpm: f64,
    /// True unbalance over that of the day of deployment, one phasor for all planes.
    pub unbalance: C,
    /// Stiffness and damping over those of the day of deployment, one pair a bearing.
    pub bearings: Vec<[f64; 2]>,
}

/// A machine and its monitor's model.
pub struct Machine {
    pub kind: MachineKind,
    pub rated_rpm: f64,
    pub noise: Noise,
    pub deployment: Deployment,
    /// True unbalance of the day of deployment, kg·m.
    pub unbalance_kg_m: DVector<C>,
    truth: Model,
    /// Its bearings on the day of deployment.
    bearings: Vec<SupportLaw>,
}

impl Machine {
    /// Draws bearings and unbalances until the model is good enough to have been deployed at these speeds.
    pub fn draw(kind: MachineKind, dice: &mut Dice) -> Self {
        for _ in 0..100 {
            let machine = Self::any(kind, dice);
            if [SLOWEST, 0.8, 0.9, 1.0].into_iter().all(|part| machine.is_described_at(part)) {
                return machine;
            }
        }
        panic!("no {} has a model that is good enough", kind.name());
    }

    /// The model is as good at this part of the rated speed as one that was deployed.
    fn is_described_at(&self, part: f64) -> bool {
        let condition = Condition { speed_rpm: part * self.rated_rpm, ..self.healthy() };
        let shown = self.shows(&condition);
        let found = self.fit(condition.speed_rpm, &shown);
        let response = self.deployment.desktop.response(rad_s(condition.speed_rpm)).unwrap();
        let features = |phasors: &DVector<C>| phasors.iter().map(|y| y.re.abs() + y.im.abs()).sum::<f64>();
        let misfit = features(&(response.at(&found) - &shown)) / features(&shown);
        let error = UnbalanceError::of(&found, &self.unbalance_kg_m);
        misfit <= MISFIT_TO_BEGIN_WITH && !error.exceeds(ERROR_TO_BEGIN_WITH)
    }

    fn any(kind: MachineKind, dice: &mut Dice) -> Self {
        let mut rotor = kind.rotor();
        let rated_rpm = kind.rated_rpm();
        let mut truth = Model::finite_elements(&rotor);
        for support in &mut truth.supports {
            let law = &mut support.law;
            for coefficient in law.stiffness_n_m.iter_mut().chain(law.damping_n_s_m.iter_mut()) {
                *coefficient *= (BEARING_LOG_SD * dice.normal()).exp();
            }
        }
        let unbalance_kg_m = DVector::from_fn(rotor.plane.len(), |_, _| {
            C::from_polar(kind.unbalance_g_mm() / G_MM * dice.factor(0.6, 1.6), dice.angle())
        });
        let deployment = |rotor: &Rotor| Deployment::new(rotor, rated_rpm).unwrap();
        let mut machine = Self {
            kind,
            rated_rpm,
            noise: rotor.noise.unwrap(),
            deployment: deployment(&rotor),
            unbalance_kg_m,
            bearings: truth.supports.iter().map(|s| s.law.clone()).collect(),
            truth,
        };
        // as identified on the first day
        let found = machine.fit(rated_rpm, &machine.shows(&machine.healthy()));
        for (plane, found) in rotor.plane.iter_mut().zip(&found) {
            plane.unbalance_g_mm = Some(found.norm() * G_MM);
            plane.angle_deg = Some(found.arg().to_degrees());
        }
        machine.deployment = deployment(&rotor);
        machine
    }

    /// At the rated speed, as on the day of deployment.
    pub fn healthy(&self) -> Condition {
        let bearings = vec![[1.0; 2]; self.bearings.len()];
        Condition { speed_rpm: self.rated_rpm, unbalance: C::from(1.0), bearings }
    }

    /// Phasor at each probe without any noise, m.
    pub fn shows(&self, condition: &Condition) -> DVector<C> {
        let unbalance = &self.unbalance_kg_m * condition.unbalance;
        let speed = rad_s(condition.speed_rpm);
        if condition.bearings.iter().flatten().all(|factor| *factor == 1.0) {
            return self.truth.response(speed).unwrap().at(&unbalance);
        }
        let mut changed = self.truth.clone();
        for ((support, law), [stiffness, damping]) in
            changed.supports.iter_mut().zip(&self.bearings).zip(&condition.bearings)
        {
            support.law.stiffness_n_m = law.stiffness_n_m * *stiffness;
            support.law.damping_n_s_m = law.damping_n_s_m * *damping;
        }
        changed.response(speed).unwrap().at(&unbalance)
    }

    /// Unbalance that fits phasors best by least squares under the deployed model, without any bound, kg·m.
    pub fn fit(&self, speed_rpm: f64, shown_m: &DVector<C>) -> DVector<C> {
        let response = self.deployment.desktop.response(rad_s(speed_rpm)).unwrap();
        let per_unbalance: &DMatrix<C> = &response.per_unbalance;
        let normal = per_unbalance.adjoint() * per_unbalance;
        let right = per_unbalance.adjoint() * (shown_m - &response.fixed);
        normal.lu().solve(&right).expect("planes that the probes can tell apart")
    }

    /// Index of the probes at each bearing, in the order of the model's bearings; bearings without probes are left out.
    pub fn probes_by_bearing(&self) -> Vec<Vec<usize>> {
        let edge = self.deployment.edge.description();
        let at =
            |bearing: u8| (0..edge.probes.len()).filter(|k| edge.probes[*k].bearing == bearing).collect();
        (0..edge.supports.len() as u8).map(at).filter(|probes: &Vec<usize>| !probes.is_empty()).collect()
    }

    pub fn probes(&self) -> usize {
        self.deployment.edge.description().probes.len()
    }
}
