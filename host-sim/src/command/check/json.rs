//! What `check --json` prints.

use rotor_edge_desktop::check::{BearingCheck, Check, SpeedCheck};
use rotor_edge_desktop::units::rpm;
use serde_json::{Value, json};

/// One object; SI units but for speeds and frequencies, which are in rpm.
pub fn of(found: &Check) -> Value {
    let statics = found.statics.as_ref().ok();
    json!({
        "name": found.rotor.name,
        "mass_kg": found.mass_kg,
        "centre_of_gravity_m": found.centre_of_gravity_m,
        "largest_sag_m": statics.map(|s| s.sag_m.iter().copied().fold(0.0, f64::max)),
        "range_rpm": found.range_rpm,
        "critical_speeds_rpm": found.critical.iter().map(|c| rpm(c.speed_rad_s)).collect::<Vec<_>>(),
        "critical_speeds_forward": found.critical.iter().map(|c| c.forward).collect::<Vec<_>>(),
        "damped_critical_speeds": found.damped_critical.iter().map(mode).collect::<Vec<_>>(),
        "critical_speed_map": {
            "stiffness_n_m": found.map.stiffness_n_m,
            "own_n_m": found.map.own_n_m,
            "speeds_rpm": found.map.speed_rad_s.iter().map(|all| all.iter().map(|s| rpm(*s)).collect()).collect::<Vec<Vec<_>>>(),
        },
        "modes": found.campbell.modes.iter().flatten().map(mode).collect::<Vec<_>>(),
        "stability_threshold": found.threshold.as_ref().map(|t| json!({
            "speed_rpm": rpm(t.speed_rad_s),
            "frequency_rpm": rpm(t.frequency_rad_s),
            "from_the_first": t.from_the_first,
        })),
        "bearings": found.bearings.iter().map(bearing).collect::<Vec<_>>(),
        "unbalance": found.responses.iter().map(|(trial, responses)| json!({
            "trial": trial.name,
            "planes": found.rotor.plane.iter().zip(&trial.planes_kg_m).map(|(p, u)| json!({
                "name": p.name, "unbalance_g_mm": u.norm() * 1e6, "angle_deg": u.arg().to_degrees(),
            })).collect::<Vec<_>>(),
            "probes": responses.iter().map(|r| json!({
                "name": r.probe,
                "peaks": r.peaks.iter().map(|p| json!({
                    "speed_rpm": p.speed_rpm,
                    "amplitude_um": p.amplitude_m * 1e6,
                    "amplification": p.amplification,
                    "margin_percent": p.margin_percent.map(|m| m[0]),
                    "needed_percent": p.margin_percent.map(|m| m[1]),
                })).collect::<Vec<_>>(),
            })).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "warnings": found.warnings,
    })
}

fn mode(m: &rotor_edge_desktop::check::modes::Mode) -> Value {
    json!({
        "speed_rpm": rpm(m.speed_rad_s),
        "frequency_rpm": rpm(m.frequency_rad_s()),
        "log_decrement": m.log_decrement(),
        "whirl": m.whirl.name(),
    })
}

fn bearing(b: &BearingCheck) -> Value {
    // films are stated at the fastest speed that was asked for
    let film = b.at.last();
    json!({
        "name": b.name,
        "load_n": b.load_n,
        "eccentricity_ratio": film.and_then(|a| a.eccentricity_ratio),
        "attitude_deg": film.and_then(|a| a.attitude_deg),
        "coefficients": b.at.iter().map(coefficients).collect::<Vec<_>>(),
    })
}

fn coefficients(a: &SpeedCheck) -> Value {
    let (k, c) = (a.stiffness_n_m, a.damping_n_s_m);
    json!({
        "speed_rpm": a.speed_rpm,
        "kxx": k.xx, "kxy": k.xy, "kyx": k.yx, "kyy": k.yy,
        "cxx": c.xx, "cxy": c.xy, "cyx": c.yx, "cyy": c.yy,
        "eccentricity_ratio": a.eccentricity_ratio, "attitude_deg": a.attitude_deg,
    })
}
