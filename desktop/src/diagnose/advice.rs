//! Which measurement would tell rivals apart: simulate them at candidate measurements and see where they
//! differ most against the noise.

use nalgebra::{Complex, DVector};

use super::answer::Advice;
use super::as_file::as_file;
use super::base::{BaseModel, CandidateFit};
use super::rank::Ranking;
use crate::fit::hypothesis::PlacedEffect;
use crate::fit::starts_for;
use crate::machine::drawing::{Bearing, Mount, Noise, Probe, Rotor};
use crate::reduction::basis;
use crate::reduction::sizes::SIMULATED;
use crate::unbalance::g_mm_deg;
use crate::units::{rad_s, rpm};

/// Rivals that are simulated at most.
const MOST_RIVALS: usize = 5;
/// Speeds of a simulated run-up.
const RUN_UP_SPEEDS: usize = 25;
/// Standard deviations by which rivals must differ to be told apart for sure.
const APART: f64 = 5.0;
/// Repetitions above which a measurement is not worth making.
const MOST_REPEATS: f64 = 30.0;

/// How far beyond the fastest measured speed advice goes where no rated speed is stated. What a machine was measured at it
/// may run at, and the overspeed trip of a gas turbine is set at 105 % of the maximum continuous speed (API 616); other
/// drivers' are no lower.
const WITHIN_TRIP: f64 = 1.05;

/// The fastest speed that is ever advised, rpm.
pub fn reach_rpm(base: &BaseModel) -> f64 {
    let rated = base.fitter.rotor.rated.map(|rated| rated.speed_rpm[1]);
    rated.unwrap_or_else(|| WITHIN_TRIP * rpm(base.fitter.data.fastest_rad_s()))
}

/// Advice where no simulated measurement distinguishes the rivals.
pub fn another_kind(base: &BaseModel) -> String {
    let further = match base.fitter.rotor.rated {
        Some(_) => "",
        None => "; or state how fast the machine may run, [rated] speed_rpm, and faster run-ups are tried",
    };
    format!(
        "Nothing that was tried up to {:.0} rpm tells the rivals apart: no run-up, slow roll, trial weight in a plane or pair of \
         probes at a disk. It takes another kind of measurement: a trial weight where there is no plane, a probe elsewhere \
         on the shaft or on a pedestal, the keyphasor checked with a strobe{further}.",
        reach_rpm(base)
    )
}

/// A measurement that could be made.
#[derive(Clone)]
pub struct Measurement {
    pub name: String,
    pub speeds_rpm: Vec<f64>,
    /// Probes that are there beside the machine's own.
    pub extra: Vec<Probe>,
    /// Weight added to a plane, kg·m.
    pub weight: Option<(usize, Complex<f64>)>,
}

/// What would tell the rivals of a ranking apart, as they were fitted.
pub fn between_fits(
    base: &BaseModel,
    tried: &[CandidateFit],
    ranking: &Ranking,
    noise: &Noise,
) -> Vec<Advice> {
    let many = ranking.rivals.clamp(2, MOST_RIVALS);
    let fitted = |t: &CandidateFit| as_file(&base.hypothesis.with(t.placed), &t.fit);
    advise(base, &tried.iter().take(many).map(fitted).collect::<Vec<_>>(), noise)
}

/// What would show effects that the data cannot show at all, at the strengths that searches start from.
pub fn between_typical(base: &BaseModel, possible: &[PlacedEffect], noise: &Noise) -> Vec<Advice> {
    let typical = |a: &PlacedEffect| {
        let with = base.hypothesis.with(*a);
        let start = starts_for(&base.hypothesis, &base.fit, *a).into_iter().next()?;
        // effects that are linear unknowns have no strength of their own to start from
        let mut fit = base.fit.clone();
        fit.x = start;
        with.unknowns().is_empty().then(|| as_file(&with, &fit))
    };
    let rivals: Vec<Rotor> = possible.iter().filter_map(typical).collect();
    // spread over the list, as neighbours in it are the same effect at the next place
    let every = rivals.len().div_ceil(MOST_RIVALS).max(1);
    let mut advice = advise(base, &rivals.into_iter().step_by(every).collect::<Vec<_>>(), noise);
    // real strengths are not known yet, so neither is how often to repeat
    advice.iter_mut().for_each(|a| a.repeats = 1);
    advice
}

/// Candidate measurements, fewest repetitions and least effort first; those that would not help are left
/// out.
fn advise(base: &BaseModel, rivals: &[Rotor], noise: &Noise) -> Vec<Advice> {
    if rivals.len() < 2 {
        return Vec::new();
    }
    let mut advice: Vec<Advice> = measurements(base, base.fitter.rotor)
        .into_iter()
        .filter_map(|m| {
            let (separation_sd, speed_rpm) = separation(base, rivals, &m, noise)?;
            // averaging n readings lowers the noise by √n
            let repeats = (APART / separation_sd).powi(2).ceil().max(1.0);
            (repeats <= MOST_REPEATS).then_some(Advice {
                measurement: m.name,
                separation_sd,
                speed_rpm,
                repeats: repeats as usize,
            })
        })
        .collect();
    // measurements come in the order of their effort; the sort is stable
    advice.sort_by_key(|a| a.repeats);
    advice
}

