//! `rotor-edge bus` with clients that misbehave, or a standard error that nobody reads. A hundred clients are in
//! `slow/crowd.rs`.

use std::io::{Read, Write};
use std::process::Stdio;

use crate::program::assert_says;
use crate::shared::{PATIENCE, Shared};
use nix::sys::signal::Signal;
use rotor_edge::bus::CanBus;
use rotor_edge_core::can::Frame;

pub fn frame(id: u16, number: u32) -> Frame {
    Frame::standard(id, &number.to_le_bytes()).unwrap()
}

pub fn hear(bus: &mut dyn CanBus) -> Frame {
    bus.receive(PATIENCE).unwrap().expect("a frame in time")
}

#[test]
fn http_post_is_rejected_and_sends_no_frame() {
    let shared = Shared::start(&[]);
    let mut listener = shared.join("slcan");
    for (port, body) in [("slcan_port", "\rO\rt1230\r"), ("socketcand_port", "< open vcan0 >< send 123 0 >")]
    {
        let mut browser = shared.raw(port);
        let head = "POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: text/plain\r\n\r\n";
        browser.write_all(format!("{head}{body}").as_bytes()).unwrap();
        let mut answer = Vec::new();
        // what was posted beyond the first bytes may end the connection hard
        let _ = browser.read_to_end(&mut answer);
        let answer = String::from_utf8_lossy(&answer);
        assert!(answer.is_empty() || answer.contains("400 Bad Request"), "{answer}");
    }
    shared.join("slcan").send(&frame(5, 1)).unwrap();
    assert_eq!(hear(&mut *listener), frame(5, 1), "nothing before it");
    let (code, said) = shared.end(Signal::SIGTERM);
    assert_eq!(code, Some(0));
    assert_says(&said, &["it spoke HTTP", "1 frames", "2 connections turned away"]);
}

/// Frames go on, and an interrupt ends the bus with 0, whatever its standard error is.
fn goes_on_with(stderr: std::io::PipeWriter) {
    let mut program = crate::program::program();
    program.args(["bus", "--json", "--slcan", "0", "--socketcand", "0"]);
    program.stdout(Stdio::piped()).stderr(stderr);
    let shared = Shared::of(program.spawn().unwrap());
    let (mut from, mut to) = (shared.join("slcan"), shared.join("slcan"));
    for number in 0..3 {
        let mut browser = shared.raw("slcan_port");
        browser.write_all(b"GET / HTTP/1.1\r\n\r\n").unwrap();
        // turned away, which was told
        let _ = browser.read_to_end(&mut Vec::new());
        from.send(&frame(1, number)).unwrap();
        assert_eq!(hear(&mut *to), frame(1, number));
    }
    assert_eq!(shared.end(Signal::SIGINT).0, Some(0));
}

#[test]
fn a_full_standard_error_that_nobody_reads_holds_nothing_up() {
    let (_reader, mut writer) = std::io::pipe().unwrap();
    // as much as a pipe of Linux holds
    writer.write_all(&[b'.'; 65_536]).unwrap();
    goes_on_with(writer);
}

#[test]
fn a_standard_error_that_is_closed_ends_nothing() {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    goes_on_with(writer);
}
