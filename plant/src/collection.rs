//! From a stream into a store. What is acknowledged is committed; what comes twice is stored once.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::Result;

use crate::item::Item;
use crate::sink::Sink;
use crate::stream::Stream;

/// Items that are committed together, at most.
const MOST_TOGETHER: usize = 10_000;
/// How long items are waited for.
const TOGETHER: Duration = Duration::from_millis(500);
/// Wait before a server that is gone is asked again.
const AGAIN: Duration = Duration::from_secs(1);

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CollectionTotals {
    pub stored: u64,
    /// Messages that are no items and were set aside.
    pub strange: u64,
}

/// Collects until `stop` rises. `name` is that of the durable consumer; `tell` hears what a person should know. A server or a
/// store that is gone is asked again.
///
/// # Errors
/// If the consumer cannot be made, or the store takes nothing when `stop` rises: items that are not stored stay in the stream.
pub fn run(
    stream: &Stream,
    name: &str,
    store: &mut dyn Sink,
    stop: &AtomicBool,
    tell: fn(&str),
) -> Result<CollectionTotals> {
    let consumer = stream.consumer(name)?;
    let mut totals = CollectionTotals::default();
    let mut is_gone = false;
    while !stop.load(Ordering::Relaxed) {
        let mut is_refused = false;
        let taken = stream.next(&consumer, MOST_TOGETHER, TOGETHER, |items| {
            keep(store, items, stop, tell).inspect_err(|_| is_refused = true)
        });
        match taken {
            Ok(taken) => {
                if std::mem::take(&mut is_gone) {
                    tell(&format!("{} is back", stream.description()));
                }
                totals.stored += taken.items as u64;
                totals.strange += taken.strange.len() as u64;
                taken.strange.iter().for_each(|why| tell(&format!("set aside: {why}")));
            }
            Err(error) if is_refused => return Err(error),
            Err(error) => {
                if !std::mem::replace(&mut is_gone, true) {
                    tell(&format!("{error:#}; trying again"));
                }
                std::thread::sleep(AGAIN);
            }
        }
    }
    Ok(totals)
}

/// Puts items until the store takes them. The server hands them out again meanwhile; those are stored once.
fn keep(store: &mut dyn Sink, items: &[Item], stop: &AtomicBool, tell: fn(&str)) -> Result<()> {
    if items.is_empty() {
        return Ok(());
    }
    let mut is_refused = false;
    while let Err(error) = store.put(items) {
        if stop.load(Ordering::Relaxed) {
            return Err(error.context("items that are not stored stay in the stream"));
        }
        if !std::mem::replace(&mut is_refused, true) {
            tell(&format!("{} takes nothing ({error:#}); trying again", store.description()));
        }
        std::thread::sleep(AGAIN);
    }
    if is_refused {
        tell(&format!("{} takes items again", store.description()));
    }
    Ok(())
}
