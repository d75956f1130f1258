//! From a desktop model to the model that is deployed.

mod knots;

use anyhow::{Result, anyhow, bail};
use nalgebra::{Complex, DMatrix, DVector, SMatrix, SVector};
use rotor_edge_core::model::{
    Description, Forcing, ForcingLaw, KnotRange, MAX_FORCINGS, MAX_KNOTS, MAX_PLANES, MAX_SUPPORTS, Matrices,
    Model, Modes, Noise, Pair, Pedestal, Probe, Spring, Support,
};
use rotor_edge_core::node::Node;
use rotor_edge_core::reading::{MAX_PROBES, ProbeVector, Reading};
use rotor_edge_desktop as desktop;
use rotor_edge_desktop::effects::entry::resolve;
use rotor_edge_desktop::machine::drawing::{EffectEntry, Rotor};
use rotor_edge_desktop::machine::place::{Place, SpeedLaw};
use rotor_edge_desktop::measurement;
use rotor_edge_desktop::unbalance::{G_MM, phasor_kg_m};
use serde::Serialize;

/// Shape functions of the controller's model in each plane.
pub const SHAPES: usize = desktop::reduction::sizes::CONTROLLER;
/// The model of the largest controller: of a smaller one that holds the same model, the results are the same to the bit.
pub type EdgeModel = Model<SHAPES, MAX_PROBES, MAX_PLANES>;
pub type EdgeNode = Node<SHAPES, MAX_PROBES, MAX_PLANES>;

/// Speeds that the model is for, relative to the fastest in the data it was made for. Outside of it a
/// speed is a wrong unit (Hz for rpm) or a fault.
const SPEED_RANGE: [f64; 2] = [0.05, 1.3];
/// Smallest bound on a plane's unbalance, relative to the largest plane at deployment: a plane that was
/// in balance must be able to go out of balance.
const UNBALANCE_FLOOR: f64 = 0.1;

/// Stiffness of the nominal springs relative to the supports'. On stiffer springs the modes move the supports less and
/// resonate later, so that fewer speeds are near a resonance of theirs, where the controller has to take the long way; as
/// many digits are lost as the springs are too stiff.
const NOMINAL_STIFFNESS: f64 = 2.0;
/// Least stiffness taken for a support, relative to the stiffest: a seal may have none, or push.
const LEAST_STIFFNESS: f64 = 1e-2;

/// Effects that the desktop alone evaluates, and what to do instead.
const LEFT_TO_THE_DESKTOP: [(&str, &str); 3] = [
    ("speed_factor", "it takes the speed as it is read; correct the reading where it is made"),
    ("rub", "its supports do not touch and let go; clear the rub first"),
    (
        "thermal_bow",
        "it knows no run that the bow grows through; let the machine warm up, and give it a shaft_bow",
    ),
];

/// A reduced desktop model together with the same model in the controller's form.
pub struct Deployment {
    /// f64, for checking.
    pub desktop: desktop::model::Model,
    /// f32, for the controller.
    pub edge: EdgeModel,
    /// Unbalance at the start, kg·m, one phasor a plane.
    pub unbalance_kg_m: DVector<Complex<f64>>,
    /// Effects of single runs, `effect@run`, which are no part of the model: a controller knows no run.
    pub left_out: Vec<String>,
    /// How many more numbers a reading has than there are unknowns.
    pub redundancy: Redundancy,
}

/// What a reading has beyond what the planes need: the residual is of that alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Redundancy {
    /// Two for each probe that is used.
    pub features: usize,
    /// Two for each plane.
    pub unknowns: usize,
}

impl Redundancy {
    /// With every probe that is used giving a value.
    pub fn of(rotor: &Rotor) -> Self {
        let used = rotor.probe.iter().filter(|probe| probe.used).count();
        Self { features: 2 * used, unknowns: 2 * rotor.plane.len() }
    }

    pub fn words(self) -> String {
        let Self { features, unknowns } = self;
        let left = match features.checked_sub(unknowns) {
            None => "too few to tell the planes apart".into(),
            Some(0) => "none left, so that the residual says nothing".into(),
            Some(left) => format!("{left} left"),
        };
        format!("{features} features for {unknowns} unknowns: {left}")
    }
}

impl Deployment {
    /// Makes the model of an identified rotor, for machines that reach `fastest_rpm`.
    ///
    /// # Errors
    /// If it has more probes or planes than controllers hold, its terms do not fit, a foundation joins its supports, or it has an effect
    /// that no controller runs.
    pub fn new(rotor: &Rotor, fastest_rpm: f64) -> Result<Self> {
        if rotor.foundation.is_some() {
            bail!(
                "a controller's supports stand alone, and rotor \"{}\" has a [foundation] that joins them; give each of its \
                 bearings a pedestal instead, if compare says that this will do",
                rotor.name
            );
        }
        for (kind, instead) in LEFT_TO_THE_DESKTOP {
            if rotor.effect.iter().any(|e| e.kind == kind) {
                bail!("a controller does not run the effect {kind} of rotor \"{}\": {instead}", rotor.name);
            }
        }
        let unbalance_kg_m = DVector::from_iterator(
            rotor.plane.len(),
            rotor
                .plane
                .iter()
                .map(|p| phasor_kg_m(p.unbalance_g_mm.unwrap_or(0.0), p.angle_deg.unwrap_or(0.0))),
        );
        let plain = rotor.effect.is_empty() && rotor.bearing.len() == 2;
        let desktop = if plain {
            desktop::reduction::basis::reduced(rotor, SHAPES)
        } else {
            let full = desktop::model::Model::finite_elements(rotor);
            let fastest_rad_s = rotor_edge_desktop::units::rad_s(fastest_rpm);
            full.projected(&desktop::reduction::basis::closest(
                &full,
                SHAPES,
                fastest_rad_s,
                &unbalance_kg_m,
            )?)
        };
        Self::of_model(desktop, rotor, unbalance_kg_m, fastest_rpm)
    }

