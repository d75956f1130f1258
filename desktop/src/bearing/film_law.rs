//! An oil film as the law of a bearing: three numbers that the data may decide, at all speeds together.

use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::{Matrix2, Vector2};

use super::curve::Curve;
use super::film::{Film, FilmTable};
use super::film_curve::FilmCurve;
use super::law::{BearingLaw, LawUnknown, Role};
use super::support::SupportLaw;
use crate::error::{Error, FilmError};
use crate::statistics::scale::Scale;

/// How far a film's numbers may be from what is stated while all is well, standard deviations of their logarithms:
/// bores are made to a tenth or two of the clearance; an oil's viscosity changes by a fifth within five kelvin; a static
/// load follows from weights and is moved by small misalignment. What lies further away is a finding.
const CLEARANCE_LOG_SD: f64 = 0.1;
const VISCOSITY_LOG_SD: f64 = 0.2;
const LOAD_LOG_SD: f64 = 0.1;

/// An oil film that carries a known load.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmLaw {
    /// As its file states it.
    pub film: Film,
    table: Arc<FilmTable>,
    at_rest: Option<Vector2<f64>>,
    /// From the file, or what the shaft's weight puts on the bearing; not a number while nobody has said.
    load_n: f64,
}

/// Tables that were solved: one for each shape of bearing, whatever its size.
static SOLVED: Mutex<Vec<Arc<FilmTable>>> = Mutex::new(Vec::new());

fn solved(film: &Film) -> Result<Arc<FilmTable>, Error> {
    let mut tables = SOLVED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(table) = tables.iter().find(|t| t.is_of(film)) {
        return Ok(table.clone());
    }
    let table = Arc::new(FilmTable::solve(film)?);
    tables.push(table.clone());
    Ok(table)
}

impl FilmLaw {
    /// Solves the film, once for every shape.
    ///
    /// # Errors
    /// If the film's numbers are out of range, or an equilibrium is not found.
    pub fn new(film: Film) -> Result<Self, Error> {
        film.check().map_err(|(key, expected)| FilmError::OutOfRange {
            key: format!("film.{key}"),
            expected: expected.to_string(),
        })?;
        let load_n = film.load_n.unwrap_or(f64::NAN);
        Ok(Self { table: solved(&film)?, load_n, at_rest: film.at_rest(), film })
    }

    /// As the file states it.
    pub fn film(&self) -> &Film {
        &self.film
    }

    pub fn load_n(&self) -> f64 {
        self.load_n
    }

    /// Whether the file leaves the load to the shaft's weight.
    pub fn carries_weight(&self) -> bool {
        self.film.load_n.is_none()
    }

    /// Sets what the shaft's weight puts on the bearing, N.
    pub fn carry(&mut self, load_n: f64) {
        self.load_n = load_n;
    }

    /// The film over speed, as stated.
    pub fn curve(&self) -> FilmCurve {
        FilmCurve {
            film: Arc::new(self.film.clone()),
            table: self.table.clone(),
            at_rest: self.at_rest,
            clearance_m: self.film.radial_clearance_m,
            viscosity_pa_s: self.film.viscosity().unwrap_or(f64::NAN),
            load_n: self.load_n,
        }
    }
}

impl BearingLaw for FilmLaw {
    fn unknowns(&self) -> Vec<LawUnknown> {
        let curve = self.curve();
        let number = |symbol: &str, unit, value: f64, prior_sd| LawUnknown {
            symbol: symbol.into(),
            unit,
            role: Role::Other,
            scale: Scale::Logarithmic,
            stated: value.ln(),
            prior_sd,
        };
        vec![
            number("clearance", "m", curve.clearance_m, CLEARANCE_LOG_SD),
            number("viscosity", "Pa·s", curve.viscosity_pa_s, VISCOSITY_LOG_SD),
            number("load", "N", curve.load_n, LOAD_LOG_SD),
        ]
    }

    fn support(&self, x: &[f64]) -> SupportLaw {
        let mut curve = self.curve();
        if let &[clearance, viscosity, load] = x {
            (curve.clearance_m, curve.viscosity_pa_s, curve.load_n) =
                (clearance.exp(), viscosity.exp(), load.exp());
        }
        let film = Some(Curve::Film(curve));
        SupportLaw { curve: film, ..SupportLaw::linear(Matrix2::zeros(), Matrix2::zeros()) }
    }

