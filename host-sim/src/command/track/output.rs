//! What `track` writes: one JSON object, and every estimate as CSV.

use std::path::Path;

use anyhow::Result;
use nalgebra::Complex;
use rotor_edge_desktop::forecast::known;
use rotor_edge_desktop::forecast::series::EVENT;
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::track::{
    CredibleIntervals, Event, Flag, FlagCause, Interval, JointFindings, ReadingEstimate, Reidentified, Track,
};
use rotor_edge_desktop::unbalance::{G_MM, g_mm_deg, static_and_dynamic};
use rotor_edge_desktop::whole_file;
use serde_json::{Value, json};

use super::super::dates::{Dates, TIME};
use super::names::{coefficient_names, method_name, scope_name};
use super::sampling;

fn vector(u: Complex<f64>) -> Value {
    let [unbalance_g_mm, angle_deg] = g_mm_deg(u);
    json!({ "unbalance_g_mm": unbalance_g_mm, "angle_deg": angle_deg })
}

fn planes(rotor: &Rotor, unbalance_kg_m: &[Complex<f64>]) -> Vec<Value> {
    let plane = |(p, u): (&rotor_edge_desktop::machine::drawing::Plane, &Complex<f64>)| {
        let mut value = vector(*u);
        value["name"] = json!(p.name);
        value
    };
    rotor.plane.iter().zip(unbalance_kg_m).map(plane).collect()
}

/// When an event took place, and how sure that is.
pub fn when(event: &Event, dates: Dates) -> String {
    let Interval { low, high } = event.interval_d;
    if low == high {
        dates.day(event.time_d)
    } else {
        format!("{} (95 %: {low:.0} to {high:.0})", dates.day(event.time_d))
    }
}

/// What the joint method learned, for people.
pub fn print_joint(rotor: &Rotor, joint: &JointFindings, dates: Dates) {
    println!("\nEvents");
    for e in &joint.events {
        let changed = scope_name(rotor, e.scope);
        println!("  {}: {changed} changed (log evidence {:.0})", when(e, dates), e.evidence);
    }
    if joint.events.is_empty() {
        println!("  None.");
    }
    if !joint.effects.is_empty() {
        println!("  The later run-up shows {}.", joint.effects.join(", "));
    }
    if !joint.left_out_d.is_empty() {
        let days: Vec<String> = joint.left_out_d.iter().map(|d| format!("{d:.0}")).collect();
        println!("  Left out as passing disturbances: day {}.", days.join(", "));
    }
    println!("\nBearings: constant part, ± %, and wander that fades in {:.1} days", joint.walk_days);
    let names = coefficient_names(rotor);
    for (since, constants) in &joint.constants {
        println!("  from {}", dates.day(*since));
        for ((name, c), wander) in names.iter().zip(constants).zip(&joint.walk_sd) {
            let origin = if c.from_data { "the data" } else { "its prior, the data do not tell" };
            println!(
                "    {name:<12} {:>11.4e} ± {:>4.1}, wander {:>4.1}   {origin}",
                c.log.exp(),
                100.0 * c.sd,
                100.0 * wander
            );
        }
    }
}

fn joint_json(rotor: &Rotor, joint: &JointFindings, dates: Dates) -> Value {
    let names = coefficient_names(rotor);
    let event = |e: &Event| {
        json!({
            "time_d": e.time_d,
            "time": dates.iso(e.time_d),
            "interval_95_d": [e.interval_d.low, e.interval_d.high],
            "changed": scope_name(rotor, e.scope),
            "log_evidence": e.evidence,
        })
    };
    let state = |(since_d, constants): &(f64, Vec<rotor_edge_desktop::track::ConstantPart>)| {
        let one = |(name, c): (&String, &rotor_edge_desktop::track::ConstantPart)| json!({ "name": name, "value": c.log.exp(), "relative_sd": c.sd, "from_data": c.from_data });
        json!({ "since_d": since_d, "bearings": names.iter().zip(constants).map(one).collect::<Vec<_>>() })
    };
    json!({
        "events": joint.events.iter().map(event).collect::<Vec<_>>(),
        "states": joint.constants.iter().map(state).collect::<Vec<_>>(),
        "wander_relative_sd": names.iter().cloned().zip(joint.walk_sd.iter().map(|w| json!(w)))
            .collect::<serde_json::Map<_, _>>(),
        "wander_days": joint.walk_days,
        "left_out_d": joint.left_out_d,
        "effects": joint.effects,
    })
}

/// What `track --json` prints.
pub fn summary(rotor: &Rotor, track: &Track, dates: Dates) -> Value {
    let sum: f64 = track.estimates.iter().map(|e| e.residual.e_um).sum();
    let ratio = |keep: &dyn Fn(&&ReadingEstimate) -> bool| {
        let kept: Vec<f64> = track.estimates.iter().filter(keep).map(|e| e.residual.ratio()).collect();
        (!kept.is_empty()).then(|| kept.iter().sum::<f64>() / kept.len() as f64)
    };
    let event_d = track.event_d.unwrap_or(f64::INFINITY);
    let [whole, after_event] = track.reduction();
    json!({
        "method": method_name(track.method),
        "readings": track.estimates.len(),
        "residual_um": { "mean": sum / track.estimates.len() as f64, "sum": sum },
        "residual_ratio": {
            "before_event": ratio(&|e| e.time_d < event_d),
            "after_event": ratio(&|e| e.time_d >= event_d),
        },
        "begin": dates.iso(0.0),
        "event_d": track.event_d,
        "reduction_against_fixed": { "whole": whole, "after_event": after_event },
        "flags": track.flags.iter().map(|f| flag(rotor, f, dates)).collect::<Vec<_>>(),
        "reidentified": track.reidentified.iter().map(|r| reidentified(rotor, r)).collect::<Vec<_>>(),
        "estimates": track.estimates.iter().map(|e| estimate(rotor, e, dates)).collect::<Vec<_>>(),
        "sampling": track.sampling.as_ref().map(sampling::json),
        "joint": track.joint.as_ref().map(|j| joint_json(rotor, j, dates)),
        "undiagnosed_since_d": track.undiagnosed_since_d,
        "remarks": track.remarks,
    })
}

