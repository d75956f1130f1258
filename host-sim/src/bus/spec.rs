//! The name of a bus, as `--bus` takes it.

use std::fmt;
use std::str::FromStr;

use anyhow::{Error, Result, anyhow, bail};

/// Bit rates that an SLCAN adapter knows, in the order of its commands S0 to S8.
pub const BIT_RATES: [u32; 9] =
    [10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 750_000, 1_000_000];
/// Bit rate where the name gives none.
const USUAL_BIT_RATE: u32 = 500_000;
/// Speed of a serial port where the name gives none.
const USUAL_BAUD_RATE: u32 = 115_200;
/// Interface of a socketcand server where the name gives none.
const USUAL_INTERFACE: &str = "vcan0";
/// All forms, for messages and help.
pub const FORMS: &str = "socketcan:vcan0, slcan:HOST:PORT, slcan:/dev/ttyACM0@115200 (either with ?bitrate=500000) or socketcand:HOST:PORT/vcan0";

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BusSpec {
    /// An interface of the Linux kernel.
    SocketCan {
        /// Such as `can0`.
        interface: String,
    },
    /// A serial-line CAN adapter, or what speaks its language.
    Slcan {
        line: SlcanLink,
        /// Bits a second on the CAN side, one of [`BIT_RATES`].
        bit_rate: u32,
    },
    Socketcand {
        /// `HOST:PORT`.
        address: String,
        /// The interface to open there.
        interface: String,
    },
}

/// What an SLCAN adapter is connected with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SlcanLink {
    /// `HOST:PORT`.
    Tcp(String),
    Serial {
        /// Such as `/dev/ttyACM0` or `COM3`.
        device: String,
        /// Bits a second on the serial side.
        baud_rate: u32,
    },
}

impl FromStr for BusSpec {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let Some((scheme, rest)) = text.split_once(':') else {
            bail!("\"{text}\" names no bus, expected {FORMS}");
        };
        // one sentence, not a chain: clap prints the outermost only
        let named = |why: Error| anyhow!("{text}: {why}");
        match scheme {
            "socketcan" if rest.is_empty() => {
                bail!("{text}: the interface is missing, expected an address such as socketcan:vcan0")
            }
            "socketcan" => Ok(Self::SocketCan { interface: rest.into() }),
            "slcan" => slcan(rest).map_err(named),
            "socketcand" => {
                let (address, interface) = rest.split_once('/').unwrap_or((rest, USUAL_INTERFACE));
                let address = address_of(address).map_err(named)?;
                if interface.is_empty() || interface.contains([' ', '<', '>']) {
                    bail!("{text}: \"{interface}\" is no interface, expected such as /vcan0");
                }
                Ok(Self::Socketcand { address, interface: interface.into() })
            }
            _ => bail!("{text}: there is no kind of bus \"{scheme}\", expected {FORMS}"),
        }
    }
}

fn slcan(rest: &str) -> Result<BusSpec> {
    let (place, bit_rate) = match rest.split_once('?') {
        None => (rest, USUAL_BIT_RATE),
        Some((place, query)) => (place, bit_rate_of(query)?),
    };
    let line = if is_serial(place) {
        let (device, baud_rate) = match place.split_once('@') {
            None => (place, USUAL_BAUD_RATE),
            Some((device, baud)) => (device, baud_rate_of(baud)?),
        };
        SlcanLink::Serial { device: device.into(), baud_rate }
    } else {
        SlcanLink::Tcp(address_of(place)?)
    };
    Ok(BusSpec::Slcan { line, bit_rate })
}

/// A path, or a port of Windows.
fn is_serial(place: &str) -> bool {
    let windows = place.strip_prefix("COM").is_some_and(|n| n.starts_with(|c: char| c.is_ascii_digit()));
    place.starts_with('/') || windows
}

fn bit_rate_of(query: &str) -> Result<u32> {
    let Some(text) = query.strip_prefix("bitrate=") else {
        bail!("\"?{query}\" is not known, expected such as ?bitrate=500000");
    };
    match text.parse() {
        Ok(rate) if BIT_RATES.contains(&rate) => Ok(rate),
        _ => {
            let known = BIT_RATES.map(|rate| rate.to_string()).join(", ");
            bail!("\"{text}\" is no bit rate of an SLCAN adapter, expected bits a second: {known}")
        }
    }
}

fn baud_rate_of(text: &str) -> Result<u32> {
    match text.parse() {
        Ok(rate) if rate > 0 => Ok(rate),
        _ => bail!("\"{text}\" is no speed of a serial port, expected such as @115200"),
    }
}

