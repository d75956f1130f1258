//! Reports: one HTML file with figures in it, for a screen, a phone and paper.
//!
//! | module | holds |
//! |---|---|
//! | [`document`] | sections, tables, figures; the page around them |
//! | [`comparison`] | what `compare --report` says |
//! | [`bode`], [`polar`], [`orbit`] | one probe over speed; one bearing at one speed |
//! | [`residual_map`] | residual by speed and probe |
//! | [`startup`], [`balance`] | what `startup --report` and `balance --report` say |
//! | [`wave`] | one turn of the shaft over time |
//! | [`sketch`], [`campbell`] | the machine to scale; its natural frequencies over speed |
//! | [`trend`], [`bars`] | anything over time; anything ranked |
//!
//! A file needs nothing but itself: figures are inline SVG, there is no script, and its own content
//! policy forbids the browser to fetch anything. Every figure is drawn for a width of
//! [`canvas::WIDTH_PX`], a phone's, so that its text is as large as the text around it; a screen shows
//! two of them side by side.

pub mod balance;
pub mod bars;
pub mod bode;
pub mod campbell;
pub mod canvas;
pub mod comparison;
pub mod document;
pub mod orbit;
pub mod polar;
pub mod residual_map;
pub mod scale;
pub mod sketch;
pub mod startup;
pub mod trend;
pub mod wave;

pub use balance::balance_sections;
pub use comparison::{Prediction, comparison_sections};
pub use startup::startup_sections;

pub use document::{Figure, Section, Table, identifier, page};

use nalgebra::Complex;

/// One model's response at one probe.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// What the legend calls it.
    pub label: String,
    /// Speed in rpm and phasor in m, by ascending speed.
    pub points: Vec<(f64, Complex<f64>)>,
}
