//! Answers for people: text for a terminal, and one HTML file with figures for a screen, a phone and paper. Text, tables and
//! sentences are made from the types of [`crate::answers`].
//!
//! | module | holds |
//! |---|---|
//! | [`document`] | sections, tables, figures |
//! | [`page`](mod@page) | the page around them |
//! | [`story`] | the first screen of a page |
//! | [`text`] | tables for a terminal |
//! | [`balance`](mod@balance) | text and section of `balance` |
//! | [`trial_balance`] | text and section of `balance --trial-only` |
//! | [`check`](mod@check) | text and sections of `check` |
//! | [`startup`](mod@startup) | text and sections of `startup` |
//! | [`estimate`](mod@estimate) | text, story and section of `estimate` |
//! | [`extract`](mod@extract) | text and story of `extract` |
//! | [`identify`](mod@identify) | text, story and section of `identify` |
//! | [`replay`](mod@replay) | text of `replay` |
//! | [`simulate`](mod@simulate) | text and story of `simulate` |
//! | [`diagnose`](mod@diagnose), [`improve`](mod@improve) | text, story and sections of `diagnose` and `improve` |
//! | [`fitted`] | the story of fitted models |
//! | [`forecast`](mod@forecast), [`track`](mod@track) | text and sections of `forecast` and `track` |
//! | [`plan`](mod@plan) | text, story and sections of `plan` |
//! | [`imported`] | text of `import` and `import-rotor` |
//! | [`findings`] | noise, planes, unknown causes and parameters in sentences |
//! | [`quantity`] | a quantity with its uncertainty in the units of the trade |
//! | [`comparison`] | what `compare --report` says |
//! | [`bode`], [`polar`], [`orbit`] | one probe over speed; one bearing at one speed |
//! | [`centreline`] | where the shaft runs in a bearing |
//! | [`regions`], [`weights`] | unbalances with their regions; correction weights |
//! | [`residual_map`] | residual by speed and probe |
//! | [`cascade`] | spectra over speed or time |
//! | [`wave`] | one turn of the shaft over time |
//! | [`chart`] | what a figure is made of |
//! | [`sketch`], [`campbell`] | the machine to scale; its natural frequencies over speed |
//! | [`trend`], [`bars`] | anything over time; anything ranked |
//!
//! A file needs nothing but itself: figures are numbers in it, drawn by a library inside it (`library/`,
//! made of Apache ECharts) as `script/` says, and its own content policy forbids the browser to fetch
//! anything or to run anything else.
//!
//! Of the libraries that draw in a page, uPlot is the smallest (51 kB) but has neither vectors to save nor
//! planes of equal units; Plotly's basic bundle (1.19 MB) is heavier than a whole page may be with its
//! numbers; ECharts comes to 0.59 MB with what is used of it.

pub mod balance;
pub mod bars;
pub mod bode;
pub mod campbell;
pub mod cascade;
pub mod centreline;
pub mod chart;
pub mod check;
pub mod comparison;
pub mod curve;
pub mod diagnose;
pub mod dimensions;
pub mod document;
pub mod estimate;
pub mod extract;
pub mod findings;
pub mod fitted;
pub mod forecast;
mod ground;
pub mod identify;
pub mod imported;
pub mod improve;
pub mod orbit;
pub mod page;
pub mod plan;
pub mod polar;
pub mod quantity;
pub mod regions;
pub mod replay;
pub mod residual_map;
pub mod simulate;
pub mod sketch;
pub mod startup;
pub mod story;
pub mod text;
pub mod track;
pub mod trend;
pub mod trial_balance;
pub mod waterfall;
pub mod wave;
pub mod weights;

pub use comparison::{ComparedModel, Prediction, comparison_sections, noise_error, verdict};

pub use curve::Curve;
pub use document::{Drawing, Figure, PageTable, Section, identifier};
pub use page::page;
pub use story::Story;
