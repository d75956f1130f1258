//! Time on the simulated bus, and programs that end.

use super::*;
use crate::bus::monotonic;

const SECOND: Duration = Duration::from_secs(1);

fn frame(id: u16) -> Frame {
    Frame::standard(id, &[id as u8]).unwrap()
}

/// Answers each frame with the next identifier after a second.
fn echo(bus: &SimulatedBus) -> Running<u32> {
    bus.start(|mut port| {
        let mut answered = 0;
        loop {
            match port.receive(SECOND) {
                Ok(Some(heard)) => {
                    let due = port.now() + SECOND;
                    while port.now() < due && port.receive(due - port.now()).is_ok() {}
                    if port.send(&frame(heard.raw_id() + 1)).is_err() {
                        return answered;
                    }
                    answered += 1;
                }
                Ok(None) => {}
                Err(_) => return answered,
            }
        }
    })
}

#[test]
fn simulated_hour_takes_no_time_and_repeats_exactly() {
    let run = || {
        let bus = SimulatedBus::new(BusConfig::default());
        let (mut port, echo) = (bus.join(), echo(&bus));
        let mut times = Vec::new();
        while bus.now() < 3_600 * SECOND {
            port.send(&frame(5)).unwrap();
            assert_eq!(port.receive(2 * SECOND).unwrap(), Some(frame(6)));
            times.push(bus.now());
        }
        assert_eq!(echo.kill() as usize, times.len());
        times
    };
    let begun = monotonic();
    let times = run();
    assert!(times[0] >= SECOND && times[0] < SECOND + Duration::from_millis(1), "{:?}", times[0]);
    assert_eq!(run(), times);
    assert!(monotonic() - begun < 60 * SECOND);
}

#[test]
fn simulated_timeout_ends_to_the_microsecond_without_programs() {
    let bus = SimulatedBus::new(BusConfig::default());
    let mut port = bus.join();
    assert_eq!(port.receive(SECOND).unwrap(), None);
    assert_eq!((bus.now(), port.now()), (SECOND, SECOND));
    assert_eq!(port.receive(Duration::ZERO).unwrap(), None);
    bus.pass(SECOND);
    assert_eq!(bus.now(), 2 * SECOND);
}

#[test]
fn simulated_connection_is_dead_after_an_outage_until_rejoined() {
    let bus = SimulatedBus::new(BusConfig::default());
    let mut port = bus.join();
    let mut again = port.rejoining();
    bus.go_away();
    assert!(port.send(&frame(1)).is_err() && again.join().is_err());
    bus.come_back();
    assert!(port.receive(SECOND).is_err(), "it was made before");
    let (mut port, mut other) = (again.join().unwrap(), bus.join());
    port.send(&frame(1)).unwrap();
    assert_eq!(other.receive(SECOND).unwrap(), Some(frame(1)));
}

#[test]
fn simulated_programs_fail_when_the_bus_is_dropped() {
    let bus = SimulatedBus::new(BusConfig::default());
    let program = bus.start(|mut port| while port.receive(SECOND).is_ok() {});
    bus.pass(SECOND);
    drop(bus);
    program.thread.join().unwrap();
}

#[test]
#[should_panic = "the program panicked"]
fn simulated_program_that_panics_is_noticed() {
    let bus = SimulatedBus::new(BusConfig::default());
    bus.start(|_| panic!("as it should")).end();
}
