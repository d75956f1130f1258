//! A bus without hardware and without the kernel: SLCAN and socketcand on loopback, every frame of one
//! client to all the others.

mod dialect;
mod hub;

use std::io::{self, ErrorKind, Read, Write};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender};
use std::thread;
use std::time::Duration;

use anyhow::{Result, bail};

use super::codec::{Decoder, Heard};
use super::log::LogWriter;
use dialect::{Answer, Dialect, Slcan, Socketcand};
pub use hub::Counts;
use hub::{Hub, Number, Outgoing};

/// Bytes handed to the network at once, about.
const PACKET_BYTES: usize = 16_384;
/// Bytes taken from the network at once: a client that sends as fast as it can must not fill its window.
const READ_BYTES: usize = 65_536;
/// Before the next client is let in when one could not be.
const CROWDED_PAUSE: Duration = Duration::from_millis(10);

/// Why the bus ends.
#[derive(Debug)]
pub enum Ending {
    /// It was asked to.
    Asked,
    /// The recording cannot be written any more.
    Recording(io::Error),
}

/// A running server; it ends with the program.
pub struct Server {
    hub: Arc<Hub>,
    /// Where SLCAN is served.
    pub slcan_port: u16,
    /// Where socketcand is served.
    pub socketcand_port: u16,
}

impl Server {
    /// Serves on these ports of this machine, 0 for any that is free, and records if there is a file to record in.
    /// A recording that cannot go on is told to `ending`.
    ///
    /// # Errors
    /// If a port or the file cannot be had.
    pub fn start(
        slcan_port: u16,
        socketcand_port: u16,
        record: Option<&Path>,
        ending: &Sender<Ending>,
    ) -> Result<Self> {
        let (slcan, socketcand) = (listen(slcan_port, "--slcan")?, listen(socketcand_port, "--socketcand")?);
        // with the ports at hand: a bus that cannot start must not empty an older recording
        let log = record.map(LogWriter::create).transpose()?;
        let hub = Arc::new(Hub::new(log));
        let ports = (slcan.local_addr()?.port(), socketcand.local_addr()?.port());
        accept::<Slcan>(slcan, Arc::clone(&hub), ending.clone());
        accept::<Socketcand>(socketcand, Arc::clone(&hub), ending.clone());
        Ok(Self { hub, slcan_port: ports.0, socketcand_port: ports.1 })
    }

    /// What happened so far.
    pub fn counts(&self) -> Counts {
        self.hub.counts()
    }
}

fn listen(port: u16, option: &str) -> Result<TcpListener> {
    match TcpListener::bind((Ipv4Addr::LOCALHOST, port)) {
        Ok(listener) => Ok(listener),
        Err(e) if e.kind() == ErrorKind::AddrInUse => bail!(
            "port {port} is in use, perhaps by another `rotor-edge bus`; stop that, or choose another with {option} PORT (0: any free one)"
        ),
        Err(e) if e.kind() == ErrorKind::PermissionDenied => {
            bail!("port {port} needs permission; choose one above 1023 with {option} PORT")
        }
        Err(e) => bail!("port {port} cannot be served ({e}); choose another with {option} PORT"),
    }
}

fn accept<D: Dialect>(listener: TcpListener, hub: Arc<Hub>, ending: Sender<Ending>) {
    thread::spawn(move || {
        for stream in listener.incoming() {
            match stream {
                Ok(stream) => {
                    let (hub, ending) = (Arc::clone(&hub), ending.clone());
                    thread::spawn(move || serve::<D>(&hub, &stream, &ending));
                }
                // a client that was gone before it was let in, or too many of them
                Err(_) => thread::sleep(CROWDED_PAUSE),
            }
        }
    });
}

/// One client from its coming to its going.
fn serve<D: Dialect>(hub: &Hub, stream: &TcpStream, ending: &Sender<Ending>) {
    let name = stream.peer_addr().map_or(D::NAME.into(), |peer| format!("{} client {peer}", D::NAME));
    let (number, outgoing) = hub.enter(name);
    hub.answer(number, D::GREETING);
    thread::scope(|scope| {
        scope.spawn(move || {
            // whatever ends the sending ends the client
            let _ = send::<D>(stream, &outgoing);
            let _ = stream.shutdown(Shutdown::Both);
        });
        if let Err(Ended::Recording(e)) = hear::<D>(hub, stream, number) {
            let _ = ending.send(Ending::Recording(e));
        }
        hub.leave(number);
        // a sender that is stuck with a client that never reads comes free
        let _ = stream.shutdown(Shutdown::Both);
    });
}

fn send<D: Dialect>(mut stream: &TcpStream, outgoing: &Receiver<Outgoing>) -> io::Result<()> {
    stream.set_nodelay(true)?;
    let mut packet = Vec::new();
    while let Ok(first) = outgoing.recv() {
        let mut next = Some(first);
        while let Some(item) = next {
            match item {
                Outgoing::Frame(time_us, frame) => D::encode(&frame, time_us, &mut packet),
                Outgoing::Answer(text) | Outgoing::Joined(text) => {
                    stream.write_all(&packet)?;
                    packet.clear();
                    stream.write_all(text.as_bytes())?;
                    if matches!(item, Outgoing::Joined(_)) {
                        thread::sleep(D::QUIET);
                    }
                }
            }
            next = if packet.len() < PACKET_BYTES { outgoing.try_recv().ok() } else { None };
        }
        stream.write_all(&packet)?;
        packet.clear();
    }
    Ok(())
}

enum Ended {
    /// The client is gone.
    Client,
    Recording(io::Error),
}

fn hear<D: Dialect>(hub: &Hub, mut stream: &TcpStream, number: Number) -> Result<(), Ended> {
    let (mut dialect, mut decoder) = (D::default(), D::Decoder::default());
    let mut buffer = vec![0; READ_BYTES];
    let mut frames = Vec::new();
    loop {
        let length = match stream.read(&mut buffer) {
            Ok(0) => return Err(Ended::Client),
            Ok(length) => length,
            Err(e) if e.kind() == ErrorKind::Interrupted => continue,
            Err(_) => return Err(Ended::Client),
        };
        for heard in buffer[..length].iter().filter_map(|byte| decoder.push(*byte)) {
            let answer = match heard {
                Heard::Frame(frame) if dialect.may_send() => {
                    frames.push(frame);
                    Answer::Silence
                }
                Heard::Frame(_) | Heard::Garbage => Answer::Refuse(D::REFUSAL),
                Heard::Text(text) => {
                    // what was sent before a command counts before it
                    hub.publish(number, &frames).map_err(Ended::Recording)?;
                    frames.clear();
                    dialect.command(&text)
                }
            };
            match answer {
                Answer::Silence => {}
                Answer::Say(text) => hub.answer(number, text),
                Answer::Join(text) => hub.join(number, text),
                Answer::Leave => hub.part(number),
                Answer::Refuse(text) => {
                    hub.refuse(1);
                    hub.answer(number, text);
                }
            }
        }
        hub.publish(number, &frames).map_err(Ended::Recording)?;
        frames.clear();
    }
}
