//! `decode`: a recorded candump log as readings and results.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::{ArgGroup, Args};
use nalgebra::Complex;
use rotor_edge_core::reading::{self, ProbeVector};
use rotor_edge_desktop::measurement::{self, Reading, phasor_m};
use rotor_edge_desktop::rotor_file;

use super::output;
use crate::answers::decode::LogAnswer;
use crate::bus::decoded::{DecodedLog, Timed, shortest};
use crate::bus::log::LogReader;
use crate::bus::mac::Checker;
use crate::deploy::read_key;
use crate::terminal;

const US_A_DAY: f64 = 86_400e6;

#[derive(Debug, Args)]
#[command(group = ArgGroup::new("of_node").multiple(true))]
pub struct Arguments {
    /// The recording, a candump log
    log: PathBuf,
    /// Write the readings as measured.csv
    #[arg(short, long, group = "of_node")]
    output: Option<PathBuf>,
    /// The rotor whose probes' names the columns get; probe1, probe2 and so on if absent
    #[arg(long, requires = "output")]
    rotor: Option<PathBuf>,
    /// The node whose readings are written, if the log holds several, or whose key is given
    #[arg(long, requires = "of_node")]
    node: Option<u8>,
    /// Key of that node: ignore frames without its message authentication code (see `node --sealed`)
    #[arg(long, requires = "node", group = "of_node")]
    key: Option<PathBuf>,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let name = arguments.log.display().to_string();
    let key = arguments.key.as_deref().map(read_key).transpose()?;
    let checker = key.zip(arguments.node).map(|(key, node)| Checker::new(key, node));
    let all = DecodedLog::checked(LogReader::open(&arguments.log)?, &name, checker)?;
    if let Some(path) = &arguments.output {
        let recorded = readings_of(&all, arguments.node, &name)?;
        let names = probe_names(recorded, arguments.rotor.as_deref(), &name)?;
        let mut csv = Vec::new();
        let readings = readings(recorded, all.start_us, &name)?;
        measurement::write_probes(&mut csv, &names, &readings)?;
        output::file(path, &csv)?;
    }
    let summary = LogAnswer::of(&all);
    if arguments.json {
        return output::json(&summary);
    }
    terminal::print(&text(&summary, arguments.output.as_deref()));
    Ok(())
}

/// The readings of the node that was asked for, or of the only one.
fn readings_of<'a>(
    all: &'a DecodedLog,
    wanted: Option<u8>,
    name: &str,
) -> Result<&'a [Timed<reading::Reading>]> {
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

/// Names for the probes of all readings: those of the rotor, which must have as many.
fn probe_names(
    recorded: &[Timed<reading::Reading>],
    rotor: Option<&Path>,
    name: &str,
) -> Result<Vec<String>> {
    let number = recorded.first().map_or(0, |timed| timed.what.probes().len());
    if let Some(other) = recorded.iter().find(|timed| timed.what.probes().len() != number) {
        bail!(
            "{name}: readings of {number} probes and of {}; one file holds those of one machine",
            other.what.probes().len()
        );
    }
    let Some(path) = rotor else { return Ok((1..=number).map(|probe| format!("probe{probe}")).collect()) };
    let rotor = rotor_file::read(path)?;
    if rotor.probe.len() != number {
        bail!("{name}: readings of {number} probes, but rotor \"{}\" has {}", rotor.name, rotor.probe.len());
    }
    Ok(rotor.probe.into_iter().map(|probe| probe.name).collect())
}

fn readings(recorded: &[Timed<reading::Reading>], start_us: u64, name: &str) -> Result<Vec<Reading>> {
    if let Some(pair) = recorded.windows(2).find(|pair| pair[1].time_us < pair[0].time_us) {
        let seconds = |timed: &Timed<_>| timed.time_us as f64 * 1e-6;
        bail!(
            "{name}: time goes back from {:.6} to {:.6} s, expected one recording with ascending times",
            seconds(&pair[0]),
            seconds(&pair[1])
        );
    }
    let with_gaps = recorded.iter().any(|timed| timed.what.gaps_v().iter().any(|v| v.is_finite()));
    let reading = |timed: &Timed<reading::Reading>| {
        let time_d = timed.time_us.saturating_sub(start_us) as f64 / US_A_DAY;
        let gaps_v = timed.what.gaps_v().iter().map(|v| v.is_finite().then(|| shortest(*v)));
        Reading {
            row: None,
            run: None,
            session: None,
            // to a microsecond and no further
            time_d: Some((time_d * 1e11).round() / 1e11),
            speed_rpm: shortest(timed.what.speed_rpm),
            probes: timed.what.probes().iter().map(phasor).collect(),
            gaps_v: if with_gaps { gaps_v.collect() } else { vec![] },
            conditions: Vec::new(),
        }
    };
    Ok(recorded.iter().map(reading).collect())
}

fn phasor(vector: &ProbeVector) -> Option<Complex<f64>> {
    vector.is_finite().then(|| phasor_m(shortest(vector.cos_um), shortest(vector.sin_um)))
}

fn text(summary: &LogAnswer, written: Option<&Path>) -> String {
    let mut text = String::new();
    text += &format!("{} frames, {} of them of rotor-edge\n", summary.frames, summary.ours);
    if summary.torn > 0 {
        text += &format!("Damaged lines, ignored: {}\n", summary.torn);
    }
    if let Some(refused) = &summary.refused {
        text += &format!("With the key, {refused}\n");
    }
    for node in &summary.nodes {
        let c = &node.counters;
        text += &format!(
            "\nNode {}: {} readings, {} results, {} heartbeats{}\n",
            node.node,
            node.readings,
            node.results.len(),
            node.heartbeats,
            node.state.as_ref().map_or(String::new(), |state| format!(", last state {state}"))
        );
        text += &format!(
            "  lost {}, rejected {}, repeated {}, late {}, incomplete {}, stray frames {}, damaged results {}\n",
            c.lost, c.rejected, c.repeated, c.late, c.incomplete, c.stray, c.damaged_results
        );
        for change in &node.states {
            text += &format!("{:>12.3} s: {}, {}\n", change.time_s, change.state, change.reason);
        }
        let planes = node.results.iter().map(|r| r.planes.len()).max().unwrap_or(0);
        if planes > 0 {
            let columns: String = (1..=planes).map(|plane| format!("      plane {plane} g·mm, °")).collect();
            text += &format!("      time s  reading{columns}  residual µm 0-pk   ratio\n");
        }
        for r in &node.results {
            let flag = match (r.flagged, r.suspicious, r.suspect) {
                (true, _, Some(bearing)) => format!("  FLAGGED, bearing {bearing}"),
                (true, _, None) => "  FLAGGED".into(),
                (false, true, _) => "  suspicious".into(),
                (false, false, _) => String::new(),
            };
            let planes: String = r
                .planes
                .iter()
                .map(|p| format!(" {:>12.2} {:>7.1}", p.unbalance_g_mm, p.angle_deg))
                .collect();
            text += &format!(
                "{:>12.3} {:>8}{planes} {:>17.3} {:>7.3}{flag}\n",
                r.time_s, r.sequence, r.residual_um, r.ratio
            );
        }
    }
    if let Some(path) = written {
        text += &format!("\nReadings written to {}\n", path.display());
    }
    text
}