    fn assign(&mut self, x: &[f64]) {
        let &[clearance, viscosity, load] = x else { return };
        self.film.radial_clearance_m = clearance.exp();
        self.film.viscosity_pa_s = Some(viscosity.exp());
        (self.film.iso_vg, self.film.temperature_c) = (None, None);
        self.film.load_n = Some(load.exp());
        self.load_n = load.exp();
    }

    fn check(&self) -> Result<(), (String, String)> {
        self.film.check().map_err(|(key, what)| (format!("film.{key}"), what))?;
        if self.load_n > 0.0 && self.load_n.is_finite() {
            return Ok(());
        }
        let what = if self.load_n.is_nan() {
            "its load is not known, as two bearings at least share the shaft's weight; state load_n".into()
        } else {
            format!(
                "the shaft's weight puts {:.1} N on this bearing, a film needs a load that presses; state load_n",
                self.load_n
            )
        };
        Err(("film".into(), what))
    }

    fn opens_cross_terms(&self) -> bool {
        true
    }

    fn follows_speed(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain() -> FilmLaw {
        let film = "kind = 'plain'\ndiameter_m = 0.1\nlength_m = 0.05\nradial_clearance_m = 1e-4\n\
                    iso_vg = 46.0\ntemperature_c = 55.0\nload_n = 2000.0";
        FilmLaw::new(toml::from_str(film).unwrap()).unwrap()
    }

    #[test]
    fn films_of_one_shape_share_one_table_whatever_their_size() {
        let mut other = plain().film;
        (other.diameter_m, other.length_m) = (0.2, 0.1);
        other.radial_clearance_m = 2e-4;
        assert!(Arc::ptr_eq(&plain().table, &FilmLaw::new(other).unwrap().table));
    }

    #[test]
    fn assigned_film_equals_its_support_and_states_viscosity() {
        let mut law = plain();
        let x = [1.3e-4_f64.ln(), 0.02_f64.ln(), 2500.0_f64.ln()];
        let before = law.support(&x).coefficients(500.0);
        law.assign(&x);
        let after = law.coefficients(500.0);
        assert!((before.stiffness - after.stiffness).norm() < 1e-9 * before.stiffness.norm());
        assert_eq!(law.film.iso_vg, None);
        assert!(law.check().is_ok());
    }

    #[test]
    fn a_load_that_lifts_and_an_eccentricity_out_of_range_are_told() {
        let mut law = plain();
        law.carry(-120.0);
        let (key, what) = law.check().unwrap_err();
        assert!(key == "film" && what.contains("-120.0 N"), "{what}");
        law.carry(f64::NAN);
        assert!(law.check().unwrap_err().1.contains("not known"));
        let mut curve = plain().curve();
        curve.load_n = 1e7;
        assert!(curve.state(500.0).unwrap_err().to_string().contains("0.95"));
        let [slowest, _] = curve.range_rad_s();
        assert_eq!(curve.at(500.0), curve.at(slowest), "held at the edge of the range");
        let [slowest, fastest] = plain().curve().range_rad_s();
        assert!(
            plain().curve().state(slowest * 1.001).is_ok() && plain().curve().state(slowest * 0.9).is_err()
        );
        assert!(plain().curve().state(fastest * 1.1).is_err());
    }

    #[test]
    fn journal_rises_with_speed_along_rotation_within_the_bore() {
        let curve = plain().curve();
        let mut last_m = 0.0;
        for speed_rad_s in [50.0, 150.0, 450.0] {
            let risen = curve.risen_m(speed_rad_s).unwrap();
            // from the lowest point, 1e-4 m below the centre, towards the centre: up, and to +x, where x turns to y
            assert!(risen.x > 0.0 && risen.y > last_m && risen.y < 1e-4, "{risen}");
            last_m = risen.y;
        }
    }

    #[test]
    fn journal_outside_film_range_stays_at_end_of_range() {
        let curve = plain().curve();
        let [slowest, fastest] = curve.range_rad_s();
        for (beyond, end) in [(0.1 * slowest, slowest), (10.0 * fastest, fastest)] {
            assert!(curve.state(beyond).is_err());
            assert_eq!(curve.risen_m(beyond), curve.risen_m(end));
        }
    }
}
