//! What holds the shaft: one file a law, and what a law makes of the motion of the shaft.

pub mod constant;
pub mod curve;
pub mod dynamic_coefficients;
pub mod film;
pub mod film_curve;
pub mod film_law;
pub mod flexibility;
pub mod foundation;
pub mod law;
pub mod magnetic;
pub mod rub;
pub mod squeeze_film;
pub mod support;
pub mod table;

use constant::Constant;
use film_law::FilmLaw;
use law::BearingLaw;
use magnetic::Magnetic;
use squeeze_film::SqueezeFilm;
use table::CoefficientTable;

/// The law of a bearing: exactly one.
#[derive(Debug, Clone, PartialEq)]
pub enum Law {
    /// Eight coefficients, the same at every speed or learned over speed.
    Constant(Constant),
    Table(CoefficientTable),
    /// An oil film, from its geometry.
    Film(FilmLaw),
    SqueezeFilm(SqueezeFilm),
    Magnetic(Magnetic),
}

impl Law {
    /// What every law can do.
    pub fn as_law(&self) -> &dyn BearingLaw {
        match self {
            Self::Constant(law) => law,
            Self::Table(law) => law,
            Self::Film(law) => law,
            Self::SqueezeFilm(law) => law,
            Self::Magnetic(law) => law,
        }
    }

    /// The same, to be changed.
    pub fn as_law_mut(&mut self) -> &mut dyn BearingLaw {
        match self {
            Self::Constant(law) => law,
            Self::Table(law) => law,
            Self::Film(law) => law,
            Self::SqueezeFilm(law) => law,
            Self::Magnetic(law) => law,
        }
    }
}
