//! Byte streams with a time limit: TCP and serial ports.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};
use serialport::SerialPort;

/// A server on the same network answers much faster, or never.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(3);
/// What takes nothing for so long is stuck.
const WRITE_TIMEOUT: Duration = Duration::from_secs(5);

/// A stream that is written whole and read in time.
pub trait ByteStream: Send {
    /// Writes all of it.
    ///
    /// # Errors
    /// If the other side is gone, or takes nothing for seconds.
    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Reads what is there, 0 at the stream's end; `None` if nothing came in time. A timeout of zero only looks.
    ///
    /// # Errors
    /// If the other side is gone.
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<usize>>;
}

/// What a read that found nothing means.
fn nothing(result: io::Result<usize>) -> io::Result<Option<usize>> {
    match result {
        Ok(number) => Ok(Some(number)),
        Err(e)
            if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted) =>
        {
            Ok(None)
        }
        Err(e) => Err(e),
    }
}

/// A TCP connection without delay.
pub struct Tcp(TcpStream);

impl Tcp {
    /// Connects to `HOST:PORT`.
    ///
    /// # Errors
    /// One sentence on what is in the way, and what to do.
    pub fn connect(address: &str) -> Result<Self> {
        let places = address.to_socket_addrs().map_err(|e| anyhow!("{address}: no such host ({e})"))?;
        let mut refusal = None;
        for place in places {
            match TcpStream::connect_timeout(&place, CONNECT_TIMEOUT) {
                Ok(stream) => {
                    let ready = stream.set_nodelay(true);
                    ready.and_then(|()| stream.set_write_timeout(Some(WRITE_TIMEOUT))).context("TCP")?;
                    return Ok(Self(stream));
                }
                Err(e) => refusal = Some(e),
            }
        }
        match refusal {
            Some(e) if e.kind() == ErrorKind::ConnectionRefused => {
                bail!("nobody listens at {address}; start `rotor-edge bus` first, it prints where to join")
            }
            Some(e) if e.kind() == ErrorKind::TimedOut => {
                bail!("{address} does not answer; check the host and its firewall")
            }
            Some(e) => bail!("{address} cannot be reached ({e})"),
            None => bail!("{address}: no such host"),
        }
    }
}

impl ByteStream for Tcp {
    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        Write::write_all(&mut self.0, bytes)
    }

    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<usize>> {
        // the kernel rounds a timeout up to its tick, and takes none of zero
        if timeout.is_zero() {
            self.0.set_nonblocking(true)?;
            let result = Read::read(&mut self.0, buffer);
            self.0.set_nonblocking(false)?;
            return nothing(result);
        }
        self.0.set_read_timeout(Some(timeout))?;
        nothing(Read::read(&mut self.0, buffer))
    }
}

pub struct Serial(Box<dyn SerialPort>);

impl Serial {
    /// Opens a device.
    ///
    /// # Errors
    /// One sentence on what is in the way, and what to do.
    pub fn open(device: &str, baud_rate: u32) -> Result<Self> {
        match serialport::new(device, baud_rate).open() {
            Ok(port) => Ok(Self(port)),
            Err(e) => bail!("{device}: {}", serial_refusal(e.kind(), &e.description)),
        }
    }
}

fn serial_refusal(kind: serialport::ErrorKind, description: &str) -> String {
    use serialport::ErrorKind::{Io, NoDevice};
    match kind {
        Io(ErrorKind::NotFound) => "there is no such serial port; is the adapter plugged in?".into(),
        Io(ErrorKind::PermissionDenied) => {
            "permission refused; join its group (`sudo usermod -a -G dialout $USER`, then log in again)"
                .into()
        }
        NoDevice => format!("cannot be opened, another program may have it ({description})"),
        _ => format!("is no serial port, or does not work as one ({description})"),
    }
}

impl ByteStream for Serial {
    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.set_timeout(WRITE_TIMEOUT)?;
        Write::write_all(&mut self.0, bytes)
    }

    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<usize>> {
        self.0.set_timeout(timeout)?;
        nothing(Read::read(&mut self.0, buffer))
    }
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;

    use super::*;

    #[test]
    fn nobody_listening_says_what_to_start() {
        let free = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
        let message = Tcp::connect(&free).err().unwrap().to_string();
        assert!(message.contains(&free) && message.contains("start `rotor-edge bus`"), "{message}");
    }

    #[test]
    fn a_look_does_not_wait_and_an_end_is_no_timeout() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut near = Tcp::connect(&listener.local_addr().unwrap().to_string()).unwrap();
        let far = listener.accept().unwrap().0;
        let mut buffer = [0; 8];
        assert_eq!(near.read(&mut buffer, Duration::ZERO).unwrap(), None);
        assert_eq!(near.read(&mut buffer, Duration::from_millis(1)).unwrap(), None);
        drop(far);
        assert_eq!(near.read(&mut buffer, Duration::from_secs(5)).unwrap(), Some(0));
    }

    #[test]
    fn refusals_of_serial_ports_say_what_to_do() {
        let missing = Serial::open("/dev/ttyNOWHERE", 115_200).err().unwrap().to_string();
        assert!(missing.contains("/dev/ttyNOWHERE") && missing.contains("plugged in"), "{missing}");
        let file = tempfile::NamedTempFile::new().unwrap();
        let file = Serial::open(file.path().to_str().unwrap(), 115_200).err().unwrap().to_string();
        assert!(file.contains("is no serial port"), "{file}");
        let io = serialport::ErrorKind::Io;
        assert!(serial_refusal(io(ErrorKind::PermissionDenied), "").contains("dialout"));
        assert!(serial_refusal(serialport::ErrorKind::NoDevice, "busy").contains("another program"));
    }
}
