//! From a desktop model to the model that is deployed.

use anyhow::{Result, bail};
use nalgebra::{Complex, DMatrix, DVector, SMatrix, SVector};
use rotor_edge_core::model::{Forcing, ForcingLaw, MAX_PLANES, Model, Pedestal, Probe, Support};
use rotor_edge_core::node::Node;
use rotor_edge_core::reading::{PROBES, ProbeVector, Reading};
use rotor_edge_desktop as desktop;
use rotor_edge_desktop::measurement;
use rotor_edge_desktop::rotor::Rotor;
use rotor_edge_desktop::terms::SpeedLaw;
use rotor_edge_desktop::unbalance::{G_MM, phasor_kg_m};

/// Shape functions of the controller's model in each plane.
pub const SHAPES: usize = 6;
/// The model that controllers hold.
pub type EdgeModel = Model<SHAPES>;
/// A controller's node.
pub type EdgeNode = Node<SHAPES>;

/// Speeds that the model is for, relative to the fastest in the data it was made for. Outside of it a
/// speed is a wrong unit (Hz for rpm) or a fault.
const SPEED_RANGE: [f64; 2] = [0.05, 1.3];
/// Smallest bound on a plane's unbalance, relative to the largest plane at deployment: a plane that was
/// in balance must be able to go out of balance.
const UNBALANCE_FLOOR: f64 = 0.1;

/// A reduced desktop model together with the same model in the controller's form.
pub struct Deployment {
    /// f64, for checking.
    pub desktop: desktop::model::Model,
    /// f32, for the controller.
    pub edge: EdgeModel,
    /// Place in the file of the controller's probes: bearing 1 X, Y, bearing 2 X, Y.
    pub probes: [usize; PROBES],
    /// Unbalance at the start, kg·m, one phasor a plane.
    pub unbalance_kg_m: DVector<Complex<f64>>,
}

impl Deployment {
    /// Makes the model of an identified rotor, for machines that reach `fastest_rpm`.
    ///
    /// # Errors
    /// If the controller cannot hold the model: it has two X/Y pairs and one or two planes.
    pub fn new(rotor: &Rotor, fastest_rpm: f64) -> Result<Self> {
        let probes = probe_order(rotor)?;
        if rotor.plane.len() > MAX_PLANES {
            bail!(
                "rotor \"{}\" has {} planes, the controller follows one or two",
                rotor.name,
                rotor.plane.len()
            );
        }
        let unbalance_kg_m = DVector::from_iterator(
            rotor.plane.len(),
            rotor
                .plane
                .iter()
                .map(|p| phasor_kg_m(p.unbalance_g_mm.unwrap_or(0.0), p.angle_deg.unwrap_or(0.0))),
        );
        let desktop = if rotor.effect.is_empty() {
            desktop::model::Model::reduced(rotor, SHAPES)
        } else {
            let full = desktop::model::Model::finite_elements(rotor);
            let fastest_rad_s = measurement::rad_s(fastest_rpm);
            full.projected(&desktop::basis::closest(&full, SHAPES, fastest_rad_s, &unbalance_kg_m)?)
        };
        Self::of_model(desktop, probes, unbalance_kg_m, fastest_rpm)
    }

    /// Makes the controller's form of a reduced model, terms and all.
    ///
    /// # Errors
    /// If the model has more terms than the controller has room for, or does not pass its checks.
    pub fn of_model(
        desktop: desktop::model::Model,
        probes: [usize; PROBES],
        unbalance_kg_m: DVector<Complex<f64>>,
        fastest_rpm: f64,
    ) -> Result<Self> {
        let edge = edge_model(&desktop, &probes, &unbalance_kg_m, fastest_rpm)?;
        Ok(Self { desktop, edge, probes, unbalance_kg_m })
    }

    /// A measured reading as the controller gets it; lost probes stay lost.
    pub fn reading(&self, measured: &measurement::Reading) -> Reading {
        let vector = |p: usize| match measured.probes[p] {
            Some(y) => ProbeVector { cos_um: (y.re * 1e6) as f32, sin_um: (-y.im * 1e6) as f32 },
            None => ProbeVector::LOST,
        };
        Reading { speed_rpm: measured.speed_rpm as f32, probes: self.probes.map(vector) }
    }
}

