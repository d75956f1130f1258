//! Who hears how far a command is.

use indicatif::ProgressBar;

use super::output;

/// Who runs a command.
#[derive(Clone, Copy)]
pub enum Listener<'a> {
    /// A person: bars on standard error, nothing where that is not a terminal.
    Terminal,
    /// A program, that is told the steps done, and of how many where that is known.
    Program(&'a dyn Fn(usize, Option<usize>)),
}

impl Listener<'_> {
    /// Work of so many steps.
    pub fn progress(self, what: &str, steps: usize) -> ProgressBar {
        match self {
            Self::Terminal => output::progress(what, steps),
            Self::Program(_) => ProgressBar::hidden(),
        }
    }

    /// Work of unknown length.
    pub fn spinner(self, what: &str) -> ProgressBar {
        match self {
            Self::Terminal => output::spinner(what),
            Self::Program(_) => ProgressBar::hidden(),
        }
    }

    /// So many steps are done; a person sees that on the bar.
    pub fn step(self, done: usize, of: Option<usize>) {
        if let Self::Program(told) = self {
            told(done, of);
        }
    }
}
