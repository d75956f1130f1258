//! `gateway`: CAN buses into a file or a stream.

use std::fs::File;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::Args;
use rotor_edge::bus::BusSpec;

use super::{Place, on_signal, tell};
use crate::gateway::{Named, run as listen};
use crate::item::plain_word;

#[derive(Debug, Args)]
pub struct Arguments {
    /// Name of the plant
    #[arg(long, default_value = "plant")]
    plant: String,
    /// A bus to listen to, as socketcan:can0, with its name in the plant in front if it has another: hall3=slcan:HOST:PORT
    #[arg(long, required = true, value_parser = named)]
    bus: Vec<Named>,
    /// Where to: a file, made if there is none, or nats://HOST:PORT
    #[arg(long, value_parser = Place::of)]
    to: Place,
    /// What the server lets us in by: a file of NATS credentials
    #[arg(long, value_name = "FILE")]
    credentials: Option<PathBuf>,
}

fn named(text: &str) -> Result<Named, String> {
    let (name, spec) = match text.split_once('=') {
        // a bit rate has an equals sign too
        Some((name, spec)) if !name.contains(':') => (name, spec),
        _ => (text, text),
    };
    let spec: BusSpec = spec.parse().map_err(|error: anyhow::Error| format!("{error:#}"))?;
    Ok(Named { name: name.into(), spec })
}

/// Runs the command until it is told to stop.
pub fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { plant, bus: buses, to, credentials } = arguments;
    for (i, bus) in buses.iter().enumerate() {
        if buses[..i].iter().any(|other| other.name == bus.name) {
            bail!("two buses are called {}, expected NAME=BUS with a name for each", bus.name);
        }
    }
    let stop = on_signal()?;
    let mut keeper = to.open(credentials.as_deref())?;
    let _locks = match to {
        Place::File(path) => {
            buses.iter().map(|bus| lock(path, plant, &bus.name)).collect::<Result<Vec<_>>>()?
        }
        Place::Server(_) => Vec::new(),
    };
    let totals = listen(plant, buses, &mut *keeper, &stop, tell)?;
    println!("{} items kept.", totals.kept);
    match totals.lost {
        0 => Ok(()),
        lost => bail!("{lost} items were lost while {} took none", keeper.description()),
    }
}

/// Two gateways that call a bus alike would number its items twice. Held as long as what it gives back lives.
fn lock(store: &std::path::Path, plant: &str, bus: &str) -> Result<File> {
    let path = PathBuf::from(format!("{}-{}-{}.lock", store.display(), plain_word(plant), plain_word(bus)));
    let file = File::create(&path).with_context(|| format!("{}: cannot be made", path.display()))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(std::fs::TryLockError::WouldBlock) => bail!(
            "another gateway keeps bus {bus} of {plant} in {}; end it, or give one of them another name",
            store.display()
        ),
        Err(std::fs::TryLockError::Error(error)) => {
            Err(error).with_context(|| format!("{}: cannot be locked", path.display()))
        }
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
