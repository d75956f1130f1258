//! Full-precision model of a rotor on its bearings: what the controller's model is made from,
//! checked against and identified with.
//!
//! | module | holds |
//! |---|---|
//! | [`machine`] | the machine as drawn, and how far it may be off |
//! | [`rotor_file`] | `rotor.toml`: read, checked and written; files of ROSS |
//! | [`shaft`] | Timoshenko elements; K, M, G of the shaft with its disks |
//! | [`bearing`] | what holds the shaft |
//! | [`effects`] | the terms of a machine, and what a file's effects add to them; one file an effect |
//! | [`model`] | supports, forcings and readings on a shaft; the response at running speed |
//! | [`reduction`] | shape functions of reduced models |
//! | `receptance` | the same response by a small update of a shaft solved once |
//! | [`measurement`] | measured 1x vibration, and `measured.csv` |
//! | [`whole_file`] | files written whole or not at all |
//! | [`unbalance`] | g·mm and degrees; static and dynamic parts |
//! | `statistics` | scatter, whitening, evidence, search coordinates, convergence of chains |
//! | `fit` | hypotheses fitted to measurements |
//! | [`identify`] | bearings and unbalance from measurements: phase I and phase II |
//! | [`track`] | the unbalance of a long record, while bearings change |
//! | [`forecast`] | where the unbalance is going |
//! | [`startup`] | a single-disk rotor from its start-up: the simple model, and where it fails |
//! | [`simulate`] | readings that the machine of a file would give, with known effects |
//! | [`grade`] | balance quality grade of ISO 21940-11 |
//! | [`balance`] | correction weights from the model and from trial runs; the unbalance of single runs from others with stated weights |
//! | [`plan`](mod@plan) | what measurements could show before they are made |
//! | [`compare`], [`diagnose`] | where a model misses; which effect is missing, and adding it |
//!
//! # Example
//! A machine is read or made in code, and asked:
//!
//! ```
//! use rotor_edge_desktop::model::Model;
//! use rotor_edge_desktop::rotor_file;
//! use rotor_edge_desktop::shaft::statics::mass_and_centre;
//! use rotor_edge_desktop::unbalance::phasor_kg_m;
//! use rotor_edge_desktop::units::{rad_s, rpm};
//!
//! let rotor = rotor_file::parse("fan.toml", r#"
//!     schema = 2
//!     name = "fan"
//!     shaft = [{ length_m = 1.0, outer_diameter_m = 0.06 }]
//!     disk = [{ name = "wheel", position_m = 0.5, mass_kg = 12.0, diametral_inertia_kg_m2 = 0.06, polar_inertia_kg_m2 = 0.11 }]
//!     plane = [{ name = "wheel", position_m = 0.5 }]
//!     probe = [{ name = "X", bearing = "A", position_m = 0.15, angle_deg = 0 }]
//!     [[bearing]]
//!     name = "A"
//!     position_m = 0.1
//!     stiffness_n_m = { xx = 4e7, yy = 4e7 }
//!     damping_n_s_m = { xx = 2e4, yy = 2e4 }
//!     [[bearing]]
//!     name = "B"
//!     position_m = 0.9
//!     stiffness_n_m = { xx = 4e7, yy = 4e7 }
//!     damping_n_s_m = { xx = 2e4, yy = 2e4 }
//! "#)?;
//! let (mass_kg, centre_m) = mass_and_centre(&rotor);
//! assert!(mass_kg > 30.0 && (centre_m - 0.5).abs() < 1e-9);
//!
//! let model = Model::finite_elements(&rotor);
//! let response = model.response(rad_s(3000.0))?.at(&vec![phasor_kg_m(100.0, 45.0)].into());
//! assert!(response[0].norm() * 1e6 > 0.1, "µm at 3000 rpm");
//! # assert!((rpm(rad_s(3000.0)) - 3000.0).abs() < 1e-9);
//! # Ok::<(), rotor_edge_desktop::Error>(())
//! ```
//!
//! `cargo run --release -p rotor-edge-desktop --example missing_effect` holds a model against measurements, asks what is
//! missing and adds it; `--example oil_film` looks a machine on oil films over.
//!
//! # Conventions
//! z along the shaft, rotation takes x into y. A probe reads `u(t) = u_c cos Ωt + u_s sin Ωt` from the
//! keyphasor mark on; as a phasor `Y = u_c − i u_s`, `u = Re(Y e^{iΩt})`. Unbalance `U` at angle α
//! pulls with `U Ω² cos(Ωt + α)` in x and `U Ω² sin(Ωt + α)` in y: the phasor `F = U Ω² e^{iα}` in x and
//! `−iF` in y. Everything inside is in SI units and radians; files and reports use µm, g·mm, rpm
//! and degrees, and their names say so.

pub mod balance;
pub mod bearing;
pub mod check;
pub mod compare;
mod cone;
mod decomposition;
pub mod diagnose;
pub mod effects;
mod error;
mod file_kind;
mod fit;
pub mod forecast;
pub mod grade;
pub mod identify;
pub mod machine;
pub mod measurement;
pub mod model;
pub mod plan;
mod receptance;
pub mod reduction;
pub mod rotor_file;
pub mod shaft;
pub mod simulate;
pub mod spreadsheet;
pub mod startup;
mod statistics;
#[cfg(test)]
mod testing;
pub mod track;
pub mod unbalance;
pub mod units;
pub mod whole_file;

pub use error::{Error, FilmError, ForecastError, StartupError, TrackError};
pub use statistics::{interval, significance};
