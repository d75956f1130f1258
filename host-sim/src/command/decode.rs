//! `decode`: a recorded candump log as readings and results.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::Args;
use nalgebra::Complex;
use rotor_edge_core::reading::{PROBES, ProbeVector};
use rotor_edge_desktop::measurement::{self, Reading, phasor_m};
use rotor_edge_desktop::rotor_file;
use serde::Serialize;

use super::answer::{Answer, state_name};
use super::output;
use crate::bus::decoded::{Decoded, NodeRecord, Timed};
use crate::bus::log::LogReader;
use crate::edge::probe_order;

/// Names of the probes where no rotor gives them: bearing and direction.
const PROBE_NAMES: [&str; PROBES] = ["1X", "1Y", "2X", "2Y"];
const US_A_DAY: f64 = 86_400e6;

#[derive(Debug, Args)]
pub struct Arguments {
    /// The recording, a candump log
    log: PathBuf,
    /// Write the readings as measured.csv
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// The rotor whose probes' names the columns get; 1X, 1Y, 2X, 2Y if absent
    #[arg(long, requires = "output")]
    rotor: Option<PathBuf>,
    /// The node whose readings are written, if the log holds several
    #[arg(long, requires = "output")]
    node: Option<u8>,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    let name = arguments.log.display().to_string();
    let all = Decoded::of(LogReader::open(&arguments.log)?, &name)?;
    if let Some(path) = &arguments.output {
        let columns = Columns::of(arguments.rotor.as_deref())?;
        let mut csv = Vec::new();
        let readings = columns.readings(readings_of(&all, arguments.node, &name)?, all.start_us, &name)?;
        measurement::write_probes(&mut csv, &columns.names, &readings)?;
        output::file(path, &csv)?;
    }
    let summary = Summary::of(&all);
    if arguments.json { output::json(&summary) } else { print(&summary, arguments.output.as_deref()) }
}

/// The readings of the node that was asked for, or of the only one.
fn readings_of<'a>(
    all: &'a Decoded,
    wanted: Option<u8>,
    name: &str,
) -> Result<&'a [Timed<rotor_edge_core::reading::Reading>]> {
    let with_readings = || all.nodes.iter().filter(|(_, record)| !record.readings.is_empty());
    let numbers: Vec<String> = with_readings().map(|(number, _)| number.to_string()).collect();
    let mut chosen = with_readings().filter(|(number, _)| wanted.is_none_or(|wanted| wanted == **number));
    match (chosen.next(), chosen.next()) {
        (Some((_, record)), None) => Ok(&record.readings),
        (None, _) if numbers.is_empty() => {
            bail!("{name}: the log holds results but no whole reading to write")
        }
        (None, _) => bail!(
            "{name}: no reading of node {}, there are those of {}",
            wanted.unwrap_or(0),
            numbers.join(", ")
        ),
        (Some(_), Some(_)) => {
            bail!("{name}: the log holds readings of nodes {}; choose one with --node", numbers.join(", "))
        }
    }
}

/// Where the controller's probes stand in the file.
struct Columns {
    names: Vec<String>,
    places: [usize; PROBES],
}

impl Columns {
    fn of(rotor: Option<&Path>) -> Result<Self> {
        let Some(path) = rotor else {
            return Ok(Self {
                names: PROBE_NAMES.map(String::from).to_vec(),
                places: std::array::from_fn(|i| i),
            });
        };
        let rotor = rotor_file::read(path)?;
        Ok(Self { places: probe_order(&rotor)?, names: rotor.probe.into_iter().map(|p| p.name).collect() })
    }

    fn readings(
        &self,
        recorded: &[Timed<rotor_edge_core::reading::Reading>],
        start_us: u64,
        name: &str,
    ) -> Result<Vec<Reading>> {
        if let Some(pair) = recorded.windows(2).find(|pair| pair[1].time_us < pair[0].time_us) {
            let seconds = |timed: &Timed<_>| timed.time_us as f64 * 1e-6;
            bail!(
                "{name}: time goes back from {:.6} to {:.6} s, expected one recording with ascending times",
                seconds(&pair[0]),
                seconds(&pair[1])
            );
        }
        let reading = |timed: &Timed<rotor_edge_core::reading::Reading>| {
            let mut probes = vec![None; self.names.len()];
            for (place, vector) in self.places.iter().zip(&timed.what.probes) {
                probes[*place] = phasor(vector);
            }
            let time_d = timed.time_us.saturating_sub(start_us) as f64 / US_A_DAY;
            Reading {
                run: None,
                // to a microsecond and no further
                time_d: Some((time_d * 1e11).round() / 1e11),
                speed_rpm: shortest(timed.what.speed_rpm),
                probes,
            }
        };
        Ok(recorded.iter().map(reading).collect())
    }
}

