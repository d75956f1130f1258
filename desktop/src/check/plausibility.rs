//! Numbers that can be read but hardly be meant: wrong units, wrong signs, slipped digits.
//!
//! One sentence each, with the key, the number and what is usual. A warning is no error: there are machines on
//! springs and disks of tungsten.

use nalgebra::Matrix2;

use crate::bearing::dynamic_coefficients::DynamicCoefficients;
use crate::check::system::System;
use crate::machine::drawing::{Bearing, Disk, Rotor};
use crate::shaft::statics::Statics;
use crate::units::{figure, rad_s, rpm, same_place};

/// A bearing that sinks by more than this under its load is softer than any machine's, m.
const DEEPEST_SAG_M: f64 = 2e-3;
/// Stiffer than this is a weld, N/m.
const STIFFEST_N_M: f64 = 2e11;
/// A shaft that sags by more than this part of the distance between its outer bearings: machines are made ten times as stiff.
const MOST_SAG: f64 = 2e-3;
/// Damping of a bearing at running speed relative to its stiffness.
const MOST_DAMPED: f64 = 100.0;
/// Names of the direct coefficients along x and y.
const DIRECT: [&str; 2] = ["xx", "yy"];
/// Fastest rim of a disk, m/s.
const FASTEST_RIM_M_S: f64 = 700.0;
/// A disk of so many shaft masses is one whose unit is wrong.
const MANY_SHAFTS: f64 = 100.0;
/// Running speeds below this share of the first critical speed are unusual where they look like Hz.
const HARDLY_TURNS: f64 = 0.1;
/// No machine with proximity probes is slower; in Hz, this is 30,000 rpm.
const SLOW_RPM: f64 = 500.0;

/// What a check knows besides the drawing.
pub struct CheckContext<'a> {
    pub rotor: &'a Rotor,
    /// The machine as a system.
    pub system: &'a System,
    /// Loads of the bearings, where the shaft can be held.
    pub statics: Option<&'a Statics>,
    /// Mass of the shaft with all that it carries, kg.
    pub mass_kg: f64,
    /// Fastest speed of interest, rpm.
    pub fastest_rpm: f64,
    /// Undamped critical speeds, rad/s.
    pub critical_rad_s: &'a [f64],
}

pub fn warnings(known: &CheckContext) -> Vec<String> {
    let mut all = Vec::new();
    shaft(known.rotor, &mut all);
    let shaft_kg = shaft_mass_kg(known.rotor);
    for d in &known.rotor.disk {
        disk(known, d, shaft_kg, &mut all);
    }
    all.extend(known.statics.and_then(|statics| sag(known.rotor, statics)));
    bearings(known, &mut all);
    speed(known, &mut all);
    probes_and_planes(known, &mut all);
    all
}

fn shaft_mass_kg(rotor: &Rotor) -> f64 {
    let area = |s: &crate::machine::drawing::Segment| {
        std::f64::consts::PI / 4.0 * (s.outer_diameter_m.powi(2) - s.inner_diameter_m.powi(2))
    };
    rotor.shaft.iter().map(|s| s.density_kg_m3 * area(s) * s.length_m).sum()
}

