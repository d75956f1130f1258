//! Weights from the trial runs of a rotor's file alone, with its noise and its grade.

use nalgebra::Complex;

use super::choice::candidates;
use super::influence::contradiction::{AgreeingRuns, Contradiction};
use super::influence::trials::{MeasuredPhasor, TrialReading, Trials};
use super::influence::{normal_equations, stacked};
use super::interpolated::{Interpolated, interpolated};
use super::scatter::of_coefficients;
use super::speeds::Speeds;
use super::{BalancePlan, Balanced, SpeedVibration, Squares};
use crate::error::Error;
use crate::grade::{Grade, Rigid};
use crate::machine::drawing::{Noise, Rotor};
use crate::measurement::Reading;
use crate::unbalance::{G_MM, phasor_kg_m};
use crate::units::same_place;

type C = Complex<f64>;

/// The runs as equations, in m and kg·m.
fn trials(rotor: &Rotor, readings: &[Reading], plan: &BalancePlan) -> Trials {
    let run = |r: &Reading| rotor.run.iter().position(|run| Some(&run.name) == r.run.as_ref());
    let added = |r: &Reading| run(r).map_or(&[][..], |run| &rotor.run[run].added_unbalance);
    let mut positions_m = plan.positions_m(rotor);
    for a in readings.iter().flat_map(added) {
        if !positions_m.iter().any(|z| same_place(*z, a.position_m)) {
            positions_m.push(a.position_m);
        }
    }
    let weight = |r: &Reading, z: f64| {
        let here = added(r).iter().filter(|a| same_place(a.position_m, z));
        here.map(|a| phasor_kg_m(a.magnitude_g_mm, a.angle_deg)).sum::<C>()
    };
    let noise = Noise::of(rotor, readings);
    let value = |phasor: C| MeasuredPhasor { phasor, sigma: noise.sigma_m(phasor) };
    let [from, to] = plan.range_rpm;
    let within = || readings.iter().filter(|r| (from..=to).contains(&r.speed_rpm));
    let run_number = |r: &Reading| run(r).unwrap_or(rotor.run.len());
    let at: Vec<(usize, f64)> = within().map(|r| (run_number(r), r.speed_rpm)).collect();
    let speeds = Speeds::new(&at, plan.same_speed);
    let trial = |(r, speed): (&Reading, &usize)| TrialReading {
        run: run_number(r),
        speed: *speed,
        weights: positions_m.iter().map(|z| weight(r, *z)).collect(),
        probes: r.probes.iter().map(|y| y.map(value)).collect(),
    };
    let place = |(k, z): (usize, &f64)| match plan.planes.get(k) {
        Some(plane) => rotor.plane[*plane].name.clone(),
        None => format!("at {z} m"),
    };
    Trials {
        readings: within().zip(&speeds.of).map(trial).collect(),
        places: positions_m.iter().enumerate().map(place).collect(),
        planes: plan.planes.len(),
        probes: rotor.probe.iter().map(|p| p.name.clone()).collect(),
        speeds,
        runs: rotor.run.iter().map(|run| run.name.clone()).chain([String::new()]).collect(),
        is_noise_known: true,
        untried_is_nothing: false,
        onto: None,
    }
}

/// Weights from trial runs alone.
///
/// # Errors
/// One sentence if the trial runs do not hold the coefficients of the chosen planes, or contradict the sign of the phases.
pub fn from_trial_runs(rotor: &Rotor, readings: &[Reading], plan: &BalancePlan) -> Result<Balanced, Error> {
    let common = plan.interpolate.then(|| interpolated(readings)).transpose()?;
    let readings = common.as_ref().map_or(readings, |common| &common.readings);
    let mut remarks: Vec<String> = common.iter().map(Interpolated::remark).collect();
    let AgreeingRuns { fit: fitted, contradiction } = trials(rotor, readings, plan).fit()?;
    remarks.extend(contradiction.iter().map(Contradiction::doubt));
    let coefficients = &fitted.coefficients;
    let names = plan.names(rotor);
    let (limits, criterion) = (plan.limits_kg_m(&names), plan.wanted.criterion);
    let equations = normal_equations(coefficients);
    let inverse = equations.inverse(&names)?;
    let (per_weight, before) = stacked(coefficients);
    let all = candidates(criterion, &equations, (&per_weight, &before), &limits)?;
    let choice = plan.chosen(&names, &all, &per_weight, &before);
    remarks.extend(choice.doubt());
    let in_kg_m = |g_mm: &[C]| g_mm.iter().map(|u| u / G_MM).collect::<Vec<C>>();
    let (wanted, placed) = (in_kg_m(&choice.wanted_g_mm), in_kg_m(&choice.sums_g_mm()));
    let sd_kg_m = of_coefficients(coefficients, criterion, &limits, &inverse, &wanted)?;
    let none = vec![C::from(0.0); placed.len()];
    let (mut vibration, mut all): (Vec<SpeedVibration>, Squares) = Default::default();
    for at_speed in coefficients.chunk_by(|a, b| a.speed_rpm == b.speed_rpm) {
        let mut here = Squares::default();
        for c in at_speed {
            let noise = [c.variance(&none), c.variance(&placed)].map(|v| 2.0 * v);
            let after = c.under(&placed).norm_sqr();
            here.add([c.before.norm_sqr() - noise[0], after - noise[1], noise[1]], 1);
        }
        vibration.push(here.at_speed(at_speed[0].speed_rpm));
        all.add(here.m2, here.count);
    }
    let rigid = Rigid::of(rotor);
    let positions = plan.positions_m(rotor);
    let with = |u: Vec<C>| positions.iter().copied().zip(u).collect::<Vec<_>>();
    let left = placed.iter().zip(wanted.iter()).map(|(w, u)| w - u).collect();
    let after_mm_s = rigid.grade_mm_s(&with(left), plan.service_rpm);
    let deviations: Vec<(f64, f64)> = positions.iter().copied().zip(sd_kg_m.iter().copied()).collect();
    let grade = Grade {
        before_mm_s: rigid.grade_mm_s(&with(wanted.iter().map(|u| -u).collect()), plan.service_rpm),
        after_mm_s,
        after_at_most_mm_s: after_mm_s + rigid.hidden_mm_s(&deviations, plan.service_rpm),
    };
    Ok(Balanced {
        wanted_kg_m: wanted,
        sd_kg_m,
        placed: choice.fillings,
        vibration,
        overall: all.overall(),
        grade,
        misfit: fitted.misfit,
        remarks,
    })
}
