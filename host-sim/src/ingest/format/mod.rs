//! The formats of files, a file each.

mod arrays;
mod matlab;
mod numpy;
#[cfg(feature = "parquet")]
mod parquet;
pub(crate) mod samples;
mod samples_text;
mod spreadsheet;
pub(crate) mod table;
mod text;
mod wav;