fn shaft(rotor: &Rotor, all: &mut Vec<String>) {
    for (i, s) in rotor.shaft.iter().enumerate() {
        let key = |name: &str| format!("[[shaft]] {} {name}", i + 1);
        let mut unusual = |name: &str, value: f64, low: f64, high: f64, what: &str| {
            if !(low..=high).contains(&value) {
                all.push(format!("{} = {} is unusual: {what}.", key(name), figure(value)));
            }
        };
        unusual(
            "youngs_modulus_pa",
            s.youngs_modulus_pa,
            4e10,
            4.2e11,
            "steel has 2.0e11 to 2.1e11 Pa, aluminium 7e10",
        );
        unusual("density_kg_m3", s.density_kg_m3, 1500.0, 2e4, "steel has 7,850 kg/m³, aluminium 2,700");
        unusual("poisson_ratio", s.poisson_ratio, 0.15, 0.45, "metals have 0.25 to 0.35");
        unusual(
            "outer_diameter_m",
            s.outer_diameter_m,
            2e-3,
            3.0,
            "shafts measure 0.005 to 2 m; is this in millimetres?",
        );
        if s.inner_diameter_m > 0.97 * s.outer_diameter_m {
            all.push(format!(
                "{} = {} leaves a wall of {} m in a shaft of {} m; usual walls are a tenth of the diameter or more.",
                key("inner_diameter_m"),
                figure(s.inner_diameter_m),
                figure(0.5 * (s.outer_diameter_m - s.inner_diameter_m)),
                figure(s.outer_diameter_m)
            ));
        }
    }
    let thickest = rotor.shaft.iter().map(|s| s.outer_diameter_m).fold(0.0, f64::max);
    if thickest > rotor.length_m() {
        all.push(format!(
            "[[shaft]] length_m: the shaft is {} m long and {} m thick; shafts are 5 to 30 diameters long.",
            figure(rotor.length_m()),
            figure(thickest)
        ));
    }
}

fn sag(rotor: &Rotor, statics: &Statics) -> Option<String> {
    let [first_m, last_m] = rotor.span_m();
    let deepest_m = statics.sag_m.iter().copied().fold(0.0, f64::max);
    (deepest_m > MOST_SAG * (last_m - first_m)).then(|| {
        format!(
            "The shaft sags by {} mm under its own weight, {:.2} % of the distance between its bearings; usual are 0.05 % or less. Are \
             the outer_diameter_m radii?",
            figure(1e3 * deepest_m),
            100.0 * deepest_m / (last_m - first_m)
        )
    })
}

fn disk(known: &CheckContext, d: &Disk, shaft_kg: f64, all: &mut Vec<String>) {
    let key = |name: &str| format!("[[disk]] \"{}\" {name}", d.name);
    let (m, tilt, polar) = (d.mass_kg, d.diametral_inertia_kg_m2, d.polar_inertia_kg_m2);
    if polar > 2.0 * tilt * 1.000_1 {
        all.push(format!(
            "{} = {} is more than twice the diametral inertia of {} kg·m², which no body has; a thin disk has twice, \
             a long one less.",
            key("polar_inertia_kg_m2"),
            figure(polar),
            figure(tilt)
        ));
    }
    if m <= 0.0 {
        all.push(format!(
            "{} = {} is a disk without mass; disks weigh 0.01 kg and more.",
            key("mass_kg"),
            figure(m)
        ));
        return;
    }
    if m > MANY_SHAFTS * shaft_kg {
        all.push(format!(
            "{} = {} is {} times the shaft's {} kg; is it in grams? Disks weigh 0.05 to 10 times the shaft.",
            key("mass_kg"),
            figure(m),
            figure(m / shaft_kg),
            figure(shaft_kg)
        ));
    }
    if polar <= 0.0 && tilt <= 0.0 {
        all.push(format!(
            "{} = 0 makes the disk a point without gyroscopic moments; a solid disk of radius r has m r²/2.",
            key("polar_inertia_kg_m2")
        ));
        return;
    }
    let radius_m = (2.0 * polar / m).sqrt();
    let shaft_m = 0.5 * known.rotor.segment_at(d.position_m).outer_diameter_m;
    if radius_m < 0.7 * shaft_m {
        all.push(format!(
            "{} = {} with polar_inertia_kg_m2 = {} is that of a disk of radius {} m, inside of the shaft's {} m; is the \
             mass in grams or the inertia in other units than kg·m²?",
            key("mass_kg"),
            figure(m),
            figure(polar),
            figure(radius_m),
            figure(shaft_m)
        ));
    }
    if radius_m > (2.0 * known.rotor.length_m()).max(40.0 * shaft_m) {
        all.push(format!(
            "{} = {} with mass_kg = {} is that of a disk of radius {} m on a shaft {} m long; is the inertia in other \
             units than kg·m²?",
            key("polar_inertia_kg_m2"),
            figure(polar),
            figure(m),
            figure(radius_m),
            figure(known.rotor.length_m())
        ));
    }
    let rim_m_s = rad_s(known.fastest_rpm) * radius_m;
    if rim_m_s > FASTEST_RIM_M_S {
        all.push(format!(
            "{} = {} is that of a disk of radius {} m, whose rim runs at {} m/s at {} rpm; the fastest wheels reach 500 m/s.",
            key("polar_inertia_kg_m2"),
            figure(polar),
            figure(radius_m),
            figure(rim_m_s),
            figure(known.fastest_rpm)
        ));
    }
}

