//! The loop between bus, keys and terminal.

use std::io::{IsTerminal, stdin, stdout};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use anyhow::{Context, Result, bail};
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyEvent};

use super::Watch;
use super::screen::{Flow, Screen};
use super::view::{WatchedBus, draw};
use crate::bus::CanBus;

/// Time between two pictures, and longest time to a key's effect.
const PICTURE_TIME: Duration = Duration::from_millis(100);
/// Longest wait for a frame before the clock is looked at.
const PATIENCE: Duration = Duration::from_millis(20);

/// Refuses to draw where nobody could see it or press a key.
///
/// # Errors
/// If standard input or output is no terminal.
pub fn require_terminal() -> Result<()> {
    for (name, is_terminal) in [("output", stdout().is_terminal()), ("input", stdin().is_terminal())] {
        if !is_terminal {
            bail!(
                "watch draws on a terminal and standard {name} is none: use --json, with --seconds S for how long to listen"
            );
        }
    }
    Ok(())
}

/// Hears everything on the bus for `time`, and asks what is to be asked; at least one look at the bus. Times count from
/// `started` of the bus's clock.
///
/// # Errors
/// If the bus is gone.
pub fn listen(bus: &mut dyn CanBus, watch: &mut Watch, started: Duration, time: Duration) -> Result<()> {
    let begun = bus.now();
    loop {
        for question in watch.questions() {
            bus.send(&question)?;
        }
        let left = time.saturating_sub(bus.now() - begun);
        let heard = bus.receive(left.min(PATIENCE))?;
        let now_us = (bus.now() - started).as_micros() as u64;
        match heard {
            Some(frame) => watch.receive(now_us, &frame),
            None => watch.pass(now_us),
        }
        if bus.now() - begun >= time {
            return Ok(());
        }
    }
}

/// Shows what is heard until a key, a signal or the end of `time`. The terminal is as before afterwards, whatever happens.
///
/// # Errors
/// If the bus is gone or the terminal cannot be drawn on.
pub fn show(
    bus: &mut dyn CanBus,
    watch: &mut Watch,
    place: &WatchedBus,
    time: Option<Duration>,
    stop: &AtomicBool,
) -> Result<()> {
    let mut terminal = Restored::begin()?;
    let keys = keys();
    let mut screen = Screen::default();
    let started = bus.now();
    while !stop.load(Ordering::Relaxed) && time.is_none_or(|time| bus.now() - started < time) {
        // a bus that is gone says so in its name
        let place = WatchedBus { bus: bus.description(), ..*place };
        terminal
            .0
            .draw(|frame| draw(frame, watch, &screen, &place))
            .context("the terminal cannot be drawn on")?;
        listen(bus, watch, started, PICTURE_TIME)?;
        for key in keys.try_iter() {
            if screen.key(watch, key) == Flow::Quit {
                return Ok(());
            }
        }
    }
    Ok(())
}

/// Keys as they are pressed, read by a thread of its own: reading from a terminal that is gone never returns.
fn keys() -> Receiver<KeyEvent> {
    let (sender, keys) = channel();
    std::thread::spawn(move || {
        while let Ok(event) = event::read() {
            if let Event::Key(key) = event
                && sender.send(key).is_err()
            {
                return;
            }
        }
    });
    keys
}

/// A terminal that is put back when this ends; ratatui's hook does so on a panic, before its message.
struct Restored(DefaultTerminal);

impl Restored {
    fn begin() -> Result<Self> {
        ratatui::try_init().map(Self).map_err(|e| {
            // part of it may have been done
            ratatui::restore();
            anyhow::Error::new(e).context("the terminal cannot be drawn on; use --json")
        })
    }
}

impl Drop for Restored {
    fn drop(&mut self) {
        // twice would put the cursor back on top of what the panic said
        if !std::thread::panicking() {
            ratatui::restore();
        }
    }
}
