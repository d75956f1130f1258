//! Work that threads share.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

/// What `of` makes of each number below `count`, in their order.
pub fn in_order<T: Send>(count: usize, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let made: Vec<Mutex<Option<T>>> = (0..count).map(|_| Mutex::new(None)).collect();
    run(count, &|at| *made[at].lock().unwrap_or_else(PoisonError::into_inner) = Some(of(at)));
    made.into_iter().filter_map(|one| one.into_inner().unwrap_or_else(PoisonError::into_inner)).collect()
}

/// The same for all kinds of work, each of which would make the program larger.
fn run(count: usize, of: &(dyn Fn(usize) + Sync)) {
    match count {
        0 | 1 => (0..count).for_each(of),
        _ => (0..count).into_par_iter().for_each(of),
    }
}
