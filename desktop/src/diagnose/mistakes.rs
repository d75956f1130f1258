//! Mistakes that are often made in a rotor's file or a measurement: places, angles, units, exchanged columns.
//!
//! Each is undone in the files as they are, so that a fit can tell whether they agree better without it.

use crate::compare::probe_pairs;
use crate::machine::drawing::Rotor;
use crate::measurement::Reading;
use crate::units::{figure, same_place};

/// Units of speed that are taken for rpm: revolutions per minute of one, and its name.
const SPEED_UNITS: [(f64, &str); 2] = [(60.0, "Hz"), (30.0 / std::f64::consts::PI, "rad/s")];
/// Forms and units of an amplitude that are taken for µm 0-pk: µm 0-pk of one, and its name.
const AMPLITUDE_UNITS: [(f64, &str); 6] = [
    (0.5, "pk-pk"),
    (std::f64::consts::SQRT_2, "rms"),
    (25.4, "in mils"),
    (12.7, "in mils pk-pk"),
    (1e3, "in mm"),
    (1e6, "in m"),
];
/// Positions that are tried, in shares of the length of the shaft.
const MOVED: [f64; 6] = [-0.12, -0.05, -0.02, 0.02, 0.05, 0.12];
/// Angles that are tried, degrees; 180 more is a reversed probe.
const TURNED_DEG: [f64; 5] = [-60.0, -30.0, 30.0, 60.0, 90.0];
/// Angles that people choose are whole multiples of this, degrees.
const CHOSEN_DEG: f64 = 5.0;

/// One mistake.
#[derive(Debug, Clone, PartialEq)]
pub enum Mistake {
    /// Probes stand by so many m nearer to the middle of the shaft than the file states.
    ProbePosition(Vec<usize>),
    /// A disk with the planes at it stands by so many m farther right.
    DiskPosition(usize),
    /// Probes look by so many degrees farther in the direction of rotation.
    ProbeAngle(Vec<usize>),
    /// Angles of probes are stated in radians.
    AngleInRadians(Vec<usize>),
    /// The columns of two bearings are exchanged: probes of each that answer to one another.
    ExchangedBearings(Vec<[usize; 2]>),
    /// The sine of a probe has the other sign.
    NegatedSine(usize),
    /// Speeds are in a unit of the table.
    SpeedUnit(usize),
    /// Amplitudes are in a unit of the table; the added unbalances of the runs contradict them.
    AmplitudeUnit(usize),
    /// Radii of the shaft are stated as diameters.
    RadiusForDiameter,
    /// The diametral and the polar inertia of disks are exchanged.
    ExchangedInertias(Vec<usize>),
}

impl Mistake {
    /// Every mistake that the files could hold.
    pub fn possible(rotor: &Rotor) -> Vec<Self> {
        let probes: Vec<usize> = (0..rotor.probe.len()).collect();
        let mut all = Vec::new();
        let groups = probes_by_place(rotor);
        if groups.len() > 1 {
            all.push(Self::ProbePosition(probes.clone()));
        }
        all.extend(groups.into_iter().map(Self::ProbePosition));
        all.extend((0..rotor.disk.len()).map(Self::DiskPosition));
        all.extend((probes.len() > 1).then(|| Self::ProbeAngle(probes.clone())));
        all.extend(probes.iter().map(|p| Self::ProbeAngle(vec![*p])));
        let radians: Vec<usize> =
            probes.iter().copied().filter(|p| looks_like_radians(rotor.probe[*p].angle_deg)).collect();
        if radians.len() > 1 {
            all.push(Self::AngleInRadians(radians.clone()));
        }
        all.extend(radians.into_iter().map(|p| Self::AngleInRadians(vec![p])));
        all.extend(exchanged_bearings(rotor));
        all.extend(probes.into_iter().map(Self::NegatedSine));
        all.extend((0..SPEED_UNITS.len()).map(Self::SpeedUnit));
        if rotor.run.iter().any(|run| !run.added_unbalance.is_empty()) {
            all.extend((0..AMPLITUDE_UNITS.len()).map(Self::AmplitudeUnit));
        }
        all.push(Self::RadiusForDiameter);
        let disks: Vec<usize> = (0..rotor.disk.len()).collect();
        if disks.len() > 1 {
            all.push(Self::ExchangedInertias(disks.clone()));
        }
        all.extend(disks.into_iter().map(|i| Self::ExchangedInertias(vec![i])));
        all
    }