    /// Makes the controller's form of a reduced model, terms and all; of `rotor`, the noise and what stands where.
    ///
    /// # Errors
    /// If the model has more terms than the controller has room for, or does not pass its checks.
    pub fn of_model(
        desktop: desktop::model::Model,
        rotor: &Rotor,
        unbalance_kg_m: DVector<Complex<f64>>,
        fastest_rpm: f64,
    ) -> Result<Self> {
        let desktop = knots::straightened(desktop, rotor_edge_desktop::units::rad_s(fastest_rpm));
        let edge = edge_model(&desktop, rotor, &unbalance_kg_m, fastest_rpm)?;
        let (left_out, redundancy) = (of_single_runs(rotor), Redundancy::of(rotor));
        Ok(Self { desktop, edge, unbalance_kg_m, left_out, redundancy })
    }

    /// A measured reading as the controller gets it, its probes in the order of the rotor's file; lost probes stay lost.
    ///
    /// # Panics
    /// If the reading is not one of this rotor.
    pub fn reading(&self, measured: &measurement::Reading) -> Reading {
        assert_eq!(measured.probes.len(), self.edge.description().probes.len(), "a reading of this rotor");
        let vector = |phasor: &Option<Complex<f64>>| match phasor {
            Some(y) => ProbeVector { cos_um: (y.re * 1e6) as f32, sin_um: (-y.im * 1e6) as f32 },
            None => ProbeVector::LOST,
        };
        let vectors: Vec<ProbeVector> = measured.probes.iter().map(vector).collect();
        Reading::new(measured.speed_rpm as f32, &vectors).expect("a deployed model has one to eight probes")
    }
}

fn edge_model(
    model: &desktop::model::Model,
    rotor: &Rotor,
    unbalance_kg_m: &DVector<Complex<f64>>,
    fastest_rpm: f64,
) -> Result<EdgeModel> {
    let largest_g_mm = unbalance_kg_m.iter().map(|u| u.norm() * G_MM).fold(0.0, f64::max);
    let probe_terms = model.probes.iter().zip(&rotor.probe);
    let (tables, knots) = knots::tables(model);
    let modes = modes(model)?;
    let forward = |place: &DVector<f64>| modes.forward(&vector(place));
    let planes = held("planes", MAX_PLANES, model.planes.iter().map(forward))?;
    let initial_unbalance_g_mm: Vec<_> = unbalance_kg_m.iter().map(|u| pair(u * G_MM)).collect();
    let supports = model.supports.iter().zip(tables).map(|(s, table)| support(s, table, &modes));
    let supports = held("supports", MAX_SUPPORTS, supports)?;
    let knots = held("speeds in its bearings' tables", MAX_KNOTS, knots.into_iter())?;
    let forcings = held("forcings", MAX_FORCINGS, model.forcings.iter().map(|f| forcing(f, &modes)))?;
    let probes = probe_terms.map(|(term, place)| probe(term, bearing(rotor, place), &modes));
    let probes = held("probes", MAX_PROBES, probes)?;
    EdgeModel::new(&Description {
        machine: rotor.identity(),
        shaft: &modes.shaft(),
        internal_damping_s: model.internal_damping_s as f32,
        planes: &planes,
        initial_unbalance_g_mm: &initial_unbalance_g_mm,
        supports: &supports,
        knots: &knots,
        forcings: &forcings,
        probes: &probes,
        masked: masked(rotor),
        unbalance_floor_g_mm: (UNBALANCE_FLOOR * largest_g_mm) as f32,
        noise: rotor.noise.map_or_else(Noise::default, |noise| Noise {
            relative: noise.relative as f32,
            floor_um: noise.floor_um as f32,
        }),
        speed_range_rpm: SPEED_RANGE.map(|f| (f * fastest_rpm) as f32),
    })
    .map_err(|refusal| anyhow!("the controller would refuse this model: {refusal}"))
}

/// Bit i set: the controller masks probe i.
fn masked(rotor: &Rotor) -> u8 {
    let unused = (0..).zip(&rotor.probe).filter(|(_, probe)| !probe.used);
    unused.fold(0, |mask, (place, _): (u8, _)| mask | 1 << place)
}