/// What an event leaves open until a run-up has been seen, if it does.
pub fn undiagnosed(track: &Track, dates: Dates) -> Option<String> {
    let since = track.undiagnosed_since_d?;
    let mut events = track.joint.iter().flat_map(|joint| &joint.events);
    let taken_as = if events.any(|e| e.time_d == since && e.scope.elsewhere) {
        "is nothing that bearings or unbalance explain, as a seal or a bow would be. The unbalance is taken to go on from \
         where it was; a run-up since then would tell what it is."
    } else {
        "is taken to be bearings. Near one speed an effect that the file lacks looks the same, and the unbalance may then \
         be off by more than its interval; a run-up since then would tell."
    };
    Some(format!("What changed on {} {taken_as}", dates.day(since)))
}

fn flag(rotor: &Rotor, flag: &Flag, dates: Dates) -> Value {
    let cause = match flag.cause {
        FlagCause::Model => "model",
        FlagCause::Unbalance => "unbalance",
    };
    json!({
        "since_d": flag.since_d,
        "time_d": flag.time_d,
        "time": dates.iso(flag.time_d),
        "suspect": rotor.bearing[flag.suspect].name,
        "cause": cause,
    })
}

fn reidentified(rotor: &Rotor, r: &Reidentified) -> Value {
    let case = |c: &rotor_edge_desktop::track::CaseFit| {
        json!({
            "case": c.case,
            "residual_um": c.residual_um,
            "unknowns": c.unknowns,
            "criterion": c.criterion,
            "bearings": bearings(rotor, &c.logs),
            "planes": planes(rotor, &c.unbalance_kg_m),
        })
    };
    json!({
        "since_d": r.since_d,
        "time_d": r.time_d,
        "case": r.case,
        "bearing": rotor.bearing[r.bearing].name,
        "bearings": bearings(rotor, &r.logs),
        "cases": r.cases.iter().map(case).collect::<Vec<_>>(),
    })
}

fn bearings(rotor: &Rotor, logs: &[f64]) -> Value {
    coefficient_names(rotor)
        .into_iter()
        .zip(logs.iter().map(|log| json!(log.exp())))
        .collect::<serde_json::Map<_, _>>()
        .into()
}

fn estimate(rotor: &Rotor, e: &ReadingEstimate, dates: Dates) -> Value {
    let [fixed, couple] = static_and_dynamic(&rotor.plane_positions_m(), &e.unbalance_kg_m);
    json!({
        "time_d": e.time_d,
        "time": dates.iso(e.time_d),
        "planes": planes(rotor, &e.unbalance_kg_m),
        "static": vector(fixed),
        "dynamic": vector(couple),
        "residual_um": e.residual.e_um,
        "residual_ratio": e.residual.ratio(),
        "flagged": e.flagged,
        "interval_95": e.spread.as_ref().map(|s| interval_json(rotor, s)),
    })
}

fn interval_json(rotor: &Rotor, spread: &CredibleIntervals) -> Value {
    let plane = |(j, p): (usize, &rotor_edge_desktop::machine::drawing::Plane)| {
        let [unbalance_g_mm, angle_deg] = plane_ends(spread, j);
        json!({ "name": p.name, "unbalance_g_mm": unbalance_g_mm, "angle_deg": angle_deg })
    };
    let names = coefficient_names(rotor).into_iter();
    let bearings = names.zip(&spread.logs).map(|(name, log)| (name, json!([log.low.exp(), log.high.exp()])));
    json!({
        "planes": rotor.plane.iter().enumerate().map(plane).collect::<Vec<_>>(),
        "bearings": bearings.collect::<serde_json::Map<_, _>>(),
    })
}

/// Ends of a plane's unbalance, g·mm, and of its angle, degrees.
fn plane_ends(spread: &CredibleIntervals, plane: usize) -> [[f64; 2]; 2] {
    let (size, angle) = (spread.magnitude_kg_m[plane], spread.angle_rad[plane]);
    [[size.low.max(0.0) * G_MM, size.high * G_MM], [angle.low.to_degrees(), angle.high.to_degrees()]]
}

pub fn plane_interval(spread: &CredibleIntervals, plane: usize) -> String {
    let [[from, to], [first, last]] = plane_ends(spread, plane);
    format!("   (95 %: {from:.1} to {to:.1}, {first:.0}° to {last:.0}°)")
}

/// Writes every estimate, whole or not at all.
///
/// # Errors
/// If the file cannot be written.
pub fn csv(path: &Path, rotor: &Rotor, track: &Track, dates: Dates) -> Result<()> {
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
    writer.write_record(&head)?;
    for (i, e) in track.estimates.iter().enumerate() {
        let before_d = if i == 0 { f64::NEG_INFINITY } else { track.estimates[i - 1].time_d };
        let is_event = track.flags.iter().any(|f| before_d < f.since_d && f.since_d <= e.time_d);
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
