//! Files of other systems: tables of 1x readings (`rotor-edge import`) and sampled waveforms (`rotor-edge extract`).
//!
//! | module | holds |
//! |---|---|
//! | `format` | a format a file: bytes in, `sheets` of cells or the `samples` of channels out |
//! | `encoding`, `number`, `calendar` | characters, numbers and moments as exports write them |
//! | `table` | where in a sheet the header and the rows are |
//! | `sampling_preamble` | what stands above samples: rate, turns, unit |
//! | `sampled`, `samples`, `sample_times` | tables whose rows are samples, channels of samples, and their times |
//! | `streamed` | channels that stay in their file |
//! | `words`, `phrases`, `header`, `probes` | what a column's header says: quantity, unit, probe |
//! | `preamble`, `sensitivity` | what the lines above a table state |
//! | `conditions` | headers of temperatures, pressures and loads |
//! | `unit`, `column_units`, `target` | units and conventions, and what a column becomes |
//! | [`readings`] | tables made into measurements |
//! | `weights` | tables of trial weights |
//! | [`waveform`] | waveforms made into 1x readings by the core's extraction |

pub(crate) mod calendar;
mod column_units;
mod conditions;
pub mod dates;
mod encoding;
mod format;
mod header;
pub(crate) mod number;
mod phrases;
mod preamble;
mod probes;
pub mod readings;
mod sample_times;
mod sampled;
mod samples;
mod sampling_preamble;
mod sensitivity;
mod sheet;
mod sheets;
mod streamed;
mod table;
pub(crate) mod target;
pub(crate) mod unit;
pub mod waveform;
pub(crate) mod weights;
mod words;
