//! Times the forced response of the sample's finite elements, and writes the equations for `lapack.py`.
//!
//! `cargo run --release -p rotor-edge-tests --example banded_solve FOLDER` prints one JSON array: for each mesh the number of
//! nodes, speeds and columns, and times in µs: `banded` for factors and solution of one speed, `motion` for one call of
//! `Model::motion`, `response` for the model and its response at all speeds.
//!
//! FOLDER receives, as little-endian pairs of f64, speed by speed and column by column: `NODES.band` (LAPACK's band storage,
//! 7 places below the diagonal and 14 above), `NODES.force` and `NODES.motion`, node by node.

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context as _, Result};
use nalgebra::{Complex, DMatrix};
use rotor_edge::sample;
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::model::banded::Banded;
use rotor_edge_desktop::shaft::structure::Structure;
use serde_json::{Value, json};

type C = Complex<f64>;

/// Entries beside the diagonal: those of the next node.
const HALF_WIDTH: usize = 7;
/// Elements a segment of the shaft: 19 and 73 nodes.
const MESHES: [usize; 2] = [2, 8];
const REPETITIONS: usize = 31;

/// The equations of one speed, node by node.
struct Equations {
    banded: Banded,
    /// Column by column, from 14 places above the diagonal to 7 below.
    band: Vec<C>,
    force: DMatrix<C>,
    motion: DMatrix<C>,
}

fn main() -> Result<()> {
    let folder = std::env::args_os().nth(1).context("expected a folder for the matrices")?;
    let (rotor, _, runup) = sample::load()?;
    let meshes: Result<Vec<Value>> =
        MESHES.iter().map(|elements| measured(&rotor, &runup, *elements, folder.as_ref())).collect();
    println!("{}", Value::from(meshes?));
    Ok(())
}

fn measured(rotor: &Rotor, runup: &[Reading], elements: usize, folder: &Path) -> Result<Value> {
    let made = || Model::on(Structure::finite_elements(rotor, &rotor.physics, elements), rotor);
    let model = made();
    let speeds: Vec<f64> = runup.iter().map(Reading::speed_rad_s).collect();
    let at_rest = vec![[0.0; 2]; model.supports.len()];
    let equations: Result<Vec<Equations>> = speeds.iter().map(|speed| equations(&model, *speed)).collect();
    let equations = equations?;
    let nodes = model.structure.size() / 2;
    write(folder, &format!("{nodes}.band"), equations.iter().flat_map(|e| &e.band))?;
    write(folder, &format!("{nodes}.force"), equations.iter().flat_map(|e| e.force.iter()))?;
    write(folder, &format!("{nodes}.motion"), equations.iter().flat_map(|e| e.motion.iter()))?;

    let banded = median_us(|| {
        for e in &equations {
            let mut columns = e.force.clone();
            black_box(&e.banded).clone().factor().unwrap().solve(&mut columns);
            black_box(columns);
        }
    });
    let motion = median_us(|| {
        for speed in &speeds {
            black_box(model.motion(black_box(*speed), &at_rest).unwrap());
        }
    });
    let response = median_us(|| {
        let model = made();
        speeds.iter().for_each(|speed| drop(black_box(model.response(*speed).unwrap())));
    });
    let count = speeds.len();
    Ok(json!({
        "nodes": nodes, "speeds": count, "columns": model.planes.len() + 1,
        "banded": banded / count as f64, "motion": motion / count as f64, "response": response
    }))
}

/// The equations that `Model::motion` solves, from the dense dynamic stiffness.
fn equations(model: &Model, speed_rad_s: f64) -> Result<Equations> {
    let n = model.structure.size();
    let at_rest = vec![[0.0; 2]; model.supports.len()];
    // coordinates of x, then those of y; each displacement and slope of node after node
    let place = |row: usize| if row < n { row / 2 * 4 + row % 2 } else { (row - n) / 2 * 4 + 2 + row % 2 };
    let by_node = |columns: &DMatrix<C>| {
        let mut sorted = columns.clone();
        (0..2 * n).for_each(|row| sorted.row_mut(place(row)).copy_from(&columns.row(row)));
        sorted
    };
    let dense = model.dynamic_stiffness(speed_rad_s, &at_rest);
    let mut banded = Banded::zeros(2 * n, HALF_WIDTH);
    let mut band = vec![C::from(0.0); (3 * HALF_WIDTH + 1) * 2 * n];
    for row in 0..2 * n {
        for column in 0..2 * n {
            let value = dense[(row, column)];
            if value != C::from(0.0) {
                let (i, j) = (place(row), place(column));
                banded.add(i, j, value);
                band[(3 * HALF_WIDTH + 1) * j + 2 * HALF_WIDTH + i - j] = value;
            }
        }
    }
    let mut force = DMatrix::zeros(2 * n, model.planes.len() + 1);
    for (j, shape) in model.planes.iter().enumerate() {
        for (k, s) in shape.iter().enumerate() {
            force[(k, j)] = C::new(speed_rad_s * speed_rad_s * s, 0.0);
            force[(n + k, j)] = C::new(0.0, -speed_rad_s * speed_rad_s * s);
        }
    }
    let motion = by_node(&model.motion(speed_rad_s, &at_rest)?);
    Ok(Equations { banded, band, force: by_node(&force), motion })
}

/// Median time of a call, µs.
fn median_us(mut call: impl FnMut()) -> f64 {
    let mut all: Vec<f64> = (0..REPETITIONS)
        .map(|_| {
            let begun = Instant::now();
            call();
            begun.elapsed().as_secs_f64() * 1e6
        })
        .collect();
    all.sort_by(f64::total_cmp);
    all[REPETITIONS / 2]
}

fn write<'a>(folder: &Path, name: &str, numbers: impl Iterator<Item = &'a C>) -> Result<()> {
    let bytes: Vec<u8> = numbers.flat_map(|c| [c.re, c.im]).flat_map(f64::to_le_bytes).collect();
    let path = folder.join(name);
    std::fs::write(&path, bytes).with_context(|| format!("{}: cannot be written", path.display()))
}
