//! What parts of the core take: a program whose features choose them. `black_box` hides what goes in and what comes out, so that
//! the compiler keeps what is between. It is built, and never run.

#![no_std]
#![no_main]

#[cfg(any(feature = "track", all(feature = "judge", not(feature = "extraction"))))]
use core::hint::black_box;
use core::panic::PanicInfo;

use cortex_m_rt::entry;

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    cortex_m::peripheral::SCB::sys_reset()
}

#[entry]
fn main() -> ! {
    #[cfg(feature = "track")]
    track::run();
    #[cfg(feature = "judge")]
    judge::run();
    #[cfg(feature = "can")]
    node::run();
    loop {
        cortex_m::asm::wfi();
    }
}

#[cfg(any(feature = "track", all(feature = "judge", not(feature = "extraction"))))]
fn reading() -> rotor_edge_core::reading::Reading {
    use rotor_edge_core::reading::{ProbeVector, Reading};
    loop {
        if let Some(reading) = Reading::new(black_box(9000.0), black_box(&[ProbeVector::LOST; 4])) {
            return reading;
        }
    }
}

/// Response and phase II.
#[cfg(feature = "track")]
mod track {
    use core::hint::black_box;

    use rotor_edge_core::model::Model;
    use rotor_edge_core::track::{TrackConfig, Tracker};

    pub fn run() {
        let bytes: &[u8] = black_box(&[]);
        let Ok(model) = Model::<6, 4, 2>::decode(bytes) else { return };
        let mut tracker = Tracker::new(&model);
        while let Ok(estimate) =
            tracker.update(&TrackConfig::default(), &model, &super::reading(), black_box(&[9000.0; 4]))
        {
            black_box(&estimate);
        }
    }
}

/// The monitor; its readings from samples with the feature `extraction`.
#[cfg(feature = "judge")]
mod judge {
    use core::hint::black_box;

    use rotor_edge_core::memory::Memory;
    use rotor_edge_core::monitor::Monitor;
    use rotor_edge_core::reading::{Keyphasor, Reading};
    use rotor_edge_core::thresholds::Thresholds;
    use rotor_edge_core::track::TrackConfig;

    pub fn run() {
        let bytes: &[u8] = black_box(&[]);
        let Ok(mut monitor) = Monitor::<6, 4, 2>::new(TrackConfig::default(), Thresholds::DEFAULT) else {
            return;
        };
        let _ = monitor.load(Ok(bytes));
        if let Some(memory) = Memory::decode(bytes) {
            monitor.restore(&memory);
        }
        loop {
            let (reading, keyphasor) = next();
            black_box(monitor.take(black_box(0), &reading, keyphasor));
            black_box(monitor.status(black_box(0)));
            black_box(monitor.memory().encode());
        }
    }

    #[cfg(not(feature = "extraction"))]
    fn next() -> (Reading, Keyphasor) {
        (super::reading(), black_box(Keyphasor::Locked))
    }

    #[cfg(feature = "extraction")]
    fn next() -> (Reading, Keyphasor) {
        use rotor_edge_core::extraction::{ExtractionConfig, Extractor, KeyphasorDetector};
        let mut keyphasor = KeyphasorDetector::new(2_400, 200);
        loop {
            let Ok(mut extractor) = Extractor::<4>::new(ExtractionConfig::new()) else { continue };
            while black_box(true) {
                let mark = keyphasor.push(black_box(0));
                if let Some(found) = extractor.push(black_box([0; 4]), mark) {
                    return (found.reading, found.keyphasor);
                }
            }
        }
    }
}

/// A node; with the feature `node` it takes commands.
#[cfg(feature = "can")]
mod node {
    use core::hint::black_box;

    use rotor_edge_core::can::Frame;
    use rotor_edge_core::node::{Node, NodeConfig};

    pub fn run() {
        let bytes: &[u8] = black_box(&[]);
        #[allow(unused_mut, reason = "without commands there is no key to set")]
        let mut config = NodeConfig::new(7);
        #[cfg(feature = "node")]
        {
            config.key = Some(rotor_edge_core::command::Key(black_box([0; 32])));
        }
        let Ok(mut node) = Node::<6, 4, 2>::new(config) else { return };
        let _ = node.load(Ok(bytes));
        node.restore(bytes);
        loop {
            if let Some(frame) = Frame::standard(black_box(0), black_box(&[0; 8])) {
                node.receive(black_box(0), &frame);
            }
            node.poll(black_box(0));
            while let Some(save) = node.to_save() {
                black_box(&save);
                node.saved(black_box(0), true);
            }
            while let Some(frame) = node.transmit() {
                black_box(frame);
            }
        }
    }
}
