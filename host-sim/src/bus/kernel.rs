//! SocketCAN: the interfaces of the Linux kernel.

use std::io::{Error, ErrorKind};
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use rotor_edge_core::can::Frame;
use socketcan::{CanFrame, CanSocket, EmbeddedFrame, Socket};

use super::can_bus::CanBus;
use super::wire::WireFrame;

const INTERFACES: &str = "/sys/class/net";
/// The kernel's number for CAN hardware.
const ARPHRD_CAN: &str = "280";
const IFF_UP: u32 = 1;
const ENOBUFS: i32 = 105;
/// A full queue empties within a second at 10 kbit/s already; longer, nobody acknowledges.
const FULL_QUEUE_TIMEOUT: Duration = Duration::from_secs(1);
/// About the time of one frame at 125 kbit/s.
const FULL_QUEUE_PAUSE: Duration = Duration::from_millis(1);

/// A raw socket on an interface.
pub struct KernelBus {
    socket: CanSocket,
    interface: String,
    passed_over: u64,
}

impl KernelBus {
    /// Joins an interface such as `can0`.
    ///
    /// # Errors
    /// One sentence on what is in the way, and what to do.
    pub fn open(interface: &str) -> Result<Self> {
        check(Path::new(INTERFACES), interface)?;
        match CanSocket::open(interface) {
            Ok(socket) => Ok(Self { socket, interface: interface.into(), passed_over: 0 }),
            Err(e) => bail!("{interface}: {}", refusal(&e)),
        }
    }
}

/// Whether the kernel has this interface, for CAN, and up.
fn check(interfaces: &Path, name: &str) -> Result<()> {
    let about = |what: &str| std::fs::read_to_string(interfaces.join(name).join(what));
    let Ok(kind) = about("type") else {
        bail!(
            "there is no interface {name}; make a virtual one with `sudo modprobe vcan && sudo ip link add dev {name} type vcan && sudo ip link set {name} up`, \
             or do without the kernel: `rotor-edge bus`"
        );
    };
    if kind.trim() != ARPHRD_CAN {
        bail!("{name} is no CAN interface, expected such as can0 or vcan0; `ip -brief link` lists them");
    }
    let flags = about("flags").unwrap_or_default();
    let flags = u32::from_str_radix(flags.trim().trim_start_matches("0x"), 16);
    if flags.is_ok_and(|flags| flags & IFF_UP == 0) {
        bail!("{name} is down; {}", way_up(name));
    }
    Ok(())
}

fn way_up(name: &str) -> String {
    let rate = if name.starts_with('v') { "" } else { " type can bitrate 500000" };
    format!("`sudo ip link set {name} up{rate}`")
}

fn refusal(e: &Error) -> String {
    match e.kind() {
        ErrorKind::PermissionDenied => {
            "permission refused; run as root, or allow it with `sudo setcap cap_net_raw+ep` on this program"
                .into()
        }
        _ => format!("the kernel refuses a CAN socket ({e}); `sudo modprobe can can_raw` may mend it"),
    }
}

impl CanBus for KernelBus {
    fn send(&mut self, frame: &Frame) -> Result<()> {
        let id = embedded_can::Frame::id(frame);
        let frame = CanFrame::new(id, frame.bytes()).context("a CAN frame")?;
        let end = Instant::now() + FULL_QUEUE_TIMEOUT;
        loop {
            match self.socket.write_frame(&frame) {
                Ok(()) => return Ok(()),
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) if e.raw_os_error() == Some(ENOBUFS) => {
                    if Instant::now() > end {
                        bail!(
                            "{}: frames cannot be sent; check that another station is on the bus, at the same bit rate, and that the bus is terminated",
                            self.interface
                        );
                    }
                    std::thread::sleep(FULL_QUEUE_PAUSE);
                }
                Err(e) => bail!("{}", gone(&self.interface, &e)),
            }
        }
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>> {
        let end = Instant::now() + timeout;
        let mut left = timeout;
        loop {
            // whole milliseconds are all the socket knows; zero must stay zero
            let wait = Duration::from_millis(left.as_micros().div_ceil(1000).try_into().unwrap_or(u64::MAX));
            match self.socket.read_frame_timeout(wait) {
                Ok(frame) => match ours(&frame) {
                    Some(frame) => return Ok(Some(frame)),
                    None => self.passed_over += 1,
                },
                Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock) => return Ok(None),
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => bail!("{}", gone(&self.interface, &e)),
            }
            left = end.saturating_duration_since(Instant::now());
        }
    }

    fn description(&self) -> String {
        format!("socketcan:{}", self.interface)
    }

    fn passed_over(&self) -> u64 {
        self.passed_over
    }
}

fn ours(frame: &CanFrame) -> Option<Frame> {
    match frame {
        CanFrame::Data(frame) => {
            let id = socketcan::Frame::raw_id(frame);
            WireFrame::data(id, frame.is_extended(), frame.data())?.ours()
        }
        CanFrame::Remote(_) | CanFrame::Error(_) => None,
    }
}

fn gone(interface: &str, e: &Error) -> String {
    match e.kind() {
        ErrorKind::NetworkDown => format!("{interface} went down; {}", way_up(interface)),
        _ => format!("{interface} is gone ({e})"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENETDOWN: i32 = 100;
    const EAFNOSUPPORT: i32 = 97;
    const EACCES: i32 = 13;

    fn refused(kind: Option<&str>, flags: &str) -> String {
        let interfaces = tempfile::tempdir().unwrap();
        let vcan0 = interfaces.path().join("vcan0");
        if let Some(kind) = kind {
            std::fs::create_dir(&vcan0).unwrap();
            std::fs::write(vcan0.join("type"), format!("{kind}\n")).unwrap();
            std::fs::write(vcan0.join("flags"), format!("{flags}\n")).unwrap();
        }
        check(interfaces.path(), "vcan0").err().map_or(String::new(), |e| e.to_string())
    }

    #[test]
    fn an_interface_must_be_there_for_can_and_up() {
        assert_eq!(refused(Some("280"), "0x41"), "");
        assert!(refused(None, "").contains("ip link add dev vcan0 type vcan"));
        assert!(refused(Some("772"), "0x9").contains("vcan0 is no CAN interface"));
        assert!(refused(Some("280"), "0x40").contains("vcan0 is down; `sudo ip link set vcan0 up`"));
        assert!(way_up("can0").contains("bitrate"));
    }

    #[test]
    fn what_the_kernel_refuses_is_said_with_what_to_do() {
        assert!(refusal(&Error::from_raw_os_error(EACCES)).contains("permission refused; run as root"));
        assert!(refusal(&Error::from_raw_os_error(EAFNOSUPPORT)).contains("modprobe can"));
        assert!(
            gone("vcan0", &Error::from_raw_os_error(ENETDOWN)).contains("vcan0 went down; `sudo ip link set")
        );
    }

    #[test]
    fn only_standard_data_frames_are_heard() {
        let standard = socketcan::StandardId::new(0x123).unwrap();
        let extended = socketcan::ExtendedId::new(0x123).unwrap();
        let frame = |id: socketcan::Id| CanFrame::new(id, &[1, 2]).unwrap();
        assert_eq!(ours(&frame(standard.into())), Frame::standard(0x123, &[1, 2]));
        assert_eq!(ours(&frame(extended.into())), None);
        assert_eq!(ours(&CanFrame::new_remote(standard, 2).unwrap()), None);
    }
}
