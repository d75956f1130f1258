//! A bus by TCP whose server may go away and come back: whoever is on it stays what it is, and joins again.

use std::time::Duration;

use anyhow::Result;
use rotor_edge_core::can::Frame;

use super::can_bus::{CanBus, monotonic};
use super::spec::{BusSpec, SlcanLink};

/// Wait before the first attempt to join again; it doubles with every one that fails.
const FIRST_WAIT: Duration = Duration::from_millis(200);
/// Longest wait between two attempts.
const LONGEST_WAIT: Duration = Duration::from_secs(5);

/// Makes a connection, and passes the time until the next attempt.
pub trait Join: Send {
    /// Joins the bus.
    ///
    /// # Errors
    /// If the bus is not there.
    fn join(&mut self) -> Result<Box<dyn CanBus>>;

    /// As [`CanBus::now`], also while there is no connection.
    fn now(&self) -> Duration {
        monotonic()
    }

    fn wait(&mut self, time: Duration) {
        std::thread::sleep(time);
    }
}

impl<F: FnMut() -> Result<Box<dyn CanBus>> + Send> Join for F {
    fn join(&mut self) -> Result<Box<dyn CanBus>> {
        self()
    }
}

/// Is told of an outage when it begins and when it ends.
pub type Tell = fn(&str);

/// A bus that is joined again when it fails. Meanwhile nothing is heard, and what is sent is lost, as on an unplugged wire.
pub struct Reconnecting {
    join: Box<dyn Join>,
    tell: Box<dyn FnMut(&str) + Send>,
    name: String,
    link: Link,
    /// By connections that are gone.
    passed_over: u64,
}

enum Link {
    Up(Box<dyn CanBus>),
    Down { next: Duration, wait: Duration },
}

impl BusSpec {
    /// Joins the bus, and joins it again whenever its server comes back; wires and serial ports fail for good.
    ///
    /// # Errors
    /// If the bus cannot be joined now, as [`BusSpec::open`].
    pub fn open_lasting(&self, tell: Tell) -> Result<Box<dyn CanBus>> {
        let bus = self.open()?;
        if !matches!(self, Self::Slcan { line: SlcanLink::Tcp(_), .. } | Self::Socketcand { .. }) {
            return Ok(bus);
        }
        let spec = self.clone();
        Ok(Box::new(Reconnecting::new(bus, move || spec.open(), tell)))
    }
}

impl Reconnecting {
    /// Begins with a connection; `tell` hears when an outage begins and when it ends.
    pub fn new(
        bus: Box<dyn CanBus>,
        join: impl Join + 'static,
        tell: impl FnMut(&str) + Send + 'static,
    ) -> Self {
        let name = bus.description();
        Self { join: Box::new(join), tell: Box::new(tell), name, link: Link::Up(bus), passed_over: 0 }
    }

    fn lost(&mut self) {
        self.passed_over = self.passed_over();
        self.link = Link::Down { next: self.now() + FIRST_WAIT, wait: FIRST_WAIT };
        (self.tell)(&format!("the bus {} is gone; trying again", self.name));
    }

    fn try_again(&mut self, wait: Duration) {
        if let Ok(bus) = self.join.join() {
            self.link = Link::Up(bus);
            (self.tell)(&format!("the bus {} is back", self.name));
        } else {
            let wait = (2 * wait).min(LONGEST_WAIT);
            self.link = Link::Down { next: self.now() + wait, wait };
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
                let (left, wait) = (next.saturating_sub(self.join.now()), *wait);
                if left.is_zero() {
                    self.try_again(wait);
                } else {
                    self.join.wait(left.min(timeout));
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

    fn now(&self) -> Duration {
        self.join.now()
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

    /// Nobody listens at two attempts; time passes only in waiting.
    struct Absent {
        attempts: Arc<AtomicUsize>,
        now: Duration,
    }

    impl Join for Absent {
        fn join(&mut self) -> Result<Box<dyn CanBus>> {
            match self.attempts.fetch_add(1, Ordering::Relaxed) {
                0 | 1 => bail!("nobody listens"),
                _ => Ok(Box::new(Torn)),
            }
        }

        fn now(&self) -> Duration {
            self.now
        }

        fn wait(&mut self, time: Duration) {
            self.now += time;
        }
    }

    #[test]
    fn reconnecting_waits_double_and_each_outage_is_told_once() {
        let (attempts, said) = (Arc::new(AtomicUsize::new(0)), Arc::new(Mutex::new(Vec::new())));
        let join = Absent { attempts: attempts.clone(), now: Duration::ZERO };
        let told = said.clone();
        let tell = move |words: &str| told.lock().unwrap().push(words.to_string());
        let mut bus = Reconnecting::new(Box::new(Torn), join, tell);
        let up = |bus: &Reconnecting| bus.description() == "torn";
        bus.send(&Frame::standard(1, &[]).unwrap()).unwrap();
        assert!(!up(&bus));
        while !up(&bus) {
            bus.send(&Frame::standard(1, &[]).unwrap()).unwrap();
            assert_eq!(bus.receive(Duration::from_millis(5)).unwrap(), None);
            assert!(bus.now() < Duration::from_secs(20));
        }
        // 0.2 s, 0.4 s, 0.8 s
        assert_eq!(bus.now(), 7 * FIRST_WAIT);
        assert_eq!(attempts.load(Ordering::Relaxed), 3);
        assert_eq!(*said.lock().unwrap(), ["the bus torn is gone; trying again", "the bus torn is back"]);
        bus.receive(Duration::ZERO).unwrap();
        assert_eq!(bus.passed_over(), 6, "by both connections");
        assert_eq!(said.lock().unwrap().len(), 3, "another outage");
    }
}
