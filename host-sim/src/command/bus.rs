//! `bus`: the shared bus without hardware and without the kernel.

use std::path::PathBuf;
use std::sync::mpsc::channel;

use anyhow::{Context, Result, bail};
use clap::Args;
use serde::Serialize;

use super::output;
use crate::bus::load::{Load, MONITORS, READINGS_A_SECOND, frames_a_second, loads};
use crate::bus::server::{Counts, Server};
use crate::{say, terminal};

#[derive(Debug, Args)]
pub struct Arguments {
    /// Port for SLCAN over TCP, 0 for any that is free
    #[arg(long, default_value_t = 29_537)]
    slcan: u16,
    /// Port for socketcand, 0 for any that is free
    #[arg(long, default_value_t = 29_536)]
    socketcand: u16,
    /// Record every frame as a candump log, in place of any older one
    #[arg(long, value_name = "FILE.log")]
    record: Option<PathBuf>,
    /// Print one JSON object with ports and load instead of text
    #[arg(long)]
    json: bool,
}

/// What `bus --json` prints at its start.
#[derive(Serialize)]
struct Opened {
    slcan_port: u16,
    socketcand_port: u16,
    slcan: String,
    socketcand: String,
    record: Option<PathBuf>,
    monitors: u32,
    frames_a_second: u32,
    load: Vec<Load>,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let (ending, ended) = channel();
    // nobody is left to be told if this end of the channel is gone
    let end = move || {
        let _ = ending.send(());
    };
    ctrlc::set_handler(end).context("signals cannot be caught")?;
    let server = Server::start(arguments.slcan, arguments.socketcand, arguments.record.as_deref())?;
    let opened = Opened {
        slcan_port: server.slcan_port,
        socketcand_port: server.socketcand_port,
        slcan: format!("slcan:127.0.0.1:{}", server.slcan_port),
        socketcand: format!("socketcand:127.0.0.1:{}/vcan0", server.socketcand_port),
        record: arguments.record.clone(),
        monitors: MONITORS,
        frames_a_second: MONITORS * frames_a_second(),
        load: loads(),
    };
    if arguments.json {
        output::json(&opened)?;
    } else {
        terminal::print(&opened.text());
    }
    ended.recv().context("the bus")?;
    let summary = summary(&server.counts());
    if arguments.json {
        server.tell_last(summary);
    } else {
        say!("\n{summary}");
    }
    match (server.take_log_error(), &arguments.record) {
        (Some(e), Some(path)) => {
            bail!(
                "{}: the recording ended before the bus, as the file could not be written ({e})",
                path.display()
            )
        }
        _ => Ok(()),
    }
}

impl Opened {
    fn text(&self) -> String {
        let mut text = String::new();
        text += "The bus is open: every frame of one participant goes to all the others. Join it with\n";
        text += &format!("  rotor-edge   --bus {}\n", self.slcan);
        text += &format!("               --bus {}\n", self.socketcand);
        text += &format!(
            "  python-can   can.Bus(interface=\"slcan\", channel=\"socket://127.0.0.1:{}\", sleep_after_open=0)\n",
            self.slcan_port
        );
        text += &format!(
            "               can.Bus(interface=\"socketcand\", host=\"127.0.0.1\", port={}, channel=\"vcan0\"), receives faster\n",
            self.socketcand_port
        );
        if let Some(path) = &self.record {
            text += &format!("Every frame is recorded in {}.\n", path.display());
        }
        text += &format!(
            "\nOn wires, {MONITORS} monitors at {READINGS_A_SECOND} readings a second send {} frames a second.\n",
            self.frames_a_second
        );
        text += "  bit rate         load   monitors that fit\n";
        for load in &self.load {
            let fit = if load.monitors == MONITORS { "all ".to_string() } else { String::new() };
            text += &format!(
                "  {:>4} kbit/s {:>7.0} %   {fit}{}\n",
                load.bit_rate / 1000,
                100.0 * load.load,
                load.monitors
            );
        }
        text += "\nCtrl-C ends it.\n";
        text
    }
}

fn summary(counts: &Counts) -> String {
    let Counts { clients, frames, dropped, refused, turned_away } = counts;
    format!(
        "{frames} frames of {clients} clients; {dropped} copies dropped for clients that did not read; {refused} lines refused; \
         {turned_away} connections turned away"
    )
}
