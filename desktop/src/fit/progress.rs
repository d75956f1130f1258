//! How far a search is, for whoever waits.

use std::sync::atomic::{AtomicUsize, Ordering};

/// Hears how many fits are done, of how many that are planned so far.
pub type ProgressListener<'a> = &'a (dyn Fn(usize, usize) + Sync);

#[derive(Default)]
pub struct Progress<'a> {
    done: AtomicUsize,
    planned: AtomicUsize,
    told: Option<ProgressListener<'a>>,
}

impl<'a> Progress<'a> {
    pub fn telling(told: ProgressListener<'a>) -> Self {
        Self { told: Some(told), ..Self::default() }
    }

    /// From the beginning, for the same listener.
    pub fn anew(&self) -> Self {
        Self { told: self.told, ..Self::default() }
    }

    /// So many more are to come.
    pub fn plan(&self, fits: usize) {
        self.planned.fetch_add(fits, Ordering::Relaxed);
    }

    pub fn step(&self) {
        let done = 1 + self.done.fetch_add(1, Ordering::Relaxed);
        if let Some(told) = self.told {
            told(done, self.planned.load(Ordering::Relaxed).max(done));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    #[test]
    fn what_is_done_is_told_of_what_is_planned_so_far() {
        let heard = Mutex::new(Vec::new());
        let told = |done, of| heard.lock().unwrap().push((done, of));
        let progress = Progress::telling(&told);
        progress.plan(2);
        progress.step();
        progress.plan(3);
        progress.step();
        assert_eq!(*heard.lock().unwrap(), [(1, 2), (2, 5)]);
        Progress::default().step();
    }
}
