//! One command over one machine with all that it needs, to be done anywhere, and what came of it.

use std::ffi::OsString;
use std::io::{Read as _, Write as _};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Parser as _;
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use rotor_edge::command::{Cli, Listener, object, run as run_command, shown};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::gateway::Named;
use crate::item::{Source, plain_word};

/// A task or an answer takes no more than this, bytes: readings of a year, every minute, or a report.
const MOST_BYTES: u64 = 64 << 20;

/// A command that a fleet is run through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FleetCommand {
    /// The unbalance over the days of the period.
    Track,
    Forecast,
    /// Which physical effect is missing.
    Diagnose,
    /// Add effects until the model is adequate.
    Improve,
    /// Send the better model to the monitor.
    Deploy,
}

impl FleetCommand {
    /// As the command line calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Track => "track",
            Self::Forecast => "forecast",
            Self::Diagnose => "diagnose",
            Self::Improve => "improve",
            Self::Deploy => "deploy",
        }
    }

    pub fn of(name: &str) -> Option<Self> {
        let all = [Self::Track, Self::Forecast, Self::Diagnose, Self::Improve, Self::Deploy];
        all.into_iter().find(|command| command.name() == name)
    }

    /// Whether it follows a machine from day to day.
    pub fn is_daily(self) -> bool {
        matches!(self, Self::Track | Self::Forecast)
    }
}

/// What there is to do.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Task {
    /// Id of its job.
    pub id: String,
    /// Version of the program whose answer is asked for.
    pub version: String,
    pub command: FleetCommand,
    /// `track`: its method. `forecast`: the limit, g·mm. `deploy`: the time of its trial, s.
    pub option: Option<String>,
    /// The monitor of the machine.
    pub source: Source,
    /// The drawing; the model that is to be deployed.
    pub rotor: String,
    /// Readings as CSV; none for `deploy`.
    pub data: String,
}

/// What became of a job.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub enum Ended {
    Done {
        /// A JSON object.
        answer: String,
        /// A better drawing, of `improve`.
        model: Option<String>,
        /// An HTML page.
        report: Option<String>,
    },
    /// It cannot be done, for a reason in one sentence.
    Failed(String),
    /// It was begun so often that it may be what kills workers.
    Aside(String),
}

/// What a worker does: commands of the desk, or deployments over the buses that it is at.
#[derive(Debug, Clone, Default)]
pub struct Hands {
    /// Name of the plant of these buses.
    pub plant: String,
    /// Buses that deployments go over; none: commands of the desk.
    pub buses: Vec<Named>,
    /// Folder of keys, BUS/NODE.key.
    pub keys: PathBuf,
}

impl Hands {
    /// Whether this worker is the one for a job.
    pub fn takes(&self, command: FleetCommand, source: &Source) -> bool {
        let is_near = source.plant == self.plant && self.buses.iter().any(|bus| bus.name == source.bus);
        if command == FleetCommand::Deploy { is_near } else { self.buses.is_empty() }
    }
}

impl Task {
    /// Does it; whatever happens is told.
    pub fn done(&self, hands: &Hands) -> Ended {
        let tried = catch_unwind(AssertUnwindSafe(|| match self.command {
            FleetCommand::Deploy => self.deployed(hands),
            _ => self.at_the_desk(),
        }));
        match tried {
            Ok(Ok(done)) => done,
            Ok(Err(error)) => Ended::Failed(format!("{error:#}")),
            Err(_) => Ended::Failed("it panicked, which is a fault of the program".into()),
        }
    }

    /// What the command says of the machine's readings, and what it wrote.
    fn at_the_desk(&self) -> Result<Ended> {
        let folder = tempfile::tempdir().context("no temporary folder for the job")?;
        let file = |name: &str| folder.path().join(name);
        std::fs::write(file("rotor.toml"), &self.rotor)?;
        std::fs::write(file("data.csv"), &self.data)?;
        let read = [file("rotor.toml").into(), file("data.csv").into()];
        let said = |name: &str, words: Vec<OsString>| {
            let words = std::iter::once(name.into()).chain(words);
            object(words.chain(["--json".into()]), Listener::Program(&|_, _| {}))
        };
        let report = || ["--report".into(), file("report.html").into()];
        let answer = match self.command {
            FleetCommand::Track => {
                let method = self.option.as_deref().unwrap_or("adaptive");
                said("track", [&read[..], &["--method".into(), method.into()], &report()].concat())?
            }
            FleetCommand::Forecast => {
                let track = file("track.csv");
                let kept = ["--method".into(), "joint".into(), "--csv".into(), track.clone().into()];
                said("track", [&read[..], &kept].concat())?;
                let limit = self.option.as_ref().map(|limit| vec!["--limit".into(), limit.into()]);
                said("forecast", [&[track.into()], &limit.unwrap_or_default()[..], &report()].concat())?
            }
            FleetCommand::Improve => {
                said("improve", [&read[..], &["-o".into(), file("better.toml").into()], &report()].concat())?
            }
            FleetCommand::Diagnose | FleetCommand::Deploy => {
                said("diagnose", [&read[..], &report()].concat())?
            }
        };
        let written = |name: &str| std::fs::read_to_string(file(name)).ok();
        Ok(Ended::Done { answer, model: written("better.toml"), report: written("report.html") })
    }

