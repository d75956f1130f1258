//! A squeeze-film damper: a film around a journal that whirls and does not turn.
//!
//! For a circular orbit about the centre of radius ε c at the running speed Ω the film's force is steady in the
//! orbit's frame: a damping C against the motion and, where the film cavitates, a stiffness K towards the
//! centre (Gunter, Barrett & Allaire, J. Lubrication Technology 99, 1977; Vance, Rotordynamics of Turbomachinery,
//! 1988, chapter 6):
//!
//! | ends | film | C | K |
//! |---|---|---|---|
//! | open | full | `π μ R L³ / (c³ (1−ε²)^{3/2})` | 0 |
//! | open | half | half of that | `2 μ Ω R L³ ε / (c³ (1−ε²)²)` |
//! | closed | full | `24 π μ R³ L / (c³ (2+ε²) (1−ε²)^{1/2})` | 0 |
//! | closed | half | half of that | `24 μ Ω R³ L ε / (c³ (2+ε²) (1−ε²))` |
//!
//! Open ends are short-bearing theory, for L/D up to about a half; closed ends are tight seals, without flow
//! along the shaft. A damper fed by a groove in its middle is two of half the length.

use std::f64::consts::PI;

use nalgebra::Matrix2;
use serde::{Deserialize, Serialize};

use super::law::{BearingLaw, LawUnknown, PRIOR_LOG_SD, Role};
use super::support::SupportLaw;
use crate::statistics::scale::Scale;

/// A squeeze-film damper, centred, with the spring that centres it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SqueezeFilm {
    /// Of the film, m.
    pub diameter_m: f64,
    /// Of the land along the shaft, m.
    pub length_m: f64,
    pub radial_clearance_m: f64,
    pub viscosity_pa_s: f64,
    /// Whether oil leaves at the ends.
    pub ends: DamperEnds,
    pub film: DamperFilm,
    /// Radius of the orbit by the clearance; 0 for small motion.
    #[serde(default)]
    pub orbit_ratio: f64,
    /// Of the centring spring, N/m.
    #[serde(default)]
    pub spring_n_m: f64,
}

/// The ends of a damper.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DamperEnds {
    /// At ambient pressure.
    Open,
    Closed,
}

/// The film of a damper.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DamperFilm {
    /// All around, under enough supply pressure.
    Full,
    /// Half around, cavitated where it would pull.
    Half,
}

impl SqueezeFilm {
    /// Whether the numbers are those of a damper.
    ///
    /// # Errors
    /// The first key out of range and a sentence with its number.
    pub fn check(&self) -> Result<(), (String, String)> {
        let within = |key: &str, value: f64, least: f64, most: f64, unit: &str| {
            if (least..=most).contains(&value) {
                return Ok(());
            }
            Err((key.to_string(), format!("{value}{unit}, expected {least} to {most}")))
        };
        within("diameter_m", self.diameter_m, 1e-3, 5.0, " m")?;
        within("length_m", self.length_m, 0.02 * self.diameter_m, 2.0 * self.diameter_m, " m")?;
        let radius = 0.5 * self.diameter_m;
        within("radial_clearance_m", self.radial_clearance_m, 2e-4 * radius, 2e-2 * radius, " m")?;
        within("viscosity_pa_s", self.viscosity_pa_s, 1e-5, 10.0, " Pa·s")?;
        within("orbit_ratio", self.orbit_ratio, 0.0, 0.8, " of the clearance")?;
        within("spring_n_m", self.spring_n_m, 0.0, 1e11, " N/m")
    }

    /// Stiffness, N/m, and damping, N·s/m, for whirl at a speed, rad/s.
    pub fn coefficients(&self, speed_rad_s: f64) -> (Matrix2<f64>, Matrix2<f64>) {
        let (radius, length, orbit) = (0.5 * self.diameter_m, self.length_m, self.orbit_ratio);
        let open = 1.0 - orbit * orbit;
        let unit = self.viscosity_pa_s * radius * length / self.radial_clearance_m.powi(3);
        let (damping, stiffness) = match self.ends {
            DamperEnds::Open => {
                let unit = unit * length.powi(2);
                (PI * unit / open.powf(1.5), 2.0 * unit * orbit / open.powi(2))
            }
            DamperEnds::Closed => {
                let unit = 24.0 * unit * radius.powi(2) / (2.0 + orbit * orbit);
                (PI * unit / open.sqrt(), unit * orbit / open)
            }
        };
        let (damping, stiffness) = match self.film {
            DamperFilm::Full => (damping, 0.0),
            DamperFilm::Half => (0.5 * damping, speed_rad_s * stiffness),
        };
        (Matrix2::identity() * (self.spring_n_m + stiffness), Matrix2::identity() * damping)
    }
}

/// Speed at which a stiffness that grows with it is stated to the support, rad/s; any will do.
const REFERENCE_RAD_S: f64 = 100.0;

impl BearingLaw for SqueezeFilm {
    fn unknowns(&self) -> Vec<LawUnknown> {
        vec![LawUnknown {
            symbol: "viscosity".into(),
            unit: "Pa·s",
            role: Role::Other,
            scale: Scale::Logarithmic,
            stated: self.viscosity_pa_s.ln(),
            prior_sd: PRIOR_LOG_SD,
        }]
    }

    fn support(&self, x: &[f64]) -> SupportLaw {
        let mut damper = *self;
        damper.assign(x);
        // the film's stiffness is proportional to the speed, the spring's constant
        let (stiffness, damping) = damper.coefficients(REFERENCE_RAD_S);
        let linear = SupportLaw::linear(stiffness, damping);
        if stiffness.m11 == damper.spring_n_m {
            return linear;
        }
        let stiffness_slope = 1.0 - damper.spring_n_m / stiffness.m11;
        SupportLaw { stiffness_slope, reference_rad_s: REFERENCE_RAD_S, ..linear }
    }