    /// Sizes to try, in m or degrees; empty for a mistake that is made or not.
    pub fn sizes(&self, rotor: &Rotor) -> Vec<f64> {
        match self {
            Self::ProbePosition(_) | Self::DiskPosition(_) => MOVED.map(|k| k * rotor.length_m()).to_vec(),
            Self::ProbeAngle(_) => TURNED_DEG.to_vec(),
            _ => Vec::new(),
        }
    }

    /// Rotor and readings as they are without the mistake, of the size `by` if it has one; `None` if no machine can be like that, or
    /// nothing changes.
    pub fn undone(&self, rotor: &Rotor, readings: &[Reading], by: f64) -> Option<(Rotor, Vec<Reading>)> {
        let (mut changed, mut read) = (rotor.clone(), readings.to_vec());
        match self {
            Self::ProbePosition(probes) => {
                for p in probes {
                    changed.probe[*p].position_m += by * inboard(rotor, *p);
                }
            }
            Self::DiskPosition(i) => {
                let from_m = rotor.disk[*i].position_m;
                changed.disk[*i].position_m += by;
                let weights = changed.run.iter_mut().flat_map(|run| &mut run.added_unbalance);
                let planes = changed.plane.iter_mut().map(|plane| &mut plane.position_m);
                planes
                    .chain(weights.map(|a| &mut a.position_m))
                    .filter(|z| same_place(**z, from_m))
                    .for_each(|z| *z += by);
            }
            Self::ProbeAngle(probes) => probes.iter().for_each(|p| changed.probe[*p].angle_deg += by),
            Self::AngleInRadians(probes) => {
                for p in probes {
                    changed.probe[*p].angle_deg = rotor.probe[*p].angle_deg.to_degrees();
                }
            }
            Self::ExchangedBearings(pairs) => {
                read.iter_mut().for_each(|r| pairs.iter().for_each(|[a, b]| r.probes.swap(*a, *b)));
            }
            Self::NegatedSine(p) => {
                read.iter_mut().for_each(|r| r.probes[*p] = r.probes[*p].map(|y| y.conj()))
            }
            Self::SpeedUnit(k) => read.iter_mut().for_each(|r| r.speed_rpm *= SPEED_UNITS[*k].0),
            // a linear machine answers so many times as much to weights so many times as large
            Self::AmplitudeUnit(k) => {
                let weights = changed.run.iter_mut().flat_map(|run| &mut run.added_unbalance);
                weights.for_each(|a| a.magnitude_g_mm /= AMPLITUDE_UNITS[*k].0);
            }
            Self::RadiusForDiameter => changed.shaft.iter_mut().for_each(|s| {
                s.outer_diameter_m *= 2.0;
                s.inner_diameter_m *= 2.0;
            }),
            Self::ExchangedInertias(disks) => {
                for i in disks {
                    let disk = &mut changed.disk[*i];
                    std::mem::swap(&mut disk.diametral_inertia_kg_m2, &mut disk.polar_inertia_kg_m2);
                }
            }
        }
        let differs = changed != *rotor || read != readings;
        (differs && changed.validate().is_ok()).then_some((changed, read))
    }

