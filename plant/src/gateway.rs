//! From CAN buses into a sink: a thread listens to each bus, one writes.

use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use jiff::Timestamp;
use rotor_edge::bus::{BusSpec, CanBus};
use rotor_edge_core::can::{OLDEST_PROTOCOL_VERSION, PROTOCOL_VERSION};

use crate::hearing::Hearing;
use crate::item::{Body, Item};
use crate::sink::Sink;

/// Items are kept together that come within this time,
const TOGETHER: Duration = Duration::from_millis(200);
/// and at most so many at once.
const MOST_TOGETHER: usize = 2_000;
/// Items that wait in memory while the sink takes none: some 100 MB, seven minutes of a bus with 30 monitors.
const MOST_WAITING: usize = 250_000;
/// Wait before the sink is asked again.
const AGAIN: Duration = Duration::from_secs(1);
/// How long a bus is listened to before somebody looks whether to end.
const LOOK: Duration = Duration::from_millis(100);

/// A bus of the plant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Named {
    /// Its name in the plant.
    pub name: String,
    pub spec: BusSpec,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct GatewayTotals {
    pub kept: u64,
    /// Items for which there was no room while the sink took none.
    pub lost: u64,
}

/// Listens until `stop` rises, and keeps what it has heard until then. `tell` hears what a person should know.
///
/// # Errors
/// If a bus cannot be joined, if a wire fails for good, or if at the end something heard is not kept.
pub fn run(
    plant: &str,
    buses: &[Named],
    sink: &mut dyn Sink,
    stop: &AtomicBool,
    tell: fn(&str),
) -> Result<GatewayTotals> {
    let mut joined = Vec::new();
    for Named { name, spec } in buses {
        let bus = spec.open_lasting(tell)?;
        joined.push((bus, Hearing::new(plant, name, sink.last(plant, name)?)));
    }
    let names: Vec<&str> = buses.iter().map(|bus| bus.name.as_str()).collect();
    tell(&format!("From {} of {plant} to {}; Ctrl-C ends it.", names.join(", "), sink.description()));
    let (heard, to_keep) = channel();
    let backlog = &Backlog::default();
    std::thread::scope(|scope| {
        let listeners: Vec<_> = joined
            .into_iter()
            .map(|(bus, hearing)| {
                let heard = heard.clone();
                scope.spawn(move || listen(bus, hearing, &heard, backlog, stop, tell))
            })
            .collect();
        drop(heard);
        let writer = Writer { sink, tell, backlog, waiting: Vec::new(), again: None, kept: 0 };
        let kept = writer.run(&to_keep);
        for listener in listeners {
            listener.join().unwrap_or_else(|_| bail!("the connection to a bus failed"))?;
        }
        Ok(GatewayTotals { kept: kept?, lost: backlog.lost.load(Ordering::Relaxed) })
    })
}

/// What was heard and is not kept yet. A bus does not wait: whoever listens to it must go on while a sink is slow.
#[derive(Default)]
struct Backlog {
    waiting: AtomicUsize,
    lost: AtomicU64,
}

impl Backlog {
    /// Whether there is room for one more.
    fn admits(&self, tell: fn(&str)) -> bool {
        if self.waiting.fetch_add(1, Ordering::Relaxed) < MOST_WAITING {
            return true;
        }
        self.waiting.fetch_sub(1, Ordering::Relaxed);
        if self.lost.fetch_add(1, Ordering::Relaxed) == 0 {
            tell(&format!(
                "{MOST_WAITING} items wait and there is no room for more: what is heard now is lost"
            ));
        }
        false
    }
}

fn listen(
    mut bus: Box<dyn CanBus>,
    mut hearing: Hearing,
    heard: &Sender<Item>,
    backlog: &Backlog,
    stop: &AtomicBool,
    tell: fn(&str),
) -> Result<()> {
    let begun = Instant::now();
    let mut strangers = [false; 256];
    while !stop.load(Ordering::Relaxed) {
        let Some(frame) = bus.receive(LOOK).inspect_err(|_| stop.store(true, Ordering::Relaxed))? else {
            continue;
        };
        let elapsed_us = begun.elapsed().as_micros() as u64;
        let now_us = Timestamp::now().as_microsecond();
        let Some(item) = hearing.receive(elapsed_us, now_us, &frame) else { continue };
        if let Body::Heartbeat(heartbeat) = &item.body {
            let node = item.source.node;
            let known = (OLDEST_PROTOCOL_VERSION..=PROTOCOL_VERSION).contains(&heartbeat.protocol);
            if !known && !std::mem::replace(&mut strangers[usize::from(node)], true) {
                tell(&format!(
                    "{}: monitor {node} speaks version {} of the protocol, this gateway {PROTOCOL_VERSION}: what it tells may be \
                     missing; update one of them",
                    bus.description(),
                    heartbeat.protocol
                ));
            }
        }
        // the other end is gone when the writer has failed, which is told there
        if backlog.admits(tell) && heard.send(item).is_err() {
            break;
        }
    }
    Ok(())
}

