//! `gateway`: CAN buses into a file or a stream.

use std::time::Duration;

use anyhow::{Result, bail};
use clap::Args;

use super::{Endpoint, days, named, on_signal, tell};
use crate::gateway::{Named, run as listen};
use crate::sink::Sink;
use crate::stream::Stream;
use crate::stream::access::Access;

#[derive(Debug, Args)]
pub struct Arguments {
    /// Name of the plant
    #[arg(long, default_value = "plant")]
    plant: String,
    /// A bus to listen to, as socketcan:can0, with its name in the plant in front if it has another: hall3=slcan:HOST:PORT
    #[arg(long, required = true, value_parser = named)]
    bus: Vec<Named>,
    /// Where to: a file, made if there is none, nats://HOST:PORT or postgres://NAME@HOST/DATABASE
    #[arg(long, value_parser = Endpoint::of)]
    to: Endpoint,
    #[command(flatten)]
    access: Access,
    /// The NATS server forgets what is older, collected or not [default: it keeps everything]
    #[arg(long, value_name = "DAYS", value_parser = days)]
    keep_days: Option<Duration>,
}

/// Runs the command until it is told to stop.
pub fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { plant, bus: buses, to, access, keep_days } = arguments;
    for (i, bus) in buses.iter().enumerate() {
        if buses[..i].iter().any(|other| other.name == bus.name) {
            bail!("two buses are called {}, expected NAME=BUS with a name for each", bus.name);
        }
    }
    let stop = on_signal()?;
    let mut sink: Box<dyn Sink> = match (to, keep_days) {
        (Endpoint::Server(address), Some(time)) => {
            let stream = Stream::open(address, access, &[])?;
            stream.keep_for(*time)?;
            Box::new(stream)
        }
        (_, Some(_)) => bail!("--keep-days is for a NATS server; rotor-edge-plant forget is for a file"),
        _ => to.open(access)?,
    };
    for bus in buses {
        sink.claim(plant, &bus.name)?;
    }
    let totals = listen(plant, buses, &mut *sink, &stop, tell)?;
    println!("{} items kept.", totals.kept);
    match totals.lost {
        0 => Ok(()),
        lost => bail!("{lost} items were lost while {} took none", sink.description()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bus_has_the_name_in_front_or_that_of_its_place() {
        let name = |text: &str| named(text).unwrap().name;
        assert_eq!(name("hall3=slcan:127.0.0.1:29537"), "hall3");
        assert_eq!(name("slcan:127.0.0.1:29537?bitrate=500000"), "slcan:127.0.0.1:29537?bitrate=500000");
        assert_eq!(
            named("hall3=slcan:127.0.0.1:29537").unwrap().spec,
            "slcan:127.0.0.1:29537".parse().unwrap()
        );
        assert!(named("hall3=nothing").is_err());
    }
}
