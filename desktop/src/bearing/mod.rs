//! What holds the shaft: one file a law, and what a law makes of the motion of the shaft.

pub mod constant;
pub mod curve;
pub mod law;
pub mod support;
pub mod table;

use constant::Constant;
use law::BearingLaw;
use table::Table;

/// The law of a bearing: exactly one.
#[derive(Debug, Clone, PartialEq)]
pub enum Law {
    /// Eight coefficients, the same at every speed or learned over speed.
    Constant(Constant),
    /// Eight coefficients over speed.
    Table(Table),
}

impl Law {
    /// What every law can do.
    pub fn as_law(&self) -> &dyn BearingLaw {
        match self {
            Self::Constant(law) => law,
            Self::Table(law) => law,
        }
    }

    /// The same, to be changed.
    pub fn as_law_mut(&mut self) -> &mut dyn BearingLaw {
        match self {
            Self::Constant(law) => law,
            Self::Table(law) => law,
        }
    }
}