/// Measurements that one could go on with, least effort first.
pub fn measurements(base: &BaseModel, rotor: &Rotor) -> Vec<Measurement> {
    let rows = &base.fitter.data.rows;
    let fastest = rpm(base.fitter.data.fastest_rad_s()).min(reach_rpm(base));
    let slowest = rpm(rows.iter().map(|r| r.speed_rad_s).fold(f64::INFINITY, f64::min));
    let run_up: Vec<f64> =
        (1..=RUN_UP_SPEEDS).map(|k| fastest * (0.1 + 0.9 * k as f64 / RUN_UP_SPEEDS as f64)).collect();
    let plain = |name: String, speeds_rpm: Vec<f64>| Measurement {
        name,
        speeds_rpm,
        extra: Vec::new(),
        weight: None,
    };
    let mut all = Vec::new();
    if slowest > 0.5 * fastest {
        all.push(plain(format!("a run-up from {:.0} to {fastest:.0} rpm", 0.1 * fastest), run_up.clone()));
        all.push(plain(format!("a second speed, {:.0} rpm", 0.6 * fastest), vec![0.6 * fastest]));
    }
    all.push(plain(format!("a slow roll at {:.0} rpm", 0.3 * slowest), vec![0.3 * slowest]));
    let reach = reach_rpm(base);
    if reach > fastest {
        let further =
            (1..=RUN_UP_SPEEDS).map(|k| fastest + (reach - fastest) * k as f64 / RUN_UP_SPEEDS as f64);
        let name = format!("a run-up on to {reach:.0} rpm, if the machine allows it");
        all.push(plain(name, further.collect()));
    }
    for (i, plane) in rotor.plane.iter().enumerate() {
        let u = base.fit.unknowns[i];
        let weight = Complex::new(0.0, 1.0) * u;
        let [magnitude, angle] = g_mm_deg(weight);
        all.push(Measurement {
            name: format!(
                "a run-up with a trial weight of {magnitude:.0} g·mm at {angle:.0}° in plane {}",
                plane.name
            ),
            speeds_rpm: run_up.clone(),
            extra: Vec::new(),
            weight: Some((i, weight)),
        });
    }
    for disk in &rotor.disk {
        all.push(Measurement {
            name: format!("a run-up with a further X/Y pair of probes at {}", disk.name),
            speeds_rpm: run_up.clone(),
            extra: pair_at(rotor, &disk.name, disk.position_m),
            weight: None,
        });
    }
    all
}

/// A further pair of X/Y probes on the ground, at the nearest bearing.
pub fn pair_at(rotor: &Rotor, name: &str, position_m: f64) -> Vec<Probe> {
    let distance = |b: &&Bearing| (b.position_m - position_m).abs();
    let nearest = rotor.bearing.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
    let probe = |angle_deg: f64| Probe {
        name: format!("at {name} {angle_deg}"),
        bearing: nearest.map_or_else(String::new, |b| b.name.clone()),
        position_m,
        angle_deg,
        used: true,
        mount: Mount::Ground,
        gap: None,
    };
    vec![probe(0.0), probe(90.0)]
}

/// Distance of the best rival from the most alike other one, and the speed of the largest difference.
/// What the rivals already differ by in the data at hand is no gain, so a trial weight counts by the
/// change that it makes.
fn separation(base: &BaseModel, rivals: &[Rotor], m: &Measurement, noise: &Noise) -> Option<(f64, f64)> {
    let own = base.fitter.rotor.probe.len();
    let seen: Option<Vec<Vec<DVector<Complex<f64>>>>> =
        rivals.iter().map(|rotor| simulate(rotor, m)).collect();
    let seen = seen?;
    let mut least = (f64::INFINITY, 0.0);
    for other in &seen[1..] {
        let (mut total, mut largest) = (0.0, (0.0, 0.0));
        for (k, speed_rpm) in m.speeds_rpm.iter().enumerate() {
            let (a, b) = (&seen[0][k], &other[k]);
            // with extra probes only those are new; the machine's own were tried already
            let fresh = if m.extra.is_empty() { 0..own } else { own..a.len() };
            let distance: f64 = fresh.map(|p| (a[p] - b[p]).norm_sqr() / noise.sigma_m(a[p]).powi(2)).sum();
            total += distance;
            if distance > largest.0 {
                largest = (distance, *speed_rpm);
            }
        }
        if total.sqrt() < least.0 {
            least = (total.sqrt(), largest.1);
        }
    }
    Some(least)
}

fn simulate(rotor: &Rotor, m: &Measurement) -> Option<Vec<DVector<Complex<f64>>>> {
    let mut rotor = rotor.clone();
    rotor.probe.extend(m.extra.iter().cloned());
    for e in &mut rotor.effect {
        // a vector for each probe; those that are not there yet have no runout
        if let Some(crate::machine::drawing::ParameterValue::Phasors(all)) = e.parameters.get_mut("v") {
            all.resize(rotor.probe.len(), [0.0; 2]);
        }
    }
    let model = basis::reduced(&rotor, SIMULATED);
    let planes = rotor.plane.iter();
    let mut u = DVector::from_iterator(
        rotor.plane.len(),
        planes.map(|p| {
            crate::unbalance::phasor_kg_m(p.unbalance_g_mm.unwrap_or(0.0), p.angle_deg.unwrap_or(0.0))
        }),
    );
    if let Some((plane, weight)) = m.weight {
        u = DVector::zeros(u.len());
        u[plane] = weight;
    }
    let forced = m.weight.is_none();
    m.speeds_rpm
        .iter()
        .map(|rpm| {
            let response = model.response_under(rad_s(*rpm), &u).ok()?;
            Some(if forced { response.at(&u) } else { &response.per_unbalance * &u })
        })
        .collect()
}
