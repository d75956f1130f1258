//! What `check` prints for people.

use rotor_edge_desktop::check::Check;
use rotor_edge_desktop::units::rpm;

use super::super::output;
use crate::report::scale::{number, three_digits};

/// Prints a check; margins where the running range was stated.
pub fn print(found: &Check, running: bool) {
    let [from, to] = found.range_rpm;
    println!(
        "{}: {} kg, centre of gravity at {:.4} m",
        found.rotor.name,
        three_digits(found.mass_kg),
        found.centre_of_gravity_m
    );
    let said = if running { "running range" } else { "looked at" };
    println!("{said}: {} to {} rpm", number(from, 0), number(to, 0));
    if let Ok(s) = &found.statics {
        let largest = s.sag_m.iter().copied().fold(0.0, f64::max);
        println!("sags by {} µm at most between its bearings", three_digits(largest * 1e6));
    }
    println!("\nBearings, coefficients at {} rpm (N/m, N·s/m)", number(to, 0));
    output::table(&BEARING_COLUMNS, &bearing_rows(found));
    println!("\nUndamped critical speeds");
    match no_critical_speed(found) {
        Some(why) => println!("  {why}"),
        None => output::table(&CRITICAL_COLUMNS, &critical_rows(found)),
    }
    println!("\nDamped modes at {} rpm", number(to, 0));
    output::table(&MODE_COLUMNS, &mode_rows(found));
    println!("\n{}", stability(found));
    for (trial, _) in &found.responses {
        let each = trial.planes_kg_m.iter().map(|u| u.norm() * 1e6).fold(0.0, f64::max);
        println!(
            "\nResponse to a trial unbalance, {}: {} g·mm at each plane",
            trial.name,
            three_digits(each)
        );
        let rows = peak_rows(found, trial.name);
        if rows.is_empty() {
            println!("  no maximum up to {} rpm", number(1.3 * to, 0));
        } else {
            output::table(&PEAK_COLUMNS, &rows);
        }
    }
    if !found.warnings.is_empty() {
        println!("\nNumbers to look at again");
        for warning in &found.warnings {
            println!("  {warning}");
        }
    }
}

pub const BEARING_COLUMNS: [&str; 12] =
    ["bearing", "load N", "ε", "attitude °", "kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy"];

/// One row a bearing, at the fastest speed.
pub fn bearing_rows(found: &Check) -> Vec<Vec<String>> {
    let absent = || "–".to_string();
    let of = |b: &rotor_edge_desktop::check::BearingCheck| {
        let mut row = vec![b.name.clone(), b.load_n.map_or_else(absent, |l| number(l, 0))];
        let Some(at) = b.at.last() else { return row };
        row.push(at.eccentricity_ratio.map_or_else(absent, |e| format!("{e:.3}")));
        // no −0.0 under a film that gives way straight down
        row.push(at.attitude_deg.map_or_else(absent, |a| format!("{:.1}", (10.0 * a).round() / 10.0 + 0.0)));
        for m in [at.stiffness_n_m, at.damping_n_s_m] {
            row.extend(without_rounding([m.xx, m.xy, m.yx, m.yy]).map(scientific));
        }
        row
    };
    found.bearings.iter().map(of).collect()
}

/// What rounding leaves of terms that cancel, next to their neighbours, is nothing.
fn without_rounding(values: [f64; 4]) -> [f64; 4] {
    let largest = values.iter().fold(0.0_f64, |largest, v| largest.max(v.abs()));
    values.map(|v| if v.abs() < 1e-12 * largest { 0.0 } else { v })
}

fn scientific(value: f64) -> String {
    if value == 0.0 { "0".into() } else { format!("{value:.2e}").replace('-', "−") }
}

pub const CRITICAL_COLUMNS: [&str; 3] = ["critical speed rpm", "turns forward", "damped, log decrement"];

/// Why there is none, if there is none.
pub fn no_critical_speed(found: &Check) -> Option<&'static str> {
    found.critical.is_empty().then_some(
        "None: without damping and without what does work on a closed orbit, the bearings would not hold the shaft, as \
         films that push it out across the load; look at the damped modes.",
    )
}

/// One row an undamped critical speed; beside it the log decrement of the damped mode that has its frequency there.
pub fn critical_rows(found: &Check) -> Vec<Vec<String>> {
    let of = |c: &rotor_edge_desktop::check::critical::Critical| {
        let distance = |m: &rotor_edge_desktop::check::modes::Mode| (m.speed_rad_s - c.speed_rad_s).abs();
        let near = found
            .damped_critical
            .iter()
            .filter(|m| distance(m) < 0.15 * c.speed_rad_s)
            .min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let damped = near.map_or_else(
            || "–".into(),
            |m| format!("{} rpm, {}", number(rpm(m.speed_rad_s), 0), three_digits(m.log_decrement())),
        );
        vec![number(rpm(c.speed_rad_s), 0), format!("{:.0} %", c.forward * 100.0), damped]
    };
    found.critical.iter().map(of).collect()
}

pub const MODE_COLUMNS: [&str; 4] = ["frequency rpm", "of the speed", "log decrement", "whirl"];

/// One row a damped mode at the fastest speed.
pub fn mode_rows(found: &Check) -> Vec<Vec<String>> {
    let last = found.campbell.modes.last().map_or(&[][..], Vec::as_slice);
    let of = |m: &rotor_edge_desktop::check::modes::Mode| {
        vec![
            number(rpm(m.frequency_rad_s()), 0),
            format!("{:.2}", m.frequency_rad_s() / m.speed_rad_s),
            three_digits(m.log_decrement()),
            m.whirl.name().into(),
        ]
    };
    last.iter().map(of).collect()
}

pub fn stability(found: &Check) -> String {
    let [from, to] = found.range_rpm.map(|s| number(s, 0));
    match &found.threshold {
        None => format!("Stable from {from} to {to} rpm: every log decrement is positive."),
        Some(t) if t.from_the_first => {
            format!("Unstable at {from} rpm already: it whirls at {} rpm.", number(rpm(t.frequency_rad_s), 0))
        }
        Some(t) => format!(
            "Unstable from {} rpm on: there it begins to whirl at {} rpm.",
            number(rpm(t.speed_rad_s), 0),
            number(rpm(t.frequency_rad_s), 0)
        ),
    }
}

pub const PEAK_COLUMNS: [&str; 6] =
    ["probe", "peak at rpm", "µm pk-pk", "amplification", "margin %", "needed %"];

/// One row a maximum of a probe.
pub fn peak_rows(found: &Check, trial: &str) -> Vec<Vec<String>> {
    let absent = || "–".to_string();
    let responses = found.responses.iter().filter(|(t, _)| t.name == trial).flat_map(|(_, r)| r);
    responses
        .flat_map(|r| {
            r.peaks.iter().map(|p| {
                vec![
                    r.probe.clone(),
                    number(p.speed_rpm, 0),
                    three_digits(p.amplitude_m * 2e6),
                    p.amplification.map_or_else(absent, |a| format!("{a:.1}")),
                    p.margin_percent.map_or_else(absent, |m| format!("{:.0}", m[0]).replace('-', "−")),
                    p.margin_percent.map_or_else(absent, |m| format!("{:.0}", m[1])),
                ]
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_residue_is_hidden_and_small_terms_are_shown() {
        assert_eq!(without_rounding([3e7, 1.7e-7, -1.7e-7, 2e7]), [3e7, 0.0, 0.0, 2e7]);
        assert_eq!(without_rounding([3e7, 5.0, 0.0, 2e7]), [3e7, 5.0, 0.0, 2e7]);
    }
}