fn bearings(known: &CheckContext, all: &mut Vec<String>) {
    let speed_rad_s = rad_s(known.fastest_rpm);
    for (i, (b, support)) in known.rotor.bearing.iter().zip(&known.system.model.supports).enumerate() {
        let DynamicCoefficients { stiffness: k, damping: c } = support.law.coefficients(speed_rad_s);
        let load_n = known.statics.map(|s| s.load_n[i]);
        lifted(b, load_n, all);
        for axis in 0..2 {
            stiffness(b, axis, k[(axis, axis)], load_n, all);
            damping(b, axis, [k[(axis, axis)], c[(axis, axis)]], known.fastest_rpm, all);
        }
        cross_coupling(b, &k, all);
    }
    let damps = |s: &crate::model::terms::Support| s.law.coefficients(speed_rad_s).damping.norm() > 0.0;
    if !known.system.model.supports.iter().any(damps) {
        all.push(
            "[[bearing]] damping_n_s_m = 0 at every bearing: amplitudes at critical speeds have no bound. Rolling bearings \
             have 1e2 to 1e3 N·s/m."
                .into(),
        );
    }
}

fn bearing_key(bearing: &Bearing, name: &str) -> String {
    format!("[[bearing]] \"{}\" {name}", bearing.name)
}

/// A bearing that the shaft's weight pulls up.
fn lifted(b: &Bearing, load_n: Option<f64>, all: &mut Vec<String>) {
    if let Some(load) = load_n.filter(|l| *l < 0.0) {
        all.push(format!(
            "{}: the weight of the shaft pulls it up out of this bearing with {} N. Bearing loads normally all point the same \
             way: check the positions, or state what holds the shaft down.",
            bearing_key(b, "position_m"),
            figure(-load)
        ));
    }
}

/// Direct stiffness along x (0) or y (1), N/m.
fn stiffness(b: &Bearing, axis: usize, stiff: f64, load_n: Option<f64>, all: &mut Vec<String>) {
    let key = bearing_key(b, &format!("stiffness_n_m.{}", DIRECT[axis]));
    let sag_m = load_n.map(|l| l / stiff);
    if let Some(sag) = sag_m.filter(|s| stiff > 0.0 && *s > DEEPEST_SAG_M) {
        all.push(format!(
            "{key} = {} would let the shaft sink by {} m under its load of {} N; bearings have 1e6 to 1e9 N/m.",
            figure(stiff),
            figure(sag),
            figure(load_n.unwrap_or_default())
        ));
    } else if stiff > 0.0 && stiff < 1e3 {
        all.push(format!("{key} = {} is very soft; bearings have 1e6 to 1e9 N/m.", figure(stiff)));
    }
    if stiff > STIFFEST_N_M {
        all.push(format!(
            "{key} = {} is stiffer than any bearing; bearings have 1e6 to 1e9 N/m.",
            figure(stiff)
        ));
    }
}

/// Direct stiffness (N/m) and damping (N·s/m) along x (0) or y (1), against each other at the fastest speed.
fn damping(b: &Bearing, axis: usize, [stiff, damp]: [f64; 2], fastest_rpm: f64, all: &mut Vec<String>) {
    let key = bearing_key(b, &format!("damping_n_s_m.{}", DIRECT[axis]));
    let speed_rad_s = rad_s(fastest_rpm);
    if damp < 0.0 {
        all.push(format!(
            "{key} = {} feeds motion instead of damping it; bearings have 1e2 to 1e6 N·s/m.",
            figure(damp)
        ));
    } else if damp * speed_rad_s > MOST_DAMPED * stiff.abs() {
        all.push(format!(
            "{key} = {} makes {} times the stiffness at {} rpm; oil films make 0.5 to 5 times, rolling bearings 0.01.",
            figure(damp),
            figure(damp * speed_rad_s / stiff.abs()),
            figure(fastest_rpm)
        ));
    }
}

