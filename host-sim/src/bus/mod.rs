//! CAN buses: one trait for what is real, and a simulated one for whole days in a second.
//!
//! | module | holds |
//! |---|---|
//! | [`virtual_bus`] | arbitration, loss and delay in simulated time, for `replay` and sweeps |
//! | [`simulated`] | several programs on it, with a clock that none of them waits for |
//! | [`local`] | several participants in one process, in real time |
//! | [`spec`] | what `--bus` takes |
//! | [`kernel`] | SocketCAN |
//! | [`slcan`], [`socketcand`] | two text protocols; [`codec`] is what they share, [`wire`] every frame they carry |
//! | [`stream`], [`text_client`] | TCP and serial ports, and joining a bus by them |
//! | [`reconnecting`] | joining it again when its server comes back |
//! | [`server`], [`load`] | the shared bus that needs no kernel, and how many monitors wires carry |
//! | [`log`], [`decoded`] | recordings, and the readings and results in them |
//! | [`counters`], [`states`] | a monitor's counters and states from its frames |

mod can_bus;
pub mod codec;
pub mod counters;
pub mod decoded;
#[cfg(target_os = "linux")]
pub mod kernel;
pub mod load;
pub mod local;
pub mod log;
pub mod mac;
pub mod numbers;
pub mod reconnecting;
pub mod server;
pub mod simulated;
pub mod slcan;
pub mod socketcand;
pub mod spec;
pub mod states;
pub mod stream;
pub mod text_client;
mod timed;
pub mod virtual_bus;
pub mod wire;

use anyhow::Result;

pub use can_bus::{CanBus, monotonic};
pub use local::{LocalPort, local_bus};
pub use spec::BusSpec;
use spec::SlcanLink;
use stream::{Serial, Tcp};
use text_client::TextClient;
pub use virtual_bus::{BusConfig, Port, Traffic, VirtualBus, frame_bits};

/// Joins the bus that `spec` names, such as `slcan:127.0.0.1:29537`.
///
/// # Errors
/// One sentence on what is wrong with the name or the bus, and what to do.
pub fn open(spec: &str) -> Result<Box<dyn CanBus>> {
    spec.parse::<BusSpec>()?.open()
}

impl BusSpec {
    /// Joins the bus.
    ///
    /// # Errors
    /// One sentence on what is wrong with the bus, and what to do.
    pub fn open(&self) -> Result<Box<dyn CanBus>> {
        let name = self.to_string();
        Ok(match self {
            Self::SocketCan { interface } => open_kernel(interface)?,
            Self::Slcan { line: SlcanLink::Tcp(address), bit_rate } => {
                Box::new(TextClient::slcan(Tcp::connect(address)?, *bit_rate, name)?)
            }
            Self::Slcan { line: SlcanLink::Serial { device, baud_rate }, bit_rate } => {
                Box::new(TextClient::slcan(Serial::open(device, *baud_rate)?, *bit_rate, name)?)
            }
            Self::Socketcand { address, interface } => {
                Box::new(TextClient::socketcand(Tcp::connect(address)?, interface, name)?)
            }
        })
    }
}

#[cfg(target_os = "linux")]
fn open_kernel(interface: &str) -> Result<Box<dyn CanBus>> {
    Ok(Box::new(kernel::KernelBus::open(interface)?))
}

#[cfg(not(target_os = "linux"))]
fn open_kernel(interface: &str) -> Result<Box<dyn CanBus>> {
    anyhow::bail!("socketcan:{interface}: only Linux has SocketCAN; use slcan: or socketcand:")
}
