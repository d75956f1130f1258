//! Links only if no public path of the core can panic: the panic handler calls a symbol that nobody defines.

#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;

use rotor_edge_core::can::isotp::IsoTp;
#[cfg(feature = "mac")]
use rotor_edge_core::can::mac::{Direction, Gate, Group, mac_frames};
use rotor_edge_core::can::parts::{Ack, Offer, answer_part, parts_of, request_part};
use rotor_edge_core::can::slcan::{Decoder, SlcanLine, encode};
use rotor_edge_core::can::{Frame, NumberedReading, ResultAssembler, reading_frames};
use rotor_edge_core::command::{ANSWER_BYTES, Answer, Command, Key, MAX_REQUEST_BYTES, write_request};
use rotor_edge_core::detector::{Average, Detector, Evidence, Growth, Observation, noise_floor_um};
use rotor_edge_core::extraction::{Converter, ExtractionConfig, Extractor, KeyphasorDetector};
use rotor_edge_core::model::{self, Noise};
use rotor_edge_core::node::{Node, NodeConfig, Save};
use rotor_edge_core::reading::{ProbeVector, Reading};
use rotor_edge_core::residual::Residual;
use rotor_edge_core::response::response;
use rotor_edge_core::state::Reason;
use rotor_edge_core::thresholds::Thresholds;
use rotor_edge_core::track::{TrackConfig, Tracker};

/// As a board holds them.
type Model = model::Model<6, 4, 2>;

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

const MODEL_BYTES: usize = Model::max_size_bytes();

#[unsafe(no_mangle)]
extern "C" fn main() -> i32 {
    #[cfg(feature = "with-panic")]
    black_box(black_box(None::<u8>).unwrap());
    let bytes = black_box([0; MODEL_BYTES]);
    if let Ok(model) = Model::decode(black_box(&bytes)) {
        numerics(&model);
        frames(model);
    }
    receive_result();
    #[cfg(feature = "mac")]
    authentication();
    command();
    extraction();
    lines();
    0
}

/// Response, phase II and the residual monitor, called as a host or a board without CAN would.
fn numerics(model: &Model) {
    let mut again = black_box([0; MODEL_BYTES]);
    let _ = black_box(model.encode(black_box(&mut again)));
    let vectors = black_box([ProbeVector { cos_um: 0.0, sin_um: 0.0 }; 4]);
    let Some(reading) = Reading::new(black_box(0.0), &vectors) else {
        return;
    };
    let mut reading = reading.with_gaps_v(&black_box([0.0; 4]));
    reading.lose(black_box(0));
    let mut tracker = Tracker::resume(model, &black_box([[0.0; 2]; 2]));
    let track = black_box(TrackConfig::default());
    let _ = black_box(tracker.update(&track, model, &reading, &black_box([0.0; 4])));
    if let Ok(at_speed) = response(model, black_box(1.0), &black_box(Default::default())) {
        for probe in at_speed.probes() {
            black_box(probe.phasor(&black_box([[0.0; 2]; 2])));
        }
    }
    for probe in reading.probes() {
        black_box((probe.peak_to_peak_um(), probe.lag_deg()));
    }
    for frame in reading_frames(black_box(0), &NumberedReading::new(black_box(0), reading)) {
        black_box(frame);
    }
    judgement(&reading);
}

/// Arbitrary evidence at arbitrary times.
fn judgement(reading: &Reading) {
    let (mut detector, mut average) = (Detector::default(), Average::default());
    let last_g_mm = black_box([[0.0; 2]; 2]);
    let mut growth = Growth::resume(&black_box([0.0; 2]), &last_g_mm);
    let Ok(thresholds) = Thresholds::decode(black_box(&[0; 64])) else {
        return;
    };
    black_box(thresholds.encode());
    for _ in 0..black_box(10) {
        let averaged = average.update(black_box(0.0), black_box(0), reading);
        black_box(growth.bounds_g_mm(&thresholds, black_box(0), &last_g_mm, &black_box([0.0; 4])));
        black_box(growth.most_g_mm(&last_g_mm, &black_box([0.0; 4])));
        if let Ok(residual) = Residual::new(&black_box([ProbeVector::LOST; 8]), averaged.reading.probes()) {
            let evidence = Evidence {
                residual,
                free_residual_um: black_box(0.0),
                redundancy: black_box(0),
                floor_um: noise_floor_um(black_box(0.0), black_box(0)),
                bearings: black_box([0; 8]),
                observation: Observation {
                    averaged,
                    noise: black_box(Noise::default()),
                    unbalance_g_mm: black_box([[0.0; 2]; 4]),
                    planes: black_box(0),
                    deviation_g_mm: black_box([0.0; 4]),
                    misfit_g_mm: black_box([0.0; 4]),
                    floor_g_mm: black_box(0.0),
                },
                raw: black_box(Reason::None),
            };
            black_box(detector.update(&thresholds, black_box(0), &evidence));
        }
    }
    detector.acknowledge();
    black_box(detector);
}

