//! A bus by TCP whose server may go away and come back: whoever is on it stays what it is, and joins again.

use std::time::{Duration, Instant};

use anyhow::Result;
use rotor_edge_core::can::Frame;

use super::can_bus::CanBus;
use super::spec::{BusSpec, Line};

/// Wait before the first attempt to join again; it doubles with every one that fails.
const FIRST_WAIT: Duration = Duration::from_millis(200);
/// Longest wait between two attempts.
const LONGEST_WAIT: Duration = Duration::from_secs(5);

/// Makes a connection.
type Join = Box<dyn FnMut() -> Result<Box<dyn CanBus>> + Send>;
/// Is told of an outage when it begins and when it ends.
pub type Tell = fn(&str);

/// A bus that is joined again when it fails. Meanwhile nothing is heard, and what is sent is lost, as on an unplugged wire.
pub struct Reconnecting {
    join: Join,
    tell: Tell,
    name: String,
    link: Link,
    /// By connections that are gone.
    passed_over: u64,
}

enum Link {
    Up(Box<dyn CanBus>),
    Down { next: Instant, wait: Duration },
}

impl BusSpec {
    /// Joins the bus, and joins it again whenever its server comes back; wires and serial ports fail for good.
    ///
    /// # Errors
    /// If the bus cannot be joined now, as [`BusSpec::open`].
    pub fn open_lasting(&self, tell: Tell) -> Result<Box<dyn CanBus>> {
        let bus = self.open()?;
        if !matches!(self, Self::Slcan { line: Line::Tcp(_), .. } | Self::Socketcand { .. }) {
            return Ok(bus);
        }
        let spec = self.clone();
        Ok(Box::new(Reconnecting::new(bus, Box::new(move || spec.open()), tell)))
    }
}

impl Reconnecting {
    fn new(bus: Box<dyn CanBus>, join: Join, tell: Tell) -> Self {
        Self { join, tell, name: bus.description(), link: Link::Up(bus), passed_over: 0 }
    }

    fn lost(&mut self) {
        self.passed_over = self.passed_over();
        self.link = Link::Down { next: Instant::now() + FIRST_WAIT, wait: FIRST_WAIT };
        (self.tell)(&format!("the bus {} is gone; trying again", self.name));
    }

    fn try_again(&mut self, wait: Duration) {
        if let Ok(bus) = (self.join)() {
            self.link = Link::Up(bus);
            (self.tell)(&format!("the bus {} is back", self.name));
        } else {
            let wait = (2 * wait).min(LONGEST_WAIT);
            self.link = Link::Down { next: Instant::now() + wait, wait };
        }
    }
}

impl CanBus for Reconnecting {
    fn send(&mut self, frame: &Frame) -> Result<()> {
        if let Link::Up(bus) = &mut self.link
            && bus.send(frame).is_err()
        {
            self.lost();
        }
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>> {
        match &mut self.link {
            Link::Up(bus) => match bus.receive(timeout) {
                Ok(heard) => return Ok(heard),
                Err(_) => self.lost(),
            },
            Link::Down { next, wait } => {
                let (left, wait) = (next.saturating_duration_since(Instant::now()), *wait);
                if left.is_zero() {
                    self.try_again(wait);
                } else {
                    std::thread::sleep(left.min(timeout));
                }
            }
        }
        Ok(None)
    }

    fn description(&self) -> String {
        match self.link {
            Link::Up(_) => self.name.clone(),
            Link::Down { .. } => format!("{} (gone; trying again)", self.name),
        }
    }

    fn passed_over(&self) -> u64 {
        match &self.link {
            Link::Up(bus) => self.passed_over + bus.passed_over(),
            Link::Down { .. } => self.passed_over,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::sync::{Arc, Mutex};

    use anyhow::bail;

    use super::*;

    /// A bus that fails at once.
    struct Torn;

    impl CanBus for Torn {
        fn send(&mut self, _: &Frame) -> Result<()> {
            bail!("torn")
        }

        fn receive(&mut self, _: Duration) -> Result<Option<Frame>> {
            bail!("torn")
        }

        fn description(&self) -> String {
            "torn".into()
        }

        fn passed_over(&self) -> u64 {
            3
        }
    }

    static SAID: Mutex<Vec<String>> = Mutex::new(Vec::new());

    #[test]
    fn attempts_are_further_and_further_apart_and_each_outage_is_told_once() {
        let attempts = Arc::new(AtomicUsize::new(0));
        let counted = attempts.clone();
        let join: Join = Box::new(move || match counted.fetch_add(1, Ordering::Relaxed) {
            0 | 1 => bail!("nobody listens"),
            _ => Ok(Box::new(Torn)),
        });
        let mut bus = Reconnecting::new(Box::new(Torn), join, |said| SAID.lock().unwrap().push(said.into()));
        let begun = Instant::now();
        let up = |bus: &Reconnecting| bus.description() == "torn";
        bus.send(&Frame::standard(1, &[]).unwrap()).unwrap();
        assert!(!up(&bus));
        while !up(&bus) {
            bus.send(&Frame::standard(1, &[]).unwrap()).unwrap();
            assert_eq!(bus.receive(Duration::from_millis(5)).unwrap(), None);
            assert!(begun.elapsed() < Duration::from_secs(20));
        }
        // 0.2 s, 0.4 s, 0.8 s
        assert!(begun.elapsed() >= 7 * FIRST_WAIT, "{:?}", begun.elapsed());
        assert_eq!(attempts.load(Ordering::Relaxed), 3);
        assert_eq!(*SAID.lock().unwrap(), ["the bus torn is gone; trying again", "the bus torn is back"]);
        bus.receive(Duration::ZERO).unwrap();
        assert_eq!(bus.passed_over(), 6, "by both connections");
        assert_eq!(SAID.lock().unwrap().len(), 3, "another outage");
    }
}
