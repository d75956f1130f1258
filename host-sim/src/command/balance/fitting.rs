//! What weights are to do and may be, as the command line states it.

use anyhow::{Result, bail};
use clap::Args;
use rotor_edge_desktop::balance::optimum::Criterion;
use rotor_edge_desktop::balance::places::{Holes, MOST};
use rotor_edge_desktop::balance::wanted::Wanted;
use rotor_edge_desktop::balance::weights::Allowed;

/// Most holes of a plane.
const MOST_HOLES: u64 = 120;

/// Options of both ways to balance.
#[derive(Debug, Args)]
pub struct Fitting {
    /// Radii of the weights, mm [default: only the unbalance is given]
    #[arg(long, value_delimiter = ',')]
    radii_mm: Vec<f64>,
    /// Weights are multiples of this, g
    #[arg(long, requires = "radii_mm")]
    step_g: Option<f64>,
    /// Minimise the largest vibration instead of the sum of squares
    #[arg(long)]
    min_max: bool,
    /// Largest weight of a plane, g·mm: of all, or by plane as in A=300,B=200
    #[arg(long, value_name = "[PLANE=]X", value_delimiter = ',', value_parser = limit)]
    largest_g_mm: Vec<(Option<String>, f64)>,
    /// Weights go into this many holes or blades, evenly around each plane
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..=MOST_HOLES))]
    holes: Option<u64>,
    /// Angle of hole 1, degrees; numbers grow as angles do
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        requires = "holes",
        allow_negative_numbers = true
    )]
    first_hole_deg: f64,
    /// Largest number of holes for the weight of one plane
    #[arg(long, value_name = "N", default_value_t = 2, requires = "holes", value_parser = clap::value_parser!(u64).range(1..=MOST as u64))]
    split: u64,
    /// Occupied holes: of all planes, or by plane as in A=3,A=4,B=7
    #[arg(long, value_name = "[PLANE=]HOLE", value_delimiter = ',', value_parser = hole, requires = "holes")]
    taken: Vec<(Option<String>, usize)>,
}

impl Fitting {
    /// What is wanted.
    ///
    /// # Errors
    /// If a number makes no sense.
    pub fn wanted(&self, against_rotation: bool) -> Result<Wanted> {
        let numbers = self.step_g.iter().map(|v| ("--step-g", *v));
        for (name, value) in numbers.chain(self.radii_mm.iter().map(|r| ("--radii-mm", *r))) {
            if !(value > 0.0 && value.is_finite()) {
                bail!("{name} must be a positive number, not {value}");
            }
        }
        let turn = if against_rotation { -1.0 } else { 1.0 };
        Ok(Wanted {
            criterion: if self.min_max { Criterion::MinMax } else { Criterion::LeastSquares },
            limits: self.largest_g_mm.clone(),
            allowed: Allowed { radii_mm: self.radii_mm.clone(), step_g: self.step_g },
            holes: self.holes.map(|count| Holes {
                count: count as usize,
                first_deg: turn * self.first_hole_deg,
                against_rotation,
                most: self.split as usize,
            }),
            taken: self.taken.clone(),
        })
    }
}

/// `[PLANE=]TEXT`.
fn of_plane(text: &str) -> (Option<String>, &str) {
    match text.rsplit_once('=') {
        Some((plane, rest)) => (Some(plane.trim().to_string()), rest.trim()),
        None => (None, text.trim()),
    }
}

/// A largest weight, of every plane or of one.
fn limit(text: &str) -> Result<(Option<String>, f64), String> {
    let (plane, number) = of_plane(text);
    match number.parse() {
        Ok(g_mm) if g_mm > 0.0 && f64::is_finite(g_mm) => Ok((plane, g_mm)),
        _ => Err(format!("\"{number}\" is not a positive number of g·mm")),
    }
}

/// The number of a hole, of every plane or of one.
fn hole(text: &str) -> Result<(Option<String>, usize), String> {
    let (plane, number) = of_plane(text);
    let number = number.parse().map_err(|_| format!("\"{number}\" is not the number of a hole"))?;
    Ok((plane, number))
}
