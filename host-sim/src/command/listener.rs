//! Who hears how far a command is.

use indicatif::ProgressBar;

use super::output;

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

    pub fn spinner(self, what: &str) -> ProgressBar {
        match self {
            Self::Terminal => output::spinner(what),
            Self::Program(_) => ProgressBar::hidden(),
        }
    }

    /// Work of which more and more is planned, and what is to hear of it: `(done, planned)`.
    pub fn search(self, what: &str) -> (ProgressBar, impl Fn(usize, usize) + Sync) {
        let bar = self.progress(what, 1);
        let told = bar.clone();
        let tell = move |done: usize, planned: usize| {
            told.set_length(planned as u64);
            told.set_position(done as u64);
        };
        (bar, tell)
    }

    /// So many steps are done; a person sees that on the bar.
    pub fn step(self, done: usize, of: Option<usize>) {
        if let Self::Program(told) = self {
            told(done, of);
        }
    }
}
