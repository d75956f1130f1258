//! Probes two by two at one place of the shaft, which see the path of its centre.

use nalgebra::{Complex, Matrix2, Vector2};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;

use crate::ingest::waveform::Probe;

/// Two probes whose directions span less than this show no path; 1 at a right angle.
const LEAST_SPAN: f64 = 0.3;

#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// The place that they see.
    pub name: String,
    pub probes: [usize; 2],
    /// What makes x and y of what the two show.
    to_xy: Matrix2<f64>,
}

/// The pairs of a rotor by their places and angles; without a rotor, those named alike with X and Y at the end, as if these
/// were the axes.
pub fn pairs(rotor: Option<&Rotor>, probes: &[Probe]) -> Vec<Pair> {
    let couples = (0..probes.len()).flat_map(|a| (a + 1..probes.len()).map(move |b| [a, b]));
    match rotor {
        Some(rotor) => couples.filter_map(|couple| of_rotor(rotor, couple)).collect(),
        None => couples.filter_map(|couple| of_names(couple.map(|i| &probes[i].name), couple)).collect(),
    }
}

fn of_rotor(rotor: &Rotor, couple: [usize; 2]) -> Option<Pair> {
    let [a, b] = couple.map(|i| &rotor.probe[i]);
    if a.bearing != b.bearing || a.position_m != b.position_m {
        return None;
    }
    let [(sin_a, cos_a), (sin_b, cos_b)] = [a, b].map(|probe| probe.angle_deg.to_radians().sin_cos());
    let shown = Matrix2::new(cos_a, sin_a, cos_b, sin_b);
    let to_xy = shown.try_inverse().filter(|_| shown.determinant().abs() >= LEAST_SPAN)?;
    Some(Pair { name: a.bearing.clone(), probes: couple, to_xy })
}

fn of_names(names: [&String; 2], couple: [usize; 2]) -> Option<Pair> {
    let [a, b] = names;
    let stem = |name: &str, end: char| name.to_uppercase().strip_suffix(end).map(str::to_string);
    let ordered = if stem(a, 'X').is_some() { [a, b] } else { [b, a] };
    let probes = if ordered == names { couple } else { [couple[1], couple[0]] };
    let is_one_place = stem(ordered[0], 'X')? == stem(ordered[1], 'Y')?;
    let name = format!("{} and {}", ordered[0], ordered[1]);
    is_one_place.then_some(Pair { name, probes, to_xy: Matrix2::identity() })
}

impl Pair {
    /// The 1x phasors along x and y, m.
    pub fn phasors_m(&self, reading: &Reading) -> Option<[Complex<f64>; 2]> {
        let [a, b] = self.probes;
        Some(self.along_xy(reading.probes[a]?, reading.probes[b]?))
    }

    /// What the two probes show, along x and y.
    pub fn along_xy(&self, a: Complex<f64>, b: Complex<f64>) -> [Complex<f64>; 2] {
        (self.to_xy.map(Complex::from) * Vector2::new(a, b)).into()
    }

    /// Whether this probe is one of the two.
    pub fn has(&self, probe: usize) -> bool {
        self.probes.contains(&probe)
    }

    /// How far the mean place is from that of `first`, along x and y, µm, in the sense in which vibration counts positive.
    pub fn moved_um(&self, first: &Reading, reading: &Reading, probes: &[Probe]) -> Option<[f64; 2]> {
        let along = |probe: usize| {
            let gap_v = |of: &Reading| of.gaps_v.get(probe).copied().flatten();
            Some(1e3 * (gap_v(reading)? - gap_v(first)?) / probes[probe].mv_um)
        };
        let [a, b] = self.probes;
        Some((self.to_xy * Vector2::new(along(a)?, along(b)?)).into())
    }
}

#[cfg(test)]
mod tests {
    use rotor_edge_desktop::rotor_file;

    use super::*;

    fn probes(names: &[&str]) -> Vec<Probe> {
        let probe = |name: &&str| Probe { name: name.to_string(), channel: "1".into(), mv_um: 8.0 };
        names.iter().map(probe).collect()
    }

    #[test]
    fn probes_at_45_and_135_degrees_show_orbit_along_x_and_y() {
        let mut rotor = rotor_file::parse("rotor.toml", crate::sample::ROTOR).unwrap();
        (rotor.probe[0].angle_deg, rotor.probe[1].angle_deg) = (45.0, 135.0);
        let found = pairs(Some(&rotor), &probes(&["15X", "15Y", "16X", "16Y"]));
        assert_eq!(found.iter().map(|pair| pair.probes).collect::<Vec<_>>(), [[0, 1], [2, 3]]);
        let [x, y] = [Complex::new(3e-6, -1e-6), Complex::new(0.5e-6, 2e-6)];
        let along = |degrees: f64| x * degrees.to_radians().cos() + y * degrees.to_radians().sin();
        let reading = |gaps_v: [f64; 2]| Reading {
            probes: vec![Some(along(45.0)), Some(along(135.0)), None, None],
            gaps_v: gaps_v.map(Some).to_vec(),
            ..Reading::default()
        };
        let [found_x, found_y] = found[0].phasors_m(&reading([-9.0, -9.0])).unwrap();
        assert!((found_x - x).norm() < 1e-18 && (found_y - y).norm() < 1e-18);
        assert_eq!(found[1].phasors_m(&reading([-9.0, -9.0])), None);
        // 50 µm along x: 0.4 V more of 8 mV/µm at 0°, and √½ of it at 45° and −√½ at 135°
        let rose_v = 0.4 * 0.5_f64.sqrt();
        let moved = found[0].moved_um(
            &reading([-9.0, -9.0]),
            &reading([-9.0 + rose_v, -9.0 - rose_v]),
            &probes(&["15X", "15Y"]),
        );
        let [x_um, y_um] = moved.unwrap();
        assert!((x_um - 50.0).abs() < 1e-9 && y_um.abs() < 1e-9, "{x_um} {y_um}");
        rotor.probe[1].angle_deg = 50.0;
        assert_eq!(pairs(Some(&rotor), &probes(&["15X", "15Y", "16X", "16Y"])).len(), 1);
    }

    #[test]
    fn without_a_rotor_names_make_pairs() {
        let named = |names: &[&str]| {
            let found = pairs(None, &probes(names));
            found.into_iter().map(|pair| (pair.name, pair.probes)).collect::<Vec<(String, _)>>()
        };
        assert_eq!(
            named(&["Brg 1 Y", "Brg 1 X", "2x", "2Y", "3X"]),
            [("Brg 1 X and Brg 1 Y".into(), [1, 0]), ("2x and 2Y".into(), [2, 3])]
        );
        assert_eq!(named(&["1", "2", "Y", "15X"]), []);
    }
}