/// Takes what was heard and has it kept.
struct Writer<'a> {
    sink: &'a mut dyn Sink,
    tell: fn(&str),
    backlog: &'a Backlog,
    waiting: Vec<Item>,
    /// When a sink that takes nothing is asked again.
    again: Option<Instant>,
    kept: u64,
}

impl Writer<'_> {
    /// How many items are kept when there are none to come any more.
    fn run(mut self, to_keep: &Receiver<Item>) -> Result<u64> {
        while self.gather(to_keep) {
            if self.again.is_none_or(|again| again <= Instant::now()) {
                // told by it
                let _ = self.keep();
            }
        }
        self.keep().with_context(|| format!("{} received items could not be stored", self.waiting.len()))?;
        Ok(self.kept)
    }

    /// Waits for items and takes those that come soon; false when there will be none any more.
    fn gather(&mut self, to_keep: &Receiver<Item>) -> bool {
        let until = Instant::now() + TOGETHER;
        loop {
            match to_keep.recv_timeout(until.saturating_duration_since(Instant::now())) {
                Ok(item) => self.waiting.push(item),
                Err(RecvTimeoutError::Timeout) => return true,
                Err(RecvTimeoutError::Disconnected) => return false,
            }
            if self.again.is_none() && self.waiting.len() >= MOST_TOGETHER {
                return true;
            }
        }
    }

    fn keep(&mut self) -> Result<()> {
        while !self.waiting.is_empty() {
            let batch = self.waiting.len().min(MOST_TOGETHER);
            let name = self.sink.description();
            if let Err(error) = self.sink.put(&self.waiting[..batch]) {
                if self.again.is_none() {
                    (self.tell)(&format!(
                        "{name} takes nothing any more ({error:#}); what is heard waits, and it is asked again"
                    ));
                }
                self.again = Some(Instant::now() + AGAIN);
                return Err(error);
            }
            self.waiting.drain(..batch);
            self.backlog.waiting.fetch_sub(batch, Ordering::Relaxed);
            self.kept += batch as u64;
            if self.again.take().is_some() {
                (self.tell)(&format!("{name} takes what is heard again"));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use crate::item::{Heartbeat, Kind, SCHEMA, Source};
    use crate::numbering::Last;

    use super::*;

    /// Fails so often, and then takes.
    struct Moody {
        failures: usize,
        kept: Vec<Item>,
    }

    impl Sink for Moody {
        fn claim(&mut self, _: &str, _: &str) -> Result<()> {
            Ok(())
        }

        fn last(&mut self, _: &str, _: &str) -> Result<Vec<(u8, Kind, Last)>> {
            Ok(Vec::new())
        }

        fn put(&mut self, items: &[Item]) -> Result<()> {
            if self.failures > 0 {
                self.failures -= 1;
                bail!("the disk is full");
            }
            self.kept.extend_from_slice(items);
            Ok(())
        }

        fn description(&self) -> String {
            "moody".into()
        }
    }

    fn items(count: u16) -> Vec<Item> {
        let source = Source { plant: "north".into(), bus: "can0".into(), node: 1 };
        let body = Heartbeat { protocol: 1, state: "tracking".into(), reason: "none".into(), readings: 1 };
        let item = |sequence| Item {
            schema: SCHEMA,
            source: source.clone(),
            epoch: 0,
            sequence,
            time_us: 0,
            is_clock_doubtful: false,
            body: Body::Heartbeat(body.clone()),
        };
        (0..count).map(item).collect()
    }

    fn written(failures: usize, count: u16) -> (Result<u64>, Vec<Item>) {
        let mut sink = Moody { failures, kept: Vec::new() };
        let (heard, to_keep) = channel();
        let backlog = Backlog { waiting: AtomicUsize::new(count.into()), lost: AtomicU64::new(0) };
        let writer = Writer {
            sink: &mut sink,
            tell: |_| {},
            backlog: &backlog,
            waiting: Vec::new(),
            again: None,
            kept: 0,
        };
        items(count).into_iter().for_each(|item| heard.send(item).unwrap());
        drop(heard);
        let kept = writer.run(&to_keep);
        assert_eq!(backlog.waiting.into_inner(), usize::from(count) - sink.kept.len());
        (kept, sink.kept)
    }

    #[test]
    fn refused_items_are_kept_and_stored_later_in_order() {
        for failures in [0, 1] {
            let (count, kept) = written(failures, 5_000);
            assert_eq!(count.unwrap(), 5_000);
            assert_eq!(kept, items(5_000), "{failures} failures");
        }
    }

    #[test]
    fn beyond_what_may_wait_an_item_is_lost_and_counted() {
        let backlog = Backlog { waiting: AtomicUsize::new(MOST_WAITING - 1), lost: AtomicU64::new(0) };
        assert_eq!([(); 3].map(|()| backlog.admits(|_| {})), [true, false, false]);
        assert_eq!(backlog.waiting.into_inner(), MOST_WAITING);
        assert_eq!(backlog.lost.into_inner(), 2);
    }

    #[test]
    fn what_is_not_kept_at_the_end_is_an_error_that_says_how_much() {
        let (totals, _) = written(usize::MAX, 30);
        assert_eq!(
            format!("{:#}", totals.unwrap_err()),
            "30 received items could not be stored: the disk is full"
        );
    }
}
