//! What can be wrong with a user's input, in one sentence each.

/// A problem with the input or with what was asked of it.
///
/// Every message is one sentence that names the file and the key or row and says what was expected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be read or written.
    #[error("{file}: {reason}")]
    File {
        /// The path as the user gave it.
        file: String,
        /// What the operating system said.
        reason: String,
    },
    /// A key of `rotor.toml` is missing, unknown or out of range.
    #[error("{file}: {key}: {expected}")]
    Rotor {
        /// The path as the user gave it.
        file: String,
        /// The key, as it would be written in the file.
        key: String,
        expected: String,
    },
    /// A row or column of a file of measurements, or of a bearing's table, cannot be used.
    #[error("{file}: {place}: {expected}")]
    Measurement {
        /// The path as the user gave it.
        file: String,
        /// The row or column.
        place: String,
        expected: String,
    },
    /// Phases were entered the wrong way round, lag as lead; whatever is made of them is wrong.
    #[error("{0}")]
    ReversedPhases(String),
    /// The covariance of what differs between runs cannot be inverted.
    #[error("the scatter of the runs is singular: a probe shows the same in every run")]
    SingularScatter,
    /// The data do not allow what was asked.
    #[error("{0}")]
    Unsuitable(String),
}

impl Error {
    pub(crate) fn file(file: &str, reason: impl ToString) -> Self {
        Self::File { file: file.into(), reason: reason.to_string() }
    }

    pub(crate) fn rotor(file: &str, key: impl Into<String>, expected: impl Into<String>) -> Self {
        Self::Rotor { file: file.into(), key: key.into(), expected: expected.into() }
    }

    pub(crate) fn measurement(file: &str, place: impl Into<String>, expected: impl Into<String>) -> Self {
        let (place, expected) = (one_line(&place.into()), one_line(&expected.into()));
        Self::Measurement { file: file.into(), place, expected }
    }
}

/// A quotation mark that is never closed makes the rest of a file one cell, and messages quote cells.
fn one_line(text: &str) -> String {
    const LONGEST: usize = 200;
    let line = text.replace(['\r', '\n'], " ");
    match line.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &line[..end]),
        None => line,
    }
}