/// `HOST:PORT`, checked for both halves.
fn address_of(text: &str) -> Result<String> {
    let (host, port) = match text.rsplit_once(':') {
        // a lone IPv6 address in brackets has colons and no port
        Some((host, port)) if !port.ends_with(']') => (host, port),
        _ => bail!("the port is missing, expected HOST:PORT such as 127.0.0.1:29537"),
    };
    if host.is_empty() {
        bail!("the host is missing, expected HOST:PORT such as 127.0.0.1:29537");
    }
    if !port.parse::<u16>().is_ok_and(|port| port > 0) {
        bail!("\"{port}\" is no port, expected a number from 1 to 65535");
    }
    Ok(text.into())
}

impl fmt::Display for BusSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SocketCan { interface } => write!(f, "socketcan:{interface}"),
            Self::Slcan { line: SlcanLink::Tcp(address), .. } => write!(f, "slcan:{address}"),
            Self::Slcan { line: SlcanLink::Serial { device, baud_rate }, .. } => {
                write!(f, "slcan:{device}@{baud_rate}")
            }
            Self::Socketcand { address, interface } => write!(f, "socketcand:{address}/{interface}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(text: &str) -> String {
        format!("{}", text.parse::<BusSpec>().unwrap_err())
    }

    #[test]
    fn every_form_is_understood() {
        let tcp = |address: &str| SlcanLink::Tcp(address.into());
        let serial = |device: &str, baud_rate| SlcanLink::Serial { device: device.into(), baud_rate };
        let slcan = |line, bit_rate| BusSpec::Slcan { line, bit_rate };
        let socketcand = |address: &str, interface: &str| BusSpec::Socketcand {
            address: address.into(),
            interface: interface.into(),
        };
        for (text, spec) in [
            ("socketcan:vcan0", BusSpec::SocketCan { interface: "vcan0".into() }),
            ("slcan:localhost:29537", slcan(tcp("localhost:29537"), 500_000)),
            ("slcan:[::1]:29537?bitrate=125000", slcan(tcp("[::1]:29537"), 125_000)),
            ("slcan:/dev/ttyACM0", slcan(serial("/dev/ttyACM0", 115_200), 500_000)),
            ("slcan:/dev/ttyACM0@9600?bitrate=1000000", slcan(serial("/dev/ttyACM0", 9600), 1_000_000)),
            ("slcan:COM3@9600", slcan(serial("COM3", 9600), 500_000)),
            ("slcan:com.example:1", slcan(tcp("com.example:1"), 500_000)),
            ("socketcand:127.0.0.1:29536", socketcand("127.0.0.1:29536", "vcan0")),
            ("socketcand:127.0.0.1:29536/can1", socketcand("127.0.0.1:29536", "can1")),
        ] {
            assert_eq!(text.parse::<BusSpec>().unwrap(), spec, "{text}");
        }
    }

    #[test]
    fn bus_argument_takes_a_name_and_quotes_its_error() {
        #[derive(clap::Parser)]
        struct Arguments {
            #[arg(long)]
            bus: BusSpec,
        }
        let parse = |bus| <Arguments as clap::Parser>::try_parse_from(["test", "--bus", bus]);
        assert_eq!(parse("socketcan:can1").ok().unwrap().bus.to_string(), "socketcan:can1");
        let refusal = parse("slcan:localhost").err().unwrap().to_string();
        assert!(
            refusal.contains("--bus") && refusal.contains("the port is missing, expected HOST:PORT"),
            "{refusal}"
        );
    }

    #[test]
    fn every_wrong_name_says_what_was_expected() {
        for (text, says) in [
            ("vcan0", "names no bus, expected socketcan:vcan0"),
            ("peak:1", "no kind of bus \"peak\", expected socketcan"),
            ("socketcan:", "the interface is missing"),
            ("slcan:127.0.0.1", "the port is missing"),
            ("slcan:[::1]", "the port is missing"),
            ("slcan::29537", "the host is missing"),
            ("slcan:127.0.0.1:0", "\"0\" is no port"),
            ("slcan:127.0.0.1:70000", "\"70000\" is no port"),
            ("slcan:/dev/ttyACM0@fast", "\"fast\" is no speed of a serial port"),
            ("slcan:/dev/ttyACM0?bitrate=500k", "\"500k\" is no bit rate"),
            ("slcan:/dev/ttyACM0?bitrate=300000", "expected bits a second: 10000, 20000"),
            ("slcan:/dev/ttyACM0?rate=1", "?bitrate=500000"),
            ("socketcand:127.0.0.1/vcan0", "the port is missing"),
            ("socketcand:127.0.0.1:1/", "is no interface"),
        ] {
            let message = refusal(text);
            assert!(message.contains(says) && message.contains(text), "{text}: {message}");
        }
    }
}