/// Place in the file of the controller's probes: bearing 1 X, Y, bearing 2 X, Y.
///
/// # Errors
/// If there are not two probes at each bearing.
pub fn probe_order(rotor: &Rotor) -> Result<[usize; PROBES]> {
    let beside = |bearing: &str| {
        let of_bearing = rotor.probe.iter().enumerate().filter(|(_, p)| p.bearing == bearing);
        of_bearing.map(|(i, _)| i).collect::<Vec<_>>()
    };
    let order: Vec<usize> = rotor.bearing.iter().flat_map(|b| beside(&b.name)).collect();
    let pairs = rotor.bearing.iter().all(|b| beside(&b.name).len() == 2);
    match order.try_into() {
        Ok(order) if pairs => Ok(order),
        _ => bail!(
            "rotor \"{}\": the controller reads two probes at each bearing, no more and no fewer",
            rotor.name
        ),
    }
}

fn edge_model(
    model: &desktop::model::Model,
    probes: &[usize; PROBES],
    unbalance_kg_m: &DVector<Complex<f64>>,
    fastest_rpm: f64,
) -> Result<EdgeModel> {
    let room = |_| anyhow::anyhow!("the model has more terms than the controller has room for");
    let start_g_mm = |j: usize| {
        let u = unbalance_kg_m.get(j).copied().unwrap_or_default() * G_MM;
        [u.re as f32, u.im as f32]
    };
    let largest_g_mm = unbalance_kg_m.iter().map(|u| u.norm() * G_MM).fold(0.0, f64::max);
    let mut supports = heapless::Vec::new();
    for s in &model.supports {
        supports.push(support(s)).map_err(|_| room(()))?;
    }
    let mut forcings = heapless::Vec::new();
    for f in &model.forcings {
        let law = match f.law {
            SpeedLaw::Constant => ForcingLaw::Constant,
            SpeedLaw::Squared => ForcingLaw::SpeedSquared,
        };
        // N and kg·m inside, µN and g·mm at the edge
        let amplitude = f.amplitude * 1e6;
        let forcing = Forcing { shape: vector(&f.shape), amplitude: pair(amplitude), law };
        forcings.push(forcing).map_err(|_| room(()))?;
    }
    let mut planes = heapless::Vec::new();
    for shape in &model.planes {
        planes.push(vector(shape)).map_err(|_| room(()))?;
    }
    let edge = Model {
        stiffness: matrix(&model.structure.stiffness),
        mass: matrix(&model.structure.mass),
        polar_inertia: matrix(&model.structure.polar_inertia),
        internal_damping_s: model.internal_damping_s as f32,
        planes,
        supports,
        forcings,
        probes: probes.map(|i| {
            let p = &model.probes[i];
            Probe {
                shape: vector(&p.shape),
                direction: [p.angle_rad.cos() as f32, p.angle_rad.sin() as f32],
                gain: pair(p.gain),
                runout_um: pair(p.runout_m * 1e6),
            }
        }),
        initial_unbalance_g_mm: [start_g_mm(0), start_g_mm(1)],
        unbalance_floor_g_mm: (UNBALANCE_FLOOR * largest_g_mm) as f32,
        speed_range_rpm: SPEED_RANGE.map(|f| (f * fastest_rpm) as f32),
    };
    if let Err(refusal) = edge.check() {
        bail!("the controller would refuse this model: {refusal:?}");
    }
    Ok(edge)
}

fn support(s: &desktop::terms::Support) -> Support<SHAPES> {
    let rows = |m: &nalgebra::Matrix2<f64>| [[m.m11 as f32, m.m12 as f32], [m.m21 as f32, m.m22 as f32]];
    let law = &s.law;
    Support {
        shape: vector(&s.shape),
        stiffness_n_m: rows(&law.stiffness_n_m),
        damping_n_s_m: rows(&law.damping_n_s_m),
        mass_kg: law.mass_kg as f32,
        stiffness_slope: law.stiffness_slope as f32,
        reference_speed_rad_s: law.reference_rad_s as f32,
        hardening_per_um2: (law.hardening_per_m2 * 1e-12) as f32,
        pedestal: law.pedestal.map(|p| Pedestal {
            stiffness_n_m: p.stiffness_n_m as f32,
            damping_n_s_m: p.damping_n_s_m as f32,
            mass_kg: p.mass_kg as f32,
        }),
    }
}

fn matrix(m: &DMatrix<f64>) -> SMatrix<f32, SHAPES, SHAPES> {
    SMatrix::from_fn(|i, j| m[(i, j)] as f32)
}

fn vector(v: &DVector<f64>) -> SVector<f32, SHAPES> {
    SVector::from_fn(|i, _| v[i] as f32)
}

fn pair(c: Complex<f64>) -> [f32; 2] {
    [c.re as f32, c.im as f32]
}
