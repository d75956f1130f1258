//! Every estimate of `track` as a table.

use std::path::Path;

use anyhow::Result;
use nalgebra::Complex;
use rotor_edge_desktop::forecast::known;
use rotor_edge_desktop::forecast::series::EVENT;
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::spreadsheet;
use rotor_edge_desktop::track::{CredibleIntervals, FlagCause, ReadingEstimate, Track};
use rotor_edge_desktop::unbalance::{g_mm_deg, static_and_dynamic};
use rotor_edge_desktop::whole_file;

use crate::answers::names::coefficient_names;
use crate::answers::track::plane_ends;
use crate::ingest::dates::{Dates, TIME};

/// Writes every estimate, whole or not at all.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: &Path, rotor: &Rotor, track: &Track, dates: Dates) -> Result<()> {
    let known_then = track.joint.as_ref().map(|j| j.filter_states.as_slice());
    let mut head = header(rotor);
    if !dates.is_unknown() {
        head.insert(1, TIME.into());
    }
    let spreads = track.estimates.iter().any(|e| e.spread.is_some());
    if spreads {
        head.extend(interval_header(rotor));
    }
    head.extend(known_then.iter().flat_map(|_| known::header()));
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(head.iter().map(|name| spreadsheet::cell(name).into_owned()))?;
    for (i, e) in track.estimates.iter().enumerate() {
        let before_d = if i == 0 { f64::NEG_INFINITY } else { track.estimates[i - 1].time_d };
        // an instrument ends no forecast of the machine
        let is_event = track
            .flags
            .iter()
            .any(|f| f.cause != FlagCause::Instrument && before_d < f.since_d && f.since_d <= e.time_d);
        let mut cells = row(rotor, e, is_event);
        if let Some(time) = dates.iso(e.time_d) {
            cells.insert(1, time);
        }
        if spreads {
            cells.extend(interval_cells(rotor, e.spread.as_ref()));
        }
        // the joint method's estimates know the days that came after; a forecast must not
        cells.extend(known_then.iter().flat_map(|known| known::cells(&known[i])));
        writer.write_record(&cells)?;
    }
    Ok(whole_file::write(path, &writer.into_inner()?)?)
}

const STATIC_DYNAMIC: [&str; 4] = ["static_g_mm", "static_deg", "dynamic_g_mm", "dynamic_deg"];

fn vector_cells(u: Complex<f64>) -> [String; 2] {
    let [magnitude, angle] = g_mm_deg(u);
    [format!("{magnitude:.4}"), format!("{angle:.4}")]
}

fn header(rotor: &Rotor) -> Vec<String> {
    let mut names = vec!["time_d".to_string()];
    names.extend(rotor.plane.iter().flat_map(|p| [format!("{}_g_mm", p.name), format!("{}_deg", p.name)]));
    names.extend(STATIC_DYNAMIC.map(String::from));
    names.extend(["residual_um", "residual_ratio", "suspicious", "flagged", EVENT].map(String::from));
    names.extend(coefficient_names(rotor));
    names.extend(
        rotor.probe.iter().flat_map(|p| [format!("{}_cos_um", p.name), format!("{}_sin_um", p.name)]),
    );
    names
}

fn row(rotor: &Rotor, e: &ReadingEstimate, is_event: bool) -> Vec<String> {
    let mut cells = vec![e.time_d.to_string()];
    cells.extend(e.unbalance_kg_m.iter().flat_map(|u| vector_cells(*u)));
    let split = static_and_dynamic(&rotor.plane_positions_m(), &e.unbalance_kg_m);
    cells.extend(split.into_iter().flat_map(vector_cells));
    cells.extend([format!("{:.5}", e.residual.e_um), format!("{:.6}", e.residual.ratio())]);
    cells.extend([e.suspicious, e.flagged, is_event].map(|b| u8::from(b).to_string()));
    cells.extend(e.logs.iter().map(|log| format!("{:.6e}", log.exp())));
    cells.extend(
        e.calculated_m.iter().flat_map(|y| [format!("{:.5}", y.re * 1e6), format!("{:.5}", -y.im * 1e6)]),
    );
    cells
}

/// Names of the ends of the 95 % intervals.
fn interval_header(rotor: &Rotor) -> Vec<String> {
    let planes = rotor.plane.iter().flat_map(|p| [format!("{}_g_mm", p.name), format!("{}_deg", p.name)]);
    let ends = |name: String| [format!("{name}_low"), format!("{name}_high")];
    planes.chain(coefficient_names(rotor)).flat_map(ends).collect()
}

/// The ends themselves; empty where the method states none for this estimate.
fn interval_cells(rotor: &Rotor, spread: Option<&CredibleIntervals>) -> Vec<String> {
    let Some(spread) = spread else { return vec![String::new(); interval_header(rotor).len()] };
    let planes = (0..rotor.plane.len()).flat_map(|j| plane_ends(spread, j)).flatten();
    let planes = planes.map(|end| format!("{end:.4}"));
    let logs = spread.logs.iter().flat_map(|log| [log.low, log.high]);
    planes.chain(logs.map(|log| format!("{:.6e}", log.exp()))).collect()
}
