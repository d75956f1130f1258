//! `gateway`: CAN buses into a file or a stream.

use std::time::Duration;

use anyhow::{Result, bail};
use clap::Args;

use super::{Endpoint, days, named, on_signal, tell};
use crate::gateway::{Named, run as listen};
use crate::names::counted;
use crate::sink::Sink;
use crate::stream::Stream;
use crate::stream::access::Access;

#[derive(Debug, Args)]
pub struct Arguments {
    /// Name of the plant
    #[arg(long, default_value = "plant")]
    plant: String,
    /// Address of a bus, such as socketcan:can0; with a name for the plant: hall3=slcan:HOST:PORT. May be given several times
    #[arg(long, required = true, value_parser = named)]
    bus: Vec<Named>,
    /// Destination: a file (created if absent), nats://HOST:PORT or postgres://NAME@HOST/DATABASE
    #[arg(long, value_parser = Endpoint::of)]
    to: Endpoint,
    #[command(flatten)]
    access: Access,
    /// Days after which the NATS server deletes items, collected or not [default: it keeps everything]
    #[arg(long, value_name = "DAYS", value_parser = days)]
    keep_days: Option<Duration>,
}

/// Runs the command until it is told to stop.
pub fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { plant, bus: buses, to, access, keep_days } = arguments;
    for (i, bus) in buses.iter().enumerate() {
        if buses[..i].iter().any(|other| other.name == bus.name) {
            bail!("two buses are named {}, expected NAME=BUS with a different name for each", bus.name);
        }
    }
    let stop = on_signal()?;
    let mut sink: Box<dyn Sink> = match (to, keep_days) {
        (Endpoint::Server(address), Some(time)) => {
            let stream = Stream::open(address, access, &[])?;
            stream.keep_for(*time)?;
            Box::new(stream)
        }
        (_, Some(_)) => bail!(
            "--keep-days applies to NATS servers only; to delete old data of a file, run rotor-edge-plant forget"
        ),
        _ => to.open(access)?,
    };
    for bus in buses {
        sink.claim(plant, &bus.name)?;
    }
    let totals = listen(plant, buses, &mut *sink, &stop, tell)?;
    println!("{} stored.", counted(totals.kept as usize, "item"));
    match totals.lost {
        0 => Ok(()),
        lost => bail!("{lost} items were lost while {} could not be written", sink.description()),
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
