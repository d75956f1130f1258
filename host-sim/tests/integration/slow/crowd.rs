//! `rotor-edge bus` among many clients, hostile ones too: each costs itself alone. `ROTOR_EDGE_CLIENTS=500` has so many, a
//! fifth of them hostile.

#![cfg(target_os = "linux")]

use std::io::{Read, Write};
use std::net::TcpStream;

use crate::crowd::{frame, hear};
use crate::shared::Shared;
use nix::sys::signal::Signal;
use rotor_edge::bus::CanBus;
use rotor_edge_core::can::Frame;

const SENDERS: usize = 4;
/// What the listeners wait for.
const LAST: &[u8] = b"t7FF0\r";

/// A client that misbehaves in the way of its number, for as long as what it gives back lives.
fn hostile(shared: &Shared, number: usize) -> TcpStream {
    let port = if number.is_multiple_of(2) { "slcan_port" } else { "socketcand_port" };
    let mut stream = shared.raw(port);
    let noise: Vec<u8> = (0..100_000_u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    // it may be closed before all of it is written
    let _ = match number / 2 % 5 {
        // joins and never reads
        0 => stream.write_all(b"O\r< open vcan0 >< rawmode >"),
        1 => stream.write_all(&noise),
        // a line without an end, longer than any buffer should be
        2 => stream.write_all(&[b'<'; 1]).and_then(|()| stream.write_all(&vec![b'x'; 1 << 20])),
        // asks and never reads the answers
        3 => stream.write_all(&b"V\r< echo >".repeat(20_000)),
        // says nothing
        _ => Ok(()),
    };
    stream
}

/// Largest resident memory of a program, MB.
fn peak_mb(pid: u32) -> f64 {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches(" kB").parse::<f64>().unwrap() / 1024.0
}

#[test]
fn frames_reach_all_clients_despite_hostile_ones() {
    const FRAMES: u32 = 500;
    let clients = std::env::var("ROTOR_EDGE_CLIENTS").map_or(100, |text| text.parse().unwrap());
    let shared = Shared::start(&[]);
    let enemies: Vec<TcpStream> = (0..clients / 5).map(|number| hostile(&shared, number)).collect();
    let listeners: Vec<TcpStream> = (0..clients - clients / 5 - SENDERS)
        .map(|_| {
            let mut stream = shared.raw("slcan_port");
            stream.write_all(b"O\rV\r").unwrap();
            // it has joined once it is answered
            let mut version = [0; 6];
            stream.read_exact(&mut version).unwrap();
            stream
        })
        .collect();
    let mut senders: Vec<Box<dyn CanBus>> = (0..SENDERS).map(|_| shared.join("socketcand")).collect();
    let heard = std::thread::scope(|scope| {
        let listen = |mut stream: TcpStream| {
            move || {
                let (mut heard, mut buffer) = (Vec::new(), [0; 4096]);
                while !heard.ends_with(LAST) {
                    let length = stream.read(&mut buffer).unwrap();
                    assert!(length > 0, "closed");
                    heard.extend(&buffer[..length]);
                }
                heard
            }
        };
        let all: Vec<_> = listeners.into_iter().map(|stream| scope.spawn(listen(stream))).collect();
        for number in 0..FRAMES {
            for (sender, id) in senders.iter_mut().zip(0x100..) {
                sender.send(&frame(id, number)).unwrap();
            }
        }
        // each sender has heard the frames of the others: they are on the bus
        for sender in &mut senders {
            for _ in 0..FRAMES as usize * (SENDERS - 1) {
                hear(&mut **sender);
            }
        }
        senders[0].send(&Frame::standard(0x7ff, &[]).unwrap()).unwrap();
        all.into_iter().map(|listener| listener.join().unwrap()).collect::<Vec<_>>()
    });
    for one in &heard {
        assert_eq!(one, &heard[0], "all hear the same order");
    }
    let lines = heard[0].split(|byte| *byte == b'\r').filter(|line| line.starts_with(b"t1")).count();
    assert_eq!(lines, FRAMES as usize * SENDERS, "every frame of every sender");
    let peak_mb = peak_mb(shared.program.id());
    println!("{clients} clients, {} of them hostile: {peak_mb:.0} MB at most", enemies.len());
    assert!(peak_mb < 200.0, "{peak_mb} MB");
    let (code, said) = shared.end(Signal::SIGTERM);
    assert_eq!(code, Some(0), "{said}");
}