/// The effects of a file that are those of one run, `effect@run`.
fn of_single_runs(rotor: &Rotor) -> Vec<String> {
    let of_a_run = |e: &&EffectEntry| {
        let resolved = resolve(rotor, &e.kind, e.at.as_deref());
        matches!(resolved, Ok((_, Place::Run(_))))
    };
    let label = |e: &EffectEntry| format!("{}@{}", e.kind, e.at.as_deref().unwrap_or_default());
    rotor.effect.iter().filter(of_a_run).map(label).collect()
}

/// The bytes that are deployed.
///
/// # Errors
/// None: the buffer has room for the largest model.
pub fn encoded(model: &EdgeModel) -> Result<Vec<u8>> {
    let mut bytes = vec![0; EdgeModel::max_size_bytes()];
    let length = model.encode(&mut bytes).map_err(|e| anyhow!("the model cannot be encoded: {e:?}"))?;
    bytes.truncate(length);
    Ok(bytes)
}

/// The terms of one kind, if a controller has room for them.
fn held<T>(kind: &str, most: usize, items: impl ExactSizeIterator<Item = T>) -> Result<Vec<T>> {
    let number = items.len();
    if number > most {
        bail!("the model has {number} {kind}, a controller holds {most} at most");
    }
    Ok(items.collect())
}

/// Of the shaft on nominal springs.
fn modes(model: &desktop::model::Model) -> Result<Modes<SHAPES>> {
    let stiffness = |s: &desktop::model::terms::Support| 0.5 * s.law.typical_stiffness_n_m().trace();
    let stiffest = model.supports.iter().map(stiffness).fold(f64::MIN_POSITIVE, f64::max);
    let springs = held(
        "supports",
        MAX_SUPPORTS,
        model.supports.iter().map(|s| Spring {
            shape: vector(&s.shape),
            stiffness_n_m: NOMINAL_STIFFNESS * stiffness(s).max(LEAST_STIFFNESS * stiffest),
        }),
    )?;
    let shaft = Matrices {
        stiffness: matrix(&model.structure.stiffness),
        mass: matrix(&model.structure.mass),
        polar_inertia: matrix(&model.structure.polar_inertia),
    };
    Modes::new(&shaft, &springs)
        .map_err(|e| anyhow!("the controller's model of the shaft cannot be made: {e}"))
}

fn forcing(f: &desktop::model::terms::Forcing, modes: &Modes<SHAPES>) -> Forcing<SHAPES> {
    let law = match f.law {
        SpeedLaw::Constant => ForcingLaw::Constant,
        SpeedLaw::Squared => ForcingLaw::SpeedSquared,
    };
    // N and kg·m inside, µN and g·mm at the edge
    Forcing { shape: modes.forward(&vector(&f.shape)), amplitude: pair(f.amplitude * 1e6), law }
}

fn support(
    s: &desktop::model::terms::Support,
    table: Option<KnotRange>,
    modes: &Modes<SHAPES>,
) -> Support<SHAPES> {
    let law = &s.law;
    Support {
        shape: modes.shape(&vector(&s.shape)),
        stiffness_n_m: rows(&law.stiffness_n_m),
        damping_n_s_m: rows(&law.damping_n_s_m),
        mass_kg: law.mass_kg as f32,
        stiffness_slope: law.stiffness_slope as f32,
        reference_speed_rad_s: law.reference_rad_s as f32,
        table,
        hardening_per_um2: (law.hardening_per_m2 * 1e-12) as f32,
        pedestal: law.pedestal.map(|p| Pedestal {
            stiffness_n_m: axes(p.stiffness_n_m),
            damping_n_s_m: axes(p.damping_n_s_m),
            mass_kg: axes(p.mass_kg),
        }),
    }
}

/// Rows and columns x, y.
fn rows(m: &nalgebra::Matrix2<f64>) -> [Pair; 2] {
    [[m.m11 as f32, m.m12 as f32], [m.m21 as f32, m.m22 as f32]]
}

fn axes(values: [f64; 2]) -> Pair {
    values.map(|v| v as f32)
}

fn probe(term: &desktop::model::terms::ProbeTerm, bearing: u8, modes: &Modes<SHAPES>) -> Probe<SHAPES> {
    Probe {
        shape: modes.shape(&vector(&term.shape)),
        direction: [term.angle_rad.cos() as f32, term.angle_rad.sin() as f32],
        gain: pair(term.gain),
        runout_um: pair(term.runout_m * 1e6),
        bearing,
        mount: term.mount.map(|support| support as u8),
    }
}

/// Which bearing of the file a probe stands at; the file was checked for it.
fn bearing(rotor: &Rotor, probe: &desktop::machine::drawing::Probe) -> u8 {
    rotor.bearing_of(probe).map_or(0, |place| place as u8)
}

fn matrix(m: &DMatrix<f64>) -> SMatrix<f64, SHAPES, SHAPES> {
    SMatrix::from_fn(|i, j| m[(i, j)])
}

fn vector(v: &DVector<f64>) -> SVector<f64, SHAPES> {
    SVector::from_fn(|i, _| v[i])
}

fn pair(c: Complex<f64>) -> Pair {
    [c.re as f32, c.im as f32]
}