/// Cross-coupled stiffness: its size, and the whirl that its signs drive.
fn cross_coupling(b: &Bearing, k: &Matrix2<f64>, all: &mut Vec<String>) {
    let direct = k[(0, 0)].abs().max(k[(1, 1)].abs());
    if k[(0, 1)].abs().max(k[(1, 0)].abs()) > 10.0 * direct {
        all.push(format!(
            "{} = {}, yx = {} are more than ten times the direct stiffness of {} N/m; oil films have at most five times.",
            bearing_key(b, "stiffness_n_m.xy"),
            figure(k[(0, 1)]),
            figure(k[(1, 0)]),
            figure(direct)
        ));
    }
    if k[(0, 1)] < 0.0 && k[(1, 0)] > 0.0 && k[(1, 0)] - k[(0, 1)] > 0.1 * direct {
        all.push(format!(
            "{} = {} with yx = {} drives backward whirl; with rotation from x to y oil films and seals have xy > 0 > yx: \
             are the axes those of a machine that turns the other way?",
            bearing_key(b, "stiffness_n_m.xy"),
            figure(k[(0, 1)]),
            figure(k[(1, 0)])
        ));
    }
}

fn speed(known: &CheckContext, all: &mut Vec<String>) {
    let first_rpm = known.critical_rad_s.first().map(|w| rpm(*w));
    if let Some(first) = first_rpm
        && known.fastest_rpm > 0.0
        && known.fastest_rpm < SLOW_RPM
        && known.fastest_rpm < HARDLY_TURNS * first
    {
        all.push(format!(
            "fastest_rpm = {} is far below the first critical speed of {} rpm; is it in Hz? {} Hz are {} rpm.",
            figure(known.fastest_rpm),
            figure(first),
            figure(known.fastest_rpm),
            figure(60.0 * known.fastest_rpm)
        ));
    }
}

fn probes_and_planes(known: &CheckContext, all: &mut Vec<String>) {
    let rotor = known.rotor;
    for p in &rotor.probe {
        let Some(own) = rotor.bearing.iter().find(|b| b.name == p.bearing) else { continue };
        let distance = |z: f64| (p.position_m - z).abs();
        let nearest =
            rotor.bearing.iter().min_by(|a, b| distance(a.position_m).total_cmp(&distance(b.position_m)));
        if let Some(nearest) = nearest.filter(|n| n.name != own.name) {
            all.push(format!(
                "[[probe]] \"{}\" position_m = {} is nearer to bearing \"{}\" than to its own bearing \"{}\"; probes sit within \
                 a few diameters of their bearing.",
                p.name,
                figure(p.position_m),
                nearest.name,
                own.name
            ));
        }
    }
    for (i, a) in rotor.probe.iter().enumerate() {
        let twin = rotor.probe[..i].iter().find(|b| {
            same_place(a.position_m, b.position_m) && (a.angle_deg - b.angle_deg).rem_euclid(180.0) < 1e-6
        });
        if let Some(b) = twin {
            all.push(format!(
                "[[probe]] \"{}\" angle_deg = {} looks along the same line as probe \"{}\"; a pair stands 90° apart.",
                a.name,
                figure(a.angle_deg),
                b.name
            ));
        }
    }
    for p in &rotor.plane {
        let Some(unbalance) = p.unbalance_g_mm else { continue };
        let grade_mm_s = unbalance * 1e-3 / known.mass_kg * rad_s(known.fastest_rpm);
        if grade_mm_s > 250.0 {
            all.push(format!(
                "[[plane]] \"{}\" unbalance_g_mm = {} is a balance quality of G {} at {} rpm; machines with probes run at G 1 \
                 to G 16.",
                p.name,
                figure(unbalance),
                figure(grade_mm_s),
                figure(known.fastest_rpm)
            ));
        }
    }
}
