//! Links only if no public path of the core can panic: the panic handler calls a symbol that nobody defines.

#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;

use rotor_edge_core::can::isotp::IsoTp;
use rotor_edge_core::can::slcan::{Decoder, Line, encode};
use rotor_edge_core::can::{Frame, NumberedReading, ResultAssembler, reading_frames};
use rotor_edge_core::command::{ANSWER_BYTES, Answer, Command, Key, MAX_REQUEST_BYTES, write_request};
use rotor_edge_core::extraction::{ExtractionConfig, Extractor, KeyphasorDetector};
use rotor_edge_core::model::Model;
use rotor_edge_core::node::{Node, NodeConfig};
use rotor_edge_core::reading::{ProbeVector, Reading};
use rotor_edge_core::residual::{Residual, ResidualConfig, ResidualMonitor};
use rotor_edge_core::response::response;
use rotor_edge_core::track::{TrackConfig, Tracker};

// The host's memcpy, memset and start-up code; nothing else of it is used. A bare target has its own.
#[cfg_attr(not(target_os = "none"), link(name = "c"))]
unsafe extern "C" {}

unsafe extern "C" {
    fn rotor_edge_core_can_panic() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    unsafe { rotor_edge_core_can_panic() }
}

const MODEL_BYTES: usize = Model::<6>::max_size_bytes();

#[unsafe(no_mangle)]
extern "C" fn main() -> i32 {
    #[cfg(feature = "with-panic")]
    black_box(black_box(None::<u8>).unwrap());
    let bytes = black_box([0; MODEL_BYTES]);
    if let Ok(model) = Model::<6>::decode(black_box(&bytes)) {
        numerics(&model);
        frames(model);
    }
    receive_result();
    command();
    extraction();
    lines();
    0
}

/// Response, phase II and the residual monitor, called as a host or a board without CAN would.
fn numerics(model: &Model<6>) {
    let mut again = black_box([0; MODEL_BYTES]);
    let _ = black_box(model.encode(black_box(&mut again)));
    let reading = Reading {
        speed_rpm: black_box(0.0),
        probes: black_box([ProbeVector { cos_um: 0.0, sin_um: 0.0 }; 4]),
    };
    let mut tracker = Tracker::new(model);
    let track = black_box(TrackConfig::default());
    let _ = black_box(tracker.update(&track, model, &reading));
    if let Ok(at_speed) = response(model, black_box(1.0), &black_box(Default::default())) {
        black_box(at_speed.features(&black_box([0.0; 4])));
        black_box(at_speed.support_amplitudes(&black_box([[0.0; 2]; 2])));
    }
    let mut monitor = ResidualMonitor::new();
    let config = black_box(ResidualConfig::default());
    for _ in 0..black_box(10) {
        if let Ok(residual) = Residual::new(&black_box([0.0; 8]), &black_box([0.0; 8])) {
            let _ = black_box(monitor.update(&config, residual));
        }
    }
    for probe in reading.probes {
        black_box((probe.peak_to_peak_um(), probe.lag_deg()));
    }
    for frame in reading_frames(black_box(0), &NumberedReading::new(black_box(0), reading)) {
        black_box(frame);
    }
}

/// A node among arbitrary frames at arbitrary times, its model replaced meanwhile.
fn frames(model: Model<6>) {
    let other = model.clone();
    let config = NodeConfig { key: Some(Key(black_box([0; 32]))), ..NodeConfig::new(0) };
    let Ok(mut node) = Node::new(black_box(config), model) else {
        return;
    };
    node.restore_counter(black_box(0));
    for _ in 0..black_box(100) {
        if let Some(frame) = any_frame() {
            node.receive(black_box(0), &frame);
        }
        node.poll(black_box(0));
        if let Some(save) = node.to_save() {
            black_box((save.counter, save.model));
        }
        node.saved(black_box(0), black_box(true));
        while let Some(frame) = node.transmit() {
            black_box(frame);
        }
        black_box((node.counters(), node.estimate(), node.verdict(), node.state()));
    }
    let _ = black_box(node.replace_model(black_box(other)));
    node.restart();
    black_box(node);
}

fn receive_result() {
    let mut assembler = ResultAssembler::new();
    for _ in 0..black_box(100) {
        if let Some(frame) = any_frame() {
            black_box(assembler.receive(&frame));
        }
    }
    black_box(assembler.damaged());
}

/// Arbitrary text as SLCAN.
fn lines() {
    let mut decoder = Decoder::new();
    for _ in 0..black_box(100) {
        if let Some(Line::Frame(frame)) = decoder.push(black_box(0)) {
            black_box(encode(&frame));
        }
    }
}

/// The host's side of a command.
fn command() {
    let (mut request, key) = (black_box([0; MAX_REQUEST_BYTES]), Key(black_box([0; 32])));
    let body = black_box([0; MODEL_BYTES]);
    let Some(length) =
        write_request(&mut request, &key, black_box(0), black_box(Command::Deploy), black_box(0), &body)
    else {
        return;
    };
    let request = request.get(..length).unwrap_or_default();
    let mut link = IsoTp::<ANSWER_BYTES, MAX_REQUEST_BYTES>::new();
    let _ = black_box(link.send(black_box(0), request));
    for _ in 0..black_box(100) {
        if let Some(frame) = any_frame() {
            let _ = black_box(link.receive(black_box(0), frame.bytes()));
        }
        let _ = black_box((link.check_time(black_box(0)), link.poll(black_box(0)), link.is_sending()));
    }
    black_box(Answer::decode(link.message(), request, &key));
}

/// Arbitrary samples and marks.
fn extraction() {
    let config = black_box(ExtractionConfig::new());
    let (mut detector, mut extractor) = (KeyphasorDetector::new(black_box(0), black_box(0)), Extractor::new());
    for _ in 0..black_box(100) {
        let mark = detector.push(black_box(0));
        black_box(extractor.push(&config, black_box([0; 4]), black_box(mark)));
    }
}

fn any_frame() -> Option<Frame> {
    let bytes = black_box([0; 16]);
    Frame::standard(black_box(0), bytes.get(..black_box(8))?)
}