    /// The mistake in a sentence, without a full stop.
    pub fn words(&self, rotor: &Rotor, by: f64) -> String {
        let (mm, side) = (1e3 * by.abs(), if by < 0.0 { "outboard" } else { "inboard" });
        let probes = |numbers: &[usize]| match numbers {
            [one] => format!("probe {}", rotor.probe[*one].name),
            some if some.len() == rotor.probe.len() => "all probes".into(),
            some => {
                let names: Vec<&str> = some.iter().map(|p| rotor.probe[*p].name.as_str()).collect();
                format!("probes {}", names.join(", "))
            }
        };
        let angles = |numbers: &[usize]| {
            if numbers.len() == 1 { ("The angle", "looks") } else { ("The angles", "look") }
        };
        match self {
            Self::ProbePosition(numbers) => {
                format!(
                    "The positions of {} look wrong: about {mm:.0} mm farther {side} fits",
                    probes(numbers)
                )
            }
            Self::DiskPosition(i) => {
                let to_m = rotor.disk[*i].position_m + by;
                format!(
                    "The position of disk {} looks wrong: {to_m:.3} m fits, {:+.0} mm from the file",
                    rotor.disk[*i].name,
                    1e3 * by
                )
            }
            Self::ProbeAngle(numbers) => {
                let (what, verb) = angles(numbers);
                format!("{what} of {} {verb} wrong: {by:+.0}° fits", probes(numbers))
            }
            Self::AngleInRadians(numbers) => {
                let one = rotor.probe[numbers[0]].angle_deg;
                let (what, verb) = angles(numbers);
                format!(
                    "{what} of {} {verb} like radians in place of degrees ({one} rad is {:.0}°)",
                    probes(numbers),
                    one.to_degrees()
                )
            }
            Self::ExchangedBearings(pairs) => {
                let [a, b] = pairs[0].map(|p| rotor.probe[p].bearing.as_str());
                format!("The columns of bearings {a} and {b} look exchanged in the measurement")
            }
            Self::NegatedSine(p) => {
                format!("The sine of probe {} looks negated in the measurement", rotor.probe[*p].name)
            }
            Self::SpeedUnit(k) => {
                format!("The speeds of the measurement look like {} in place of rpm", SPEED_UNITS[*k].1)
            }
            Self::AmplitudeUnit(k) => {
                let (factor, unit) = AMPLITUDE_UNITS[*k];
                format!(
                    "The amplitudes look as if they were {unit} in place of µm 0-pk (or the added unbalances are {} times the true ones)",
                    figure(factor)
                )
            }
            Self::RadiusForDiameter => {
                "The diameters of the shaft look like radii: twice as much fits".into()
            }
            Self::ExchangedInertias(disks) => {
                let names: Vec<&str> = disks.iter().map(|i| rotor.disk[*i].name.as_str()).collect();
                format!(
                    "The diametral and polar inertia of {} look exchanged",
                    if names.len() == 1 {
                        format!("disk {}", names[0])
                    } else {
                        format!("disks {}", names.join(", "))
                    }
                )
            }
        }
    }

    /// The probe that it is about, if it is one alone.
    pub fn probe(&self) -> Option<usize> {
        match self {
            Self::ProbePosition(numbers) | Self::ProbeAngle(numbers) | Self::AngleInRadians(numbers) => {
                numbers.first().copied().filter(|_| numbers.len() == 1)
            }
            Self::NegatedSine(p) => Some(*p),
            _ => None,
        }
    }

    /// What kind of mistake it is, a few words for a list of what cannot be told apart.
    pub fn label(&self, rotor: &Rotor) -> String {
        let at = |numbers: &[usize]| match numbers {
            [one] => format!("of {}", rotor.probe[*one].name),
            _ => "of several probes".into(),
        };
        match self {
            Self::ProbePosition(numbers) => format!("a wrong position {}", at(numbers)),
            Self::DiskPosition(i) => format!("a wrong position of {}", rotor.disk[*i].name),
            Self::ProbeAngle(numbers) | Self::AngleInRadians(numbers) => {
                format!("a wrong angle {}", at(numbers))
            }
            Self::ExchangedBearings(_) => "exchanged bearings".into(),
            Self::NegatedSine(p) => format!("a negated sine of {}", rotor.probe[*p].name),
            Self::SpeedUnit(_) => "a wrong unit of speed".into(),
            Self::AmplitudeUnit(_) => "a wrong unit of amplitude".into(),
            Self::RadiusForDiameter => "radii for diameters".into(),
            Self::ExchangedInertias(_) => "exchanged inertias of a disk".into(),
        }
    }
}

/// Which way the middle of the shaft is from a probe.
fn inboard(rotor: &Rotor, probe: usize) -> f64 {
    (0.5 * rotor.length_m() - rotor.probe[probe].position_m).signum()
}

/// Probes that stand at one place.
fn probes_by_place(rotor: &Rotor) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (p, probe) in rotor.probe.iter().enumerate() {
        let here = |group: &&mut Vec<usize>| same_place(rotor.probe[group[0]].position_m, probe.position_m);
        match groups.iter_mut().find(here) {
            Some(group) => group.push(p),
            None => groups.push(vec![p]),
        }
    }
    groups
}

/// Whether an angle is one that people choose if it is read as radians, and none as degrees.
fn looks_like_radians(angle_deg: f64) -> bool {
    let chosen = |degrees: f64, within: f64| {
        (degrees / CHOSEN_DEG - (degrees / CHOSEN_DEG).round()).abs() * CHOSEN_DEG < within
    };
    let turned = angle_deg.abs() <= std::f64::consts::TAU && angle_deg != 0.0;
    // two decimals of a radian are good for 0.3°
    turned && chosen(angle_deg.to_degrees(), 0.3) && !chosen(angle_deg, 1e-6)
}

