//! Is the data fit to be diagnosed? Dead or clipped probes, reversed phases, another machine.

use nalgebra::Complex;

use super::base::BaseModel;
use crate::compare::{ProbePair, probe_pairs};
use crate::error::Error;
use crate::fit::{Effort, Fitter};
use crate::grade::{largest_plausible_g_mm, permissible_g_mm};
use crate::machine::bearings::Bearings;
use crate::machine::drawing::{Noise, Rotor};
use crate::measurement::Reading;

/// A probe whose readings differ by less than this, relative, is stuck.
const STUCK: f64 = 1e-6;
/// Readings at one and the same largest amplitude that make a probe clipped.
const CLIPPED_READINGS: usize = 4;
/// A fit takes some milliseconds for each reading: these are minutes.
const MOST_READINGS: usize = 20_000;
/// Relative error at which a model with its bearings free describes some other machine.
const ANOTHER_MACHINE: f64 = 0.8;

/// Checks that need no model; remarks on what is odd but usable.
///
/// # Errors
/// If a probe is dead or clipped, or there is nothing to fit.
pub fn before(rotor: &Rotor, readings: &[Reading]) -> Result<Vec<String>, Error> {
    rotor.validate()?;
    let mut remarks = Vec::new();
    for (p, probe) in rotor.probe.iter().enumerate() {
        let seen: Vec<Complex<f64>> = readings.iter().filter_map(|r| r.probes[p]).collect();
        let Some(first) = seen.first() else {
            return Err(Error::SilentProbe { probe: probe.name.clone() });
        };
        let largest = seen.iter().map(|y| y.norm()).fold(0.0, f64::max);
        if seen.len() > 2 && seen.iter().all(|y| (y - first).norm() <= STUCK * largest) {
            return Err(Error::StuckProbe { probe: probe.name.clone() });
        }
        let at_top = seen.iter().filter(|y| y.norm() > largest * (1.0 - STUCK)).count();
        if at_top >= CLIPPED_READINGS {
            let level_um = largest * 1e6;
            return Err(Error::ClippedProbe { probe: probe.name.clone(), level_um, readings: at_top });
        }
        let lost = readings.len() - seen.len();
        if 2 * lost > readings.len() {
            remarks.push(format!("Probe {} lost {lost} of {} readings.", probe.name, readings.len()));
        }
    }
    remarks.extend(one_direction(rotor));
    Ok(remarks)
}

/// What probes that look in one direction alone cannot tell, in one sentence for all of them.
fn one_direction(rotor: &Rotor) -> Option<String> {
    let pairs = probe_pairs(rotor);
    let watched = |b: usize| rotor.probe.iter().any(|p| rotor.bearing_of(p) == Some(b));
    let alone =
        (0..rotor.bearing.len()).filter(|b| watched(*b) && pairs.iter().all(|pair| pair.bearing != *b));
    let names: Vec<&str> = alone.map(|b| rotor.bearing[b].name.as_str()).collect();
    (!names.is_empty()).then(|| {
        format!(
            "At {} probes look in one direction alone. There forward and backward whirl are mixed, the bearing's stiffness in \
             the other direction shows only through the shaft, and no second probe contradicts one that is off: cross-coupling, \
             a pedestal or bearing that is stiffer one way, and probe faults (calibration, reversal, runout, exchanged probes) \
             are hard to tell or not seen.",
            names.join(", ")
        )
    })
}

/// A plane whose unbalance is beyond what the balance grade of the file makes plausible.
pub fn beyond_grade(rotor: &Rotor, unbalance_kg_m: &[Complex<f64>]) -> Option<String> {
    let (permissible, largest) = (permissible_g_mm(rotor)?, largest_plausible_g_mm(rotor)?);
    let sizes = rotor.plane.iter().zip(unbalance_kg_m).map(|(plane, u)| (plane, u.norm() * 1e6));
    let (plane, found) = sizes.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (found > largest).then(|| {
        format!(
            "Plane {} would have {found:.0} g·mm, {:.0} times what [rated] balance_grade_mm_s permits the whole machine; one \
             long neglected has {:.0} times: doubt the probes' scale, the planes, or that this is unbalance.",
            plane.name,
            found / permissible,
            largest / permissible
        )
    })
}

/// A residual far smaller than the stated noise: four standard deviations of how far that is trusted.
pub fn far_below_noise(base: &BaseModel) -> Option<String> {
    let scale = base.closest().chi2_per_value().sqrt();
    (scale.ln() < -4.0 * base.fitter.stated_log_sd()).then(|| {
        format!(
            "The readings scatter by {:.0} % of the stated noise. Either [noise] states too much, or the amplitudes are in a larger unit \
             than µm 0-pk (mils, mm or m).",
            100.0 * scale
        )
    })
}

/// Whether a fit would end while somebody waits for it.
///
/// # Errors
/// If there are more readings than [`MOST_READINGS`].
pub fn not_too_many(readings: &[Reading]) -> Result<(), Error> {
    let number = readings.len();
    if number <= MOST_READINGS {
        return Ok(());
    }
    Err(Error::TooManyReadings { number, most: MOST_READINGS })
}

