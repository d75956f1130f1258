//! A length of the shaft, and how effects of the file change its stiffness.

use crate::machine::drawing::{ParameterValue, Rotor};
use crate::units::same_place;

/// The kind of effect that changes the stiffness of a length of shaft, as the file calls it.
pub const SHAFT_STIFFNESS: &str = "shaft_stiffness";

const UM_PER_M: f64 = 1e6;

/// A length of the shaft from one position to another, to the micrometre.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Span {
    from_um: u32,
    to_um: u32,
}

impl Span {
    pub fn new(from_m: f64, to_m: f64) -> Self {
        Self { from_um: (UM_PER_M * from_m).round() as u32, to_um: (UM_PER_M * to_m).round() as u32 }
    }

    /// From its name; `None` if it is no name of a length.
    pub fn parse(name: &str) -> Option<Self> {
        let (from, to) = name.strip_suffix(" m")?.split_once(" to ")?;
        let (from_m, to_m): (f64, f64) = (from.parse().ok()?, to.parse().ok()?);
        let is_length = 0.0 <= from_m && from_m < to_m && to_m * UM_PER_M <= f64::from(u32::MAX);
        Some(Self::new(from_m, to_m)).filter(|span| is_length && span.from_um < span.to_um)
    }

    /// As the rotor's file names it: "0.3 to 0.5 m".
    pub fn name(self) -> String {
        format!("{} to {} m", self.from_m(), self.to_m())
    }

    pub fn from_m(self) -> f64 {
        f64::from(self.from_um) / UM_PER_M
    }

    pub fn to_m(self) -> f64 {
        f64::from(self.to_um) / UM_PER_M
    }

    pub fn length_m(self) -> f64 {
        self.to_m() - self.from_m()
    }

    /// Whether it holds a position between its ends.
    pub fn holds(self, position_m: f64) -> bool {
        (self.from_m()..self.to_m()).contains(&position_m)
    }

    /// Whether the two have a length in common.
    pub fn overlaps(self, other: Self) -> bool {
        self.from_um < other.to_um && other.from_um < self.to_um
    }

    /// Whether it lies on the shaft.
    pub fn is_on(self, rotor: &Rotor) -> bool {
        let end_m = rotor.length_m();
        self.to_m() < end_m || same_place(self.to_m(), end_m)
    }
}

/// The lengths of shaft in which a change of stiffness is sought: from one bearing, disk or coupling to the next. In between
/// nothing but the shaft's own mass changes the bending moment, so that a shorter length has nearly the same effect as another
/// change of the whole. Lengths shorter than the shaft is thick are no beams, and the free ends carry next to no moment.
pub fn sought(rotor: &Rotor) -> Vec<Span> {
    let bearings = rotor.bearing.iter().map(|b| b.position_m);
    let disks = rotor.disk.iter().map(|d| d.position_m);
    let couplings = rotor.coupling.iter().map(|c| c.position_m);
    let mut loaded_m: Vec<f64> = bearings.chain(disks).chain(couplings).collect();
    loaded_m.sort_by(f64::total_cmp);
    let between = loaded_m.windows(2).filter(|ends| {
        let thickness_m = rotor.segment_at(0.5 * (ends[0] + ends[1])).outer_diameter_m;
        ends[1] - ends[0] > thickness_m
    });
    between.map(|ends| Span::new(ends[0], ends[1])).collect()
}

/// Lengths whose stiffness effects of the file change, each with its factor.
pub fn stated(rotor: &Rotor) -> impl Iterator<Item = (Span, f64)> {
    let of_shaft = rotor.effect.iter().filter(|e| e.kind == SHAFT_STIFFNESS);
    of_shaft.filter_map(|e| match (e.at.as_deref().and_then(Span::parse), e.parameters.get("factor")) {
        (Some(span), Some(ParameterValue::Real(factor))) => Some((span, *factor)),
        _ => None,
    })
}

/// Factor of the file's effects on the stiffness of the shaft at a position: where lengths overlap, their changes add up.
pub fn stiffness_factor(rotor: &Rotor, position_m: f64) -> f64 {
    1.0 + stated(rotor)
        .filter(|(span, _)| span.holds(position_m))
        .map(|(_, factor)| factor - 1.0)
        .sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::sample_rotor;

    #[test]
    fn span_is_parsed_from_its_own_name() {
        for (from_m, to_m) in [(0.0, 0.2), (0.3, 0.5), (0.123_456, 1.000_001)] {
            let span = Span::new(from_m, to_m);
            assert_eq!(Span::parse(&span.name()), Some(span));
        }
        assert_eq!(Span::parse("0.300 to 0.500 m"), Some(Span::new(0.3, 0.5)));
    }

    #[test]
    fn names_that_are_no_lengths_are_not_parsed() {
        for name in [
            "",
            "disk 1",
            "0.5 to 0.3 m",
            "0.3 to 0.3 m",
            "-1 to 1 m",
            "0.3 to 1e9 m",
            "NaN to 1 m",
            "0.3 to 0.5",
        ] {
            assert_eq!(Span::parse(name), None, "{name}");
        }
    }

    #[test]
    fn sought_spans_join_loaded_places_without_gaps() {
        let rotor = sample_rotor();
        let spans = sought(&rotor);
        assert_eq!(spans.len() + 1, rotor.bearing.len() + rotor.disk.len());
        assert!(spans.windows(2).all(|pair| pair[0].to_m() == pair[1].from_m()));
        assert!(spans.iter().all(|span| span.is_on(&rotor)));
    }
}