/// Each two bearings whose pairs of probes could be exchanged.
fn exchanged_bearings(rotor: &Rotor) -> Vec<Mistake> {
    let pairs = probe_pairs(rotor);
    let couples = pairs.iter().enumerate().flat_map(|(k, a)| pairs[k + 1..].iter().map(move |b| (a, b)));
    couples
        .map(|(a, b)| {
            let both = (0..2).map(|k| [a.probes[k], b.probes[k]]);
            Mistake::ExchangedBearings(both.collect())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Complex;

    use super::*;
    use crate::machine::drawing::Disk;
    use crate::testing::sample_rotor;

    fn readings(rotor: &Rotor) -> Vec<Reading> {
        let phasor = |p: usize, k: usize| Complex::new(1e-5 * (p + 1) as f64, 1e-6 * k as f64);
        let reading = |k: usize| Reading {
            speed_rpm: 1000.0 + 100.0 * k as f64,
            probes: (0..rotor.probe.len()).map(|p| Some(phasor(p, k))).collect(),
            ..Reading::default()
        };
        (0..4).map(reading).collect()
    }

    #[test]
    fn mistake_made_and_undone_leaves_files_as_they_were() {
        let rotor = sample_rotor();
        let read = readings(&rotor);
        for mistake in Mistake::possible(&rotor) {
            let by = mistake.sizes(&rotor).first().copied().unwrap_or(0.0);
            let Some((other, changed)) = mistake.undone(&rotor, &read, by) else { continue };
            assert!(other != rotor || changed != read, "{mistake:?}");
            let again = match mistake {
                Mistake::SpeedUnit(_) | Mistake::AmplitudeUnit(_) | Mistake::RadiusForDiameter => continue,
                Mistake::AngleInRadians(_) => {
                    panic!("{mistake:?}: no angle of the sample looks like radians")
                }
                _ => mistake.undone(&other, &changed, -by).unwrap(),
            };
            assert_eq!(again.1, read, "{mistake:?}");
            let places = |rotor: &Rotor| -> Vec<f64> {
                let probes = rotor.probe.iter().flat_map(|p| [p.position_m, p.angle_deg]);
                let inertias = |d: &Disk| [d.position_m, d.diametral_inertia_kg_m2, d.polar_inertia_kg_m2];
                probes.chain(rotor.disk.iter().flat_map(inertias)).collect()
            };
            let (restored, stated) = (places(&again.0), places(&rotor));
            assert!(restored.iter().zip(&stated).all(|(a, b)| (a - b).abs() < 1e-9), "{mistake:?}");
        }
    }

    #[test]
    fn angles_in_radians_are_recognised_and_degrees_are_not() {
        for degrees in [45.0_f64, 90.0, 135.0, -45.0, 180.0] {
            // as people write it, to three decimals
            let radians = (1e3 * degrees.to_radians()).round() / 1e3;
            assert!(looks_like_radians(radians), "{radians}");
        }
        for degrees in [0.0, 5.0, 45.0, 90.0, -45.0, 1.0, 2.0, 0.5] {
            assert!(!looks_like_radians(degrees), "{degrees}");
        }
        let mut rotor = sample_rotor();
        rotor.probe.iter_mut().for_each(|p| p.angle_deg = p.angle_deg.to_radians());
        let possible = Mistake::possible(&rotor);
        let angles =
            possible.iter().find(|m| matches!(m, Mistake::AngleInRadians(all) if all.len() > 1)).unwrap();
        let (corrected, _) = angles.undone(&rotor, &readings(&rotor), 0.0).unwrap();
        let stated = sample_rotor();
        assert!(
            corrected.probe.iter().zip(&stated.probe).all(|(a, b)| (a.angle_deg - b.angle_deg).abs() < 1e-9)
        );
        assert!(angles.words(&rotor, 0.0).contains("radians"));
    }

    #[test]
    fn plane_and_weights_move_with_their_disk() {
        let mut rotor = sample_rotor();
        let z = rotor.disk[0].position_m;
        rotor.plane[0].position_m = z;
        let (moved, _) = Mistake::DiskPosition(0).undone(&rotor, &readings(&rotor), 0.01).unwrap();
        assert!((moved.disk[0].position_m - z - 0.01).abs() < 1e-12);
        assert!((moved.plane[0].position_m - z - 0.01).abs() < 1e-12);
        assert!(Mistake::DiskPosition(0).words(&rotor, 0.01).contains("+10 mm"));
    }
}