/// More must be measured than bearings and planes have unknowns, or any model fits.
///
/// # Errors
/// If there are too few values to judge a model by.
pub fn enough(fitter: &Fitter) -> Result<(), Error> {
    let values = 2 * fitter.data.count();
    let unknowns = Bearings::of(fitter.rotor).count() + 2 * fitter.rotor.plane.len();
    if values > unknowns {
        return Ok(());
    }
    Err(Error::TooFewValues { values, unknowns })
}

/// Whether every forward whirl is measured backward.
///
/// # Errors
/// If the phases are reversed.
pub fn not_reversed(
    base: &BaseModel,
    rotor: &Rotor,
    readings: &[Reading],
    noise: &Noise,
) -> Result<(), Error> {
    if base.closest().chi2_per_value() < 2.0 || !goes_backward(rotor, readings) {
        return Ok(());
    }
    let mirrored: Vec<Reading> = readings
        .iter()
        .map(|r| Reading { probes: r.probes.iter().map(|y| y.map(|y| y.conj())).collect(), ..r.clone() })
        .collect();
    let fitter = Fitter::new(rotor, base.fitter.data.of_same_runs(rotor, noise, &mirrored));
    let start = [base.hypothesis_start(), base.search.1.x.clone()];
    let amplitudes = Some(&base.search.1.amplitudes);
    // as stated: the most probable errors of a machine turned round mean nothing
    let drawing = fitter.exact_drawing();
    let reversed = fitter.fit(&base.hypothesis, &start, &drawing, Effort::Search, amplitudes);
    if reversed.is_ok_and(|r| r.chi2 < 0.25 * base.search.1.chi2) {
        return Err(Error::ReversedPhases(
            "the phases are reversed: every forward whirl appears backward. Change the sign of all _sin_um columns, \
             or swap the X and Y probes"
                .into(),
        ));
    }
    Ok(())
}

/// Whether the shaft whirls against its rotation on the average of all readings and bearings, each bearing counted alike; it
/// takes two probes that are not parallel to see that.
fn goes_backward(rotor: &Rotor, readings: &[Reading]) -> bool {
    let pairs = probe_pairs(rotor);
    let excess = |pair: &ProbePair| -> f64 {
        let whirl = |r: &Reading| Some(pair.whirl([r.probes[pair.probes[0]]?, r.probes[pair.probes[1]]?]));
        let seen: Vec<[Complex<f64>; 2]> = readings.iter().filter_map(whirl).collect();
        let energy = |way: usize| seen.iter().map(|w| w[way].norm_sqr()).sum::<f64>();
        let (forward, backward) = (energy(0), energy(1));
        (backward - forward) / (backward + forward).max(f64::MIN_POSITIVE)
    };
    pairs.iter().map(excess).sum::<f64>() > 0.0
}

/// Whether the best that a model can do is this machine at all.
///
/// # Errors
/// If it misses most of the vibration.
pub fn this_machine(rotor: &Rotor, relative_error: f64) -> Result<(), Error> {
    if relative_error <= ANOTHER_MACHINE {
        return Ok(());
    }
    Err(Error::AnotherMachine { rotor: rotor.name.clone(), relative_error })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::drawing::Rated;
    use crate::testing::sample_rotor;

    #[test]
    fn too_many_readings_are_refused_with_a_thinning_factor() {
        let reading = Reading { speed_rpm: 1000.0, ..Reading::default() };
        assert_eq!(not_too_many(&vec![reading.clone(); MOST_READINGS]), Ok(()));
        let why = not_too_many(&vec![reading; 50 * MOST_READINGS]).unwrap_err().to_string();
        assert!(why.contains("1000000 readings") && why.contains("one in 50"), "{why}");
    }

    #[test]
    fn single_direction_limits_are_remarked_once() {
        let mut rotor = sample_rotor();
        assert_eq!(one_direction(&rotor), None);
        rotor.probe.retain(|p| p.angle_deg == 0.0);
        let all = one_direction(&rotor).unwrap();
        assert!(all.contains("At A, B probes") && all.contains("forward and backward"), "{all}");
        rotor.probe.truncate(1);
        assert!(one_direction(&rotor).unwrap().contains("At A probes"));
        rotor.probe = sample_rotor().probe;
        // parallel probes are one direction
        rotor.probe[3].angle_deg = 180.0;
        assert!(one_direction(&rotor).unwrap().contains("At B probes"));
    }

    #[test]
    fn an_unbalance_is_doubted_beyond_three_grades_and_not_before() {
        let mut rotor = sample_rotor();
        let with = |rotor: &Rotor, g_mm: f64| {
            beyond_grade(rotor, &[Complex::from(1e-5), Complex::new(0.0, g_mm * 1e-6)])
        };
        assert_eq!(with(&rotor, 1e9), None, "nothing is known without a grade");
        rotor.rated = Some(Rated { speed_rpm: [1000.0, 11_000.0], balance_grade_mm_s: Some(2.5) });
        let largest = largest_plausible_g_mm(&rotor).unwrap();
        assert_eq!(with(&rotor, 0.99 * largest), None);
        let doubt = with(&rotor, 2.0 * largest).unwrap();
        assert!(doubt.contains("Plane 2 would have") && doubt.contains("31 times"), "{doubt}");
    }
}