    fn assign(&mut self, x: &[f64]) {
        if let &[x] = x {
            self.viscosity_pa_s = x.exp();
        }
    }

    fn check(&self) -> Result<(), (String, String)> {
        SqueezeFilm::check(self).map_err(|(key, what)| (format!("squeeze_film.{key}"), what))
    }

    fn follows_speed(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPEED: f64 = 700.0;

    fn damper(ends: DamperEnds, film: DamperFilm, orbit_ratio: f64) -> SqueezeFilm {
        SqueezeFilm {
            diameter_m: 0.13,
            length_m: 0.03,
            radial_clearance_m: 1.1e-4,
            viscosity_pa_s: 0.015,
            ends,
            film,
            orbit_ratio,
            spring_n_m: 0.0,
        }
    }

    /// K and C from the pressure of an orbit, θ from the widest gap, h = c (1 + ε cos θ), ∂h/∂t = Ω c ε sin θ, summed
    /// around: `p̄ L = −μ L³ ∂h/∂t / h³` with open ends; `h³ p' = −12 μ R² Ω (h − h₀)`, p periodic, zero at
    /// θ = 0, with closed ones.
    fn summed(of: &SqueezeFilm) -> (f64, f64) {
        let n = 20_000;
        let step = 2.0 * PI / n as f64;
        let (c, e, radius) = (of.radial_clearance_m, of.orbit_ratio, 0.5 * of.diameter_m);
        let gap = |a: f64| c * (1.0 + e * a.cos());
        let around = |f: &dyn Fn(f64) -> f64| (0..n).map(|i| f((i as f64 + 0.5) * step)).sum::<f64>() * step;
        let neutral = around(&|a| gap(a).powi(-2)) / around(&|a| gap(a).powi(-3));
        let (mut across, mut inward, mut pressure) = (0.0, 0.0, 0.0);
        for i in 0..n {
            let a = (i as f64 + 0.5) * step;
            let slope =
                -12.0 * of.viscosity_pa_s * radius.powi(2) * SPEED * (gap(a) - neutral) / gap(a).powi(3);
            let line = match of.ends {
                DamperEnds::Open => {
                    -of.viscosity_pa_s * of.length_m.powi(3) * SPEED * c * e * a.sin() / gap(a).powi(3)
                }
                DamperEnds::Closed => (pressure + 0.5 * slope * step) * of.length_m,
            };
            pressure += slope * step;
            let line = if of.film == DamperFilm::Half { line.max(0.0) } else { line };
            // the journal stands at θ = π and moves towards −π/2
            inward -= line * a.cos() * radius * step;
            across -= line * a.sin() * radius * step;
        }
        (inward / (c * e), across / (c * e * SPEED))
    }

    #[test]
    fn the_closed_forms_are_the_integrals_of_the_films_pressure() {
        for ends in [DamperEnds::Open, DamperEnds::Closed] {
            for film in [DamperFilm::Full, DamperFilm::Half] {
                for orbit in [0.05, 0.3, 0.7] {
                    let damper = damper(ends, film, orbit);
                    let (stiffness, damping) = summed(&damper);
                    let (k, c) = damper.coefficients(SPEED);
                    assert!((c[(0, 0)] / damping - 1.0).abs() < 1e-5, "{damper:?} {damping} {c}");
                    assert!(
                        (k[(0, 0)] - stiffness).abs() < 1e-5 * SPEED * damping,
                        "{damper:?} {stiffness} {k}"
                    );
                }
            }
        }
    }

    #[test]
    fn small_motion_has_damping_and_the_springs_stiffness_alone() {
        for film in [DamperFilm::Full, DamperFilm::Half] {
            let damper = SqueezeFilm { spring_n_m: 3e6, ..damper(DamperEnds::Open, film, 0.0) };
            let (k, c) = damper.coefficients(SPEED);
            assert_eq!(k, Matrix2::identity() * 3e6);
            assert!(c[(0, 0)] > 0.0 && c[(0, 1)] == 0.0);
        }
    }

    #[test]
    fn numbers_out_of_range_are_refused_with_their_key() {
        let good = damper(DamperEnds::Open, DamperFilm::Full, 0.2);
        assert_eq!(good.check(), Ok(()));
        for (bad, key) in [
            (SqueezeFilm { orbit_ratio: 0.9, ..good }, "orbit_ratio"),
            (SqueezeFilm { radial_clearance_m: 0.0, ..good }, "radial_clearance_m"),
            (SqueezeFilm { length_m: f64::INFINITY, ..good }, "length_m"),
            (SqueezeFilm { viscosity_pa_s: -0.01, ..good }, "viscosity_pa_s"),
            (SqueezeFilm { spring_n_m: -1.0, ..good }, "spring_n_m"),
        ] {
            assert_eq!(bad.check().expect_err(key).0, key);
        }
    }

    #[test]
    fn the_support_has_the_damper_s_coefficients_at_every_speed() {
        let stiff = SqueezeFilm { spring_n_m: 5e6, ..damper(DamperEnds::Open, DamperFilm::Half, 0.4) };
        for law in
            [stiff, SqueezeFilm { orbit_ratio: 0.0, ..stiff }, SqueezeFilm { spring_n_m: 0.0, ..stiff }]
        {
            for speed in [50.0, 333.0, 1200.0] {
                let (k, c) = law.coefficients(speed);
                let at = BearingLaw::coefficients(&law, speed);
                assert!(
                    (at.stiffness - k).norm() < 1e-9 * k.norm().max(1.0)
                        && (at.damping - c).norm() < 1e-9 * c.norm()
                );
            }
        }
    }
}