fn phasor(vector: &ProbeVector) -> Option<Complex<f64>> {
    vector.is_finite().then(|| phasor_m(shortest(vector.cos_um), shortest(vector.sin_um)))
}

/// The decimal number that was meant: the shortest that is this f32.
fn shortest(value: f32) -> f64 {
    value.to_string().parse().unwrap_or_else(|_| f64::from(value))
}

/// What `decode --json` prints.
#[derive(Serialize)]
struct Summary {
    frames: u64,
    ours: u64,
    nodes: Vec<Node>,
}

#[derive(Serialize)]
struct Node {
    node: u8,
    readings: usize,
    heartbeats: u64,
    state: Option<&'static str>,
    counters: Counters,
    results: Vec<Answer>,
}

/// What became of what was recorded.
#[derive(Serialize)]
struct Counters {
    lost: u16,
    rejected: u16,
    repeated: u16,
    late: u16,
    incomplete: u16,
    stray: u16,
    damaged_results: u16,
}

impl Summary {
    fn of(all: &Decoded) -> Self {
        let nodes = all.nodes.iter().map(|(number, record)| Node::of(*number, record, all.start_us));
        Self { frames: all.frames, ours: all.ours, nodes: nodes.collect() }
    }
}

impl Node {
    fn of(node: u8, record: &NodeRecord, start_us: u64) -> Self {
        let c = record.assembler.counters();
        Self {
            node,
            readings: record.readings.len(),
            heartbeats: record.heartbeats,
            state: record.state.map(state_name),
            counters: Counters {
                lost: c.lost,
                rejected: c.rejected,
                repeated: c.repeated,
                late: c.late,
                incomplete: c.incomplete,
                stray: c.stray,
                damaged_results: record.result_assembler.damaged(),
            },
            results: record.results.iter().map(|timed| Answer::of(timed, start_us)).collect(),
        }
    }
}

fn print(summary: &Summary, written: Option<&Path>) -> Result<()> {
    println!("{} frames, {} of them of rotor-edge", summary.frames, summary.ours);
    for node in &summary.nodes {
        let c = &node.counters;
        println!(
            "\nNode {}: {} readings, {} results, {} heartbeats{}",
            node.node,
            node.readings,
            node.results.len(),
            node.heartbeats,
            node.state.map_or(String::new(), |state| format!(", last state {state}"))
        );
        println!(
            "  lost {}, rejected {}, repeated {}, late {}, incomplete {}, stray frames {}, damaged results {}",
            c.lost, c.rejected, c.repeated, c.late, c.incomplete, c.stray, c.damaged_results
        );
        if !node.results.is_empty() {
            println!("      time s  reading      plane 1 g·mm, °      plane 2 g·mm, °  residual µm   ratio");
        }
        for r in &node.results {
            let [first, second] = &r.planes;
            let flag = match (r.flagged, r.suspicious, r.suspect) {
                (true, _, Some(bearing)) => format!("  FLAGGED, bearing {bearing}"),
                (true, _, None) => "  FLAGGED".into(),
                (false, true, _) => "  suspicious".into(),
                (false, false, _) => String::new(),
            };
            println!(
                "{:>12.3} {:>8} {:>12.2} {:>7.1} {:>12.2} {:>7.1} {:>12.3} {:>7.3}{flag}",
                r.time_s,
                r.sequence,
                first.unbalance_g_mm,
                first.angle_deg,
                second.unbalance_g_mm,
                second.angle_deg,
                r.residual_um,
                r.ratio
            );
        }
    }
    if let Some(path) = written {
        println!("\nReadings written to {}", path.display());
    }
    Ok(())
}
