//! A bus without hardware and without the kernel: SLCAN and socketcand on loopback, every frame of one
//! client to all the others.

mod dialect;
mod hub;
mod opening;
mod stderr_logger;

use std::io::{self, ErrorKind, Read, Write};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::path::Path;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use anyhow::{Context, Result, bail};

use super::codec::{Decoder, StreamItem};
use super::log::LogWriter;
use dialect::{Dialect, Reply, Slcan, Socketcand};
pub use hub::Counts;
use hub::{Hub, MAX_CLIENTS, Number, Outgoing};
use opening::Opening;
use stderr_logger::StderrLogger;

/// Bytes handed to the network at once, about.
const PACKET_BYTES: usize = 16_384;
/// Bytes taken from the network at once: a client that sends as fast as it can must not fill its window.
const READ_BYTES: usize = 65_536;
/// Before the next client is let in when one could not be.
const CROWDED_PAUSE: Duration = Duration::from_millis(10);
/// What a thread of one client may use.
const STACK_BYTES: usize = 256 * 1024;
/// A client that takes nothing for so long is closed.
const STUCK_TIME: Duration = Duration::from_secs(30);
/// A client that says nothing for so long before it joins the bus is closed.
const SILENT_TIME: Duration = Duration::from_secs(60);
/// Why a client may be turned away.
const NO_THREAD: &str = "this machine has no thread for it";
/// What a browser is told.
const NOT_HTTP: &[u8] = b"HTTP/1.1 400 Bad Request\r\nConnection: close\r\nContent-Length: 0\r\n\r\n";

/// A running server; it ends with the program.
pub struct Server {
    hub: Arc<Hub>,
    logger: StderrLogger,
    pub slcan_port: u16,
    pub socketcand_port: u16,
}

impl Server {
    /// Serves on these ports of this machine, 0 for any that is free, and records if there is a file to record in.
    ///
    /// # Errors
    /// If a port, the file or a thread cannot be had.
    pub fn start(slcan_port: u16, socketcand_port: u16, record: Option<&Path>) -> Result<Self> {
        let (slcan, socketcand) = (listen(slcan_port, "--slcan")?, listen(socketcand_port, "--socketcand")?);
        // with the ports at hand: a bus that cannot start must not empty an older recording
        let log = record.map(LogWriter::create).transpose()?;
        let logger = StderrLogger::start();
        let hub = Arc::new(Hub::new(log, logger.clone()));
        let ports = (slcan.local_addr()?.port(), socketcand.local_addr()?.port());
        accept::<Slcan>(slcan, Arc::clone(&hub))?;
        accept::<Socketcand>(socketcand, Arc::clone(&hub))?;
        Ok(Self { hub, logger, slcan_port: ports.0, socketcand_port: ports.1 })
    }

    pub fn counts(&self) -> Counts {
        self.hub.counts()
    }

    /// Why the recording ended before the bus.
    pub fn take_log_error(&self) -> Option<io::Error> {
        self.hub.take_log_error()
    }