    /// The model is sent as `rotor-edge deploy` sends it, with the key that this host has.
    fn deployed(&self, hands: &Hands) -> Result<Ended> {
        let Source { bus, node, .. } = &self.source;
        let Some(at) = hands.buses.iter().find(|named| named.name == *bus) else {
            bail!("this worker is not at bus {bus}");
        };
        let folder = tempfile::tempdir().context("no temporary folder for the job")?;
        let model = folder.path().join("rotor.toml");
        std::fs::write(&model, &self.rotor)?;
        let key = hands.keys.join(plain_word(bus)).join(format!("{node}.key"));
        let [number, place] = [node.to_string(), at.spec.to_string()];
        let mut words: Vec<OsString> =
            ["rotor-edge", "deploy", "--bus", &place, "--node", &number].map(OsString::from).into();
        words.extend([OsString::from("--key"), key.into(), model.into()]);
        if let Some(seconds) = &self.option {
            words.extend(["--trial".into(), seconds.into()]);
        }
        let cli = Cli::try_parse_from(words).map_err(|error| anyhow::anyhow!("{error}"))?;
        run_command(cli).map_err(|error| anyhow::anyhow!(shown(&error)))?;
        Ok(Ended::Done { answer: r#"{"outcome":"accepted"}"#.into(), model: None, report: None })
    }
}

/// As it is kept and sent.
///
/// # Errors
/// If it cannot be told as JSON.
pub fn packed(value: &impl Serialize) -> Result<Vec<u8>> {
    squeezed(&serde_json::to_vec(value)?)
}

/// What was packed.
///
/// # Errors
/// One sentence if it is something else, or far too large.
pub fn unpacked<T: DeserializeOwned>(bytes: &[u8]) -> Result<T> {
    let mut text = Vec::new();
    let read = GzDecoder::new(bytes).take(MOST_BYTES).read_to_end(&mut text);
    read.context("it is not compressed with gzip")?;
    serde_json::from_slice(&text).context("it has unexpected content")
}

/// As a browser takes it, too.
///
/// # Errors
/// Never, into memory.
pub fn squeezed(text: &[u8]) -> Result<Vec<u8>> {
    let mut squeezing = GzEncoder::new(Vec::new(), Compression::default());
    squeezing.write_all(text)?;
    Ok(squeezing.finish()?)
}

/// Where the keys of a plant's monitors are: a folder with BUS/NODE.key.
///
/// # Errors
/// One sentence if it is no folder.
pub fn keys_in(folder: &Path) -> Result<PathBuf> {
    if !folder.is_dir() {
        bail!("{}: not a folder of keys, expected a folder with BUS/NODE.key", folder.display());
    }
    Ok(folder.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source() -> Source {
        Source { plant: "north".into(), bus: "hall1".into(), node: 7 }
    }

    #[test]
    fn a_task_comes_back_from_what_is_sent_and_other_bytes_do_not() {
        let task = Task {
            id: "1".into(),
            version: "0.1.0".into(),
            command: FleetCommand::Forecast,
            option: Some("3.5".into()),
            source: source(),
            rotor: "drawing".into(),
            data: "0,1\n".repeat(1_000),
        };
        let sent = packed(&task).unwrap();
        assert!(sent.len() < 400, "{}", sent.len());
        assert_eq!(unpacked::<Task>(&sent).unwrap(), task);
        assert_eq!(
            format!("{:#}", unpacked::<Task>(b"hello").unwrap_err()).split(':').next(),
            Some("it is not compressed with gzip")
        );
        assert!(unpacked::<Ended>(&sent).is_err());
    }

    #[test]
    fn deployment_goes_to_worker_at_its_bus() {
        let bus = Named { name: "hall1".into(), spec: "slcan:127.0.0.1:1".parse().unwrap() };
        let near = Hands { plant: "north".into(), buses: vec![bus.clone()], keys: "keys".into() };
        let elsewhere = Hands { plant: "south".into(), ..near.clone() };
        let takes = |hands: &Hands, command| hands.takes(command, &source());
        assert_eq!(
            [&near, &elsewhere, &Hands::default()].map(|h| takes(h, FleetCommand::Deploy)),
            [true, false, false]
        );
        assert_eq!(
            [&near, &elsewhere, &Hands::default()].map(|h| takes(h, FleetCommand::Track)),
            [false, false, true]
        );
    }
}
