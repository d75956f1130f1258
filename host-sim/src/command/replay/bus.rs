//! Which bus `replay` plays over, and whose monitor answers.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use rotor_edge_desktop::measurement::Reading;

use crate::bus::BusSpec;
use crate::bus::log::{LogWriter, RecordingBus};
use crate::bus::mac::AuthenticatedBus;
use crate::bus::wire::WireFrame;
use crate::command::output;
use crate::deploy::{Authority, HEARTBEAT_TIME, read_key};
use crate::edge::Deployment;
use crate::replay::live::{run_with_foreign_monitor, run_with_own_monitor};
use crate::replay::{self, Replay, ReplayConfig};

/// Where a record is played.
#[derive(Debug, Args)]
pub struct Over {
    /// A real bus, such as slcan:127.0.0.1:29537 or socketcan:vcan0; in-process and in simulated time if absent
    #[arg(long)]
    bus: Option<BusSpec>,
    /// The monitor is on that bus already and holds this model (see `deploy`); needs its key, to begin a new record
    #[arg(long, requires = "bus", requires = "key")]
    pub external: bool,
    /// Key of that monitor
    #[arg(long, requires = "external")]
    key: Option<PathBuf>,
    /// Write every frame to a candump log (see `decode`)
    #[arg(long)]
    log: Option<PathBuf>,
}

impl Over {
    /// Plays the record there.
    ///
    /// # Errors
    /// If the bus or the monitor fails.
    pub fn play(
        &self,
        deployment: &Deployment,
        record: &[Reading],
        config: &ReplayConfig,
        progress: impl FnMut(usize),
    ) -> Result<Replay> {
        let Some(spec) = &self.bus else {
            return self.simulated(deployment, record, config, progress);
        };
        let mut host = spec.open()?;
        if let Some(path) = &self.log {
            host = Box::new(RecordingBus::new(host, path)?);
        }
        match &self.key {
            Some(path) => {
                let mut authority = Authority::new(read_key(path)?, config.node.node, None)?;
                let mut host = AuthenticatedBus::listen(&mut *host, authority.checker(), HEARTBEAT_TIME)?;
                let replay =
                    run_with_foreign_monitor(&mut host, &mut authority, deployment, record, config, progress);
                let refused = host.refused();
                if refused.any() {
                    output::tell(&format!("frames of monitor {} {refused}", config.node.node));
                }
                replay
            }
            None => {
                let mut monitor = spec.open()?;
                run_with_own_monitor(&mut *host, &mut *monitor, deployment, record, config, progress)
            }
        }
    }

    fn simulated(
        &self,
        deployment: &Deployment,
        record: &[Reading],
        config: &ReplayConfig,
        progress: impl FnMut(usize),
    ) -> Result<Replay> {
        let mut log = self.log.as_deref().map(LogWriter::create).transpose()?;
        replay::run_overheard(deployment, record, config, progress, |time_us, frame| match &mut log {
            Some(log) => Ok(log.write(time_us, [&WireFrame::from(frame)])?),
            None => Ok(()),
        })
    }

    /// What to call the bus.
    pub fn label(&self) -> String {
        self.bus
            .as_ref()
            .map_or_else(|| "In-process CAN bus, 500 kbit/s".into(), |spec| format!("CAN bus {spec}"))
    }
}