    /// Says the last sentence on standard error, after what the bus had to say.
    pub fn tell_last(&self, sentence: String) {
        self.logger.tell_last(sentence);
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

fn accept<D: Dialect>(listener: TcpListener, hub: Arc<Hub>) -> Result<()> {
    let accept = move || {
        for stream in listener.incoming() {
            // a client that was gone before it was let in, or too many of them
            let Ok(stream) = stream else {
                thread::sleep(CROWDED_PAUSE);
                continue;
            };
            let served = Arc::clone(&hub);
            let builder = thread::Builder::new().stack_size(STACK_BYTES);
            if builder.spawn(move || serve::<D>(&served, &stream)).is_err() {
                hub.turn_away(NO_THREAD);
                thread::sleep(CROWDED_PAUSE);
            }
        }
    };
    thread::Builder::new().spawn(accept).context("this machine has no thread for the bus")?;
    Ok(())
}

/// One client from its coming to its going.
fn serve<D: Dialect>(hub: &Hub, mut stream: &TcpStream) {
    let name = stream.peer_addr().map_or(D::NAME.into(), |peer| format!("{} client {peer}", D::NAME));
    let times = stream.set_read_timeout(Some(SILENT_TIME)).and(stream.set_write_timeout(Some(STUCK_TIME)));
    let Some(number) = hub.enter(name).filter(|_| times.is_ok()) else {
        hub.turn_away(&format!("there are {MAX_CLIENTS} clients already"));
        let _ = stream.write_all(D::REFUSAL.as_bytes());
        return;
    };
    hub.answer(number, D::GREETING);
    thread::scope(|scope| {
        let send = || {
            // whatever ends the sending ends the client
            let _ = send::<D>(hub, stream, number);
            let _ = stream.shutdown(Shutdown::Both);
        };
        if thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, send).is_ok() {
            // whatever ends the hearing too
            let _ = hear::<D>(hub, stream, number);
        } else {
            hub.turn_away(NO_THREAD);
        }
        hub.leave(number);
        // a sender that is stuck with a client that never reads comes free
        let _ = stream.shutdown(Shutdown::Both);
    });
}

fn send<D: Dialect>(hub: &Hub, mut stream: &TcpStream, number: Number) -> io::Result<()> {
    stream.set_nodelay(true)?;
    let (mut items, mut packet) = (Vec::new(), Vec::new());
    while hub.take(number, &mut items) {
        for item in items.drain(..) {
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
            if packet.len() >= PACKET_BYTES {
                stream.write_all(&packet)?;
                packet.clear();
            }
        }
        stream.write_all(&packet)?;
        packet.clear();
    }
    Ok(())
}

/// Ends with an error when the client is gone, or is to go.
fn hear<D: Dialect>(hub: &Hub, mut stream: &TcpStream, number: Number) -> io::Result<()> {
    let (mut dialect, mut decoder) = (D::default(), D::Decoder::default());
    let mut buffer = vec![0; READ_BYTES];
    let mut length = first_bytes(hub, stream, &mut buffer)?;
    let mut frames = Vec::new();
    loop {
        for heard in buffer[..length].iter().filter_map(|byte| decoder.push(*byte)) {
            let answer = match heard {
                StreamItem::Frame(frame) if dialect.may_send() => {
                    frames.push(frame);
                    Reply::Silence
                }
                StreamItem::Frame(_) => Reply::Refuse(D::REFUSAL),
                StreamItem::Garbage => D::GARBAGE,
                StreamItem::Text(text) => {
                    // what was sent before a command counts before it
                    hub.publish(number, &frames);
                    frames.clear();
                    dialect.command(&text)
                }
            };
            match answer {
                Reply::Silence => {}
                Reply::Say(text) => hub.answer(number, text),
                Reply::Join(text) => hub.join(number, text),
                Reply::Leave(text) => {
                    hub.part(number);
                    hub.answer(number, text);
                }
                Reply::Ignore => hub.refuse(1),
                Reply::Refuse(text) => {
                    hub.refuse(1);
                    hub.answer(number, text);
                }
            }
        }
        hub.publish(number, &frames);
        frames.clear();
        length = loop {
            match stream.read(&mut buffer) {
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(length) => break length,
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                // who listens may be silent
                Err(e) if is_timeout(&e) && hub.is_joined(number) => {}
                Err(e) => return Err(e),
            }
        };
    }
}

/// Reads until it is clear that the client is no browser.
fn first_bytes(hub: &Hub, mut stream: &TcpStream, buffer: &mut [u8]) -> io::Result<usize> {
    let mut length = 0;
    loop {
        match opening::judge(&buffer[..length]) {
            Opening::Other => return Ok(length),
            Opening::Http => {
                hub.turn_away("it spoke HTTP");
                stream.write_all(NOT_HTTP)?;
                return Err(ErrorKind::InvalidData.into());
            }
            Opening::Undecided => match stream.read(&mut buffer[length..]) {
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(more) => length += more,
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            },
        }
    }
}

/// The two kinds that systems have for it.
fn is_timeout(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut)
}