/// A node among arbitrary frames at arbitrary times, started from arbitrary bytes, its model replaced meanwhile.
fn frames(model: Model) {
    let mut config = NodeConfig::new(black_box(0));
    config.key = Some(Key(black_box([0; 32])));
    #[cfg(feature = "mac")]
    {
        config.authenticated = black_box(true);
        config.nonce_reserve = black_box(0);
    }
    let Ok(mut node) = Node::<6, 4, 2>::new(black_box(config)) else {
        return;
    };
    #[cfg(feature = "mac")]
    node.restore_nonce(black_box(0));
    node.restore_counter(black_box(0));
    let _ = black_box(node.restore_thresholds(black_box(&[0; 64])));
    let _ = black_box(node.load(black_box(Err(Reason::NothingStored))));
    let _ = black_box(node.load(black_box(Ok(&[0; MODEL_BYTES]))));
    black_box(node.restore(black_box(&[0; 128])));
    for _ in 0..black_box(100) {
        if let Some(frame) = any_frame() {
            node.receive(black_box(0), &frame);
        }
        node.poll(black_box(0));
        match node.to_save() {
            Some(Save::Command { counter, model, thresholds }) => {
                black_box((counter, model, thresholds));
            }
            Some(Save::Memory(memory)) => {
                black_box(memory);
            }
            Some(Save::Nonce(nonce)) => {
                black_box(nonce);
            }
            None => {}
        }
        node.saved(black_box(0), black_box(true));
        while let Some(frame) = node.transmit() {
            black_box(frame);
        }
        black_box((node.counters(), node.estimate(), node.verdict(), node.status(black_box(0))));
        black_box(node.is_trial_over(black_box(0)));
        black_box((node.poll_at(), node.may_send(), node.model(), node.thresholds(), node.command_counter()));
    }
    let _ = black_box(node.replace_model(black_box(0), model));
    node.restart(black_box(0));
    black_box(node);
}

/// A gate among arbitrary frames.
#[cfg(feature = "mac")]
fn authentication() {
    let (key, direction) = (Key(black_box([0; 32])), black_box(Direction::ToHost));
    let mut gate = Gate::new(direction, black_box(0));
    let mut group = Group::new();
    for _ in 0..black_box(100) {
        if let Some(frame) = any_frame() {
            let _ = group.push(frame);
            let _ = black_box(gate.receive(&key, black_box(0), black_box(0), &frame));
        }
        gate.raise(black_box(0));
        black_box((gate.last(), direction.covers(black_box(0))));
    }
    black_box(mac_frames(&key, direction, black_box(0), black_box(0), &group));
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
        if let Some(SlcanLine::Frame(frame)) = decoder.push(black_box(0)) {
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
    in_parts(request);
}

/// The host's side of a request in numbered parts.
fn in_parts(request: &[u8]) {
    black_box(Offer::new(request).map(|offer| offer.encode()));
    for _ in 0..black_box(100) {
        black_box(request_part(request, black_box(0)));
        black_box(answer_part(request, black_box(0), black_box(0)));
        black_box((Offer::decode(black_box(&[0; 8])), Ack::decode(black_box(&[0; 8]))));
        black_box(parts_of(black_box(0)));
    }
}

/// Arbitrary samples and marks.
fn extraction() {
    let mut detector = KeyphasorDetector::new(black_box(0), black_box(0));
    extract::<1>(&mut detector);
    extract::<4>(&mut detector);
    extract::<8>(&mut detector);
    detector.restart();
}

fn extract<const PROBES: usize>(detector: &mut KeyphasorDetector) {
    let converter = Converter::signed(black_box(0), black_box([0.0; 2]));
    let config = ExtractionConfig { converter, ..black_box(ExtractionConfig::<PROBES>::new()) };
    black_box((config.fastest_rpm(), config.slowest_rpm(), converter.mv(black_box(0.0))));
    black_box(config.revolutions_for_noise(black_box(0.0), black_box(0.0), black_box(0.0)));
    black_box(config.revolutions_for_drift(black_box(0.0), black_box(0.0)));
    let Ok(mut extractor) = Extractor::new(black_box(config)) else {
        return;
    };
    for _ in 0..black_box(100) {
        let mark = detector.push(black_box(0));
        black_box(extractor.push(black_box([0; PROBES]), black_box(mark)));
    }
    extractor.restart();
    black_box(extractor.config());
    black_box(extractor);
}

fn any_frame() -> Option<Frame> {
    let bytes = black_box([0; 16]);
    Frame::standard(black_box(0), bytes.get(..black_box(8))?)
}
