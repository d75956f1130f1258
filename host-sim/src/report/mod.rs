//! Reports: one HTML file with figures in it, for a screen, a phone and paper.
//!
//! | module | holds |
//! |---|---|
//! | [`document`] | sections, tables, figures; the page around them |
//! | [`comparison`] | what `compare --report` says |
//! | [`bode`], [`polar`], [`orbit`] | one probe over speed; one bearing at one speed |
//! | [`centreline`] | where the shaft runs in a bearing |
//! | [`regions`], [`weights`] | unbalances with their regions; correction weights |
//! | [`residual_map`] | residual by speed and probe |
//! | [`cascade`] | spectra over speed or time |
//! | [`wave`] | one turn of the shaft over time |
//! | [`sketch`], [`campbell`] | the machine to scale; its natural frequencies over speed |
//! | [`trend`], [`bars`] | anything over time; anything ranked |
//!
//! A file needs nothing but itself: figures are inline SVG, there is no script, and its own content
//! policy forbids the browser to fetch anything. Every figure is drawn for a width of
//! [`canvas::WIDTH_PX`], a phone's, so that its text is as large as the text around it; a screen shows
//! two of them side by side.

pub mod bars;
pub mod bode;
pub mod campbell;
pub mod canvas;
pub mod cascade;
pub mod centreline;
pub mod comparison;
pub mod curve;
pub mod document;
pub mod orbit;
pub mod polar;
pub mod regions;
pub mod residual_map;
pub mod scale;
pub mod sketch;
pub mod trend;
pub mod wave;
pub mod weights;

pub use comparison::{Prediction, before_and_after, comparison_sections};

pub use curve::Curve;
pub use document::{Figure, Section, Table, identifier, page};
