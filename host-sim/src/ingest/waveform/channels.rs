//! Which channel is which probe, and which the keyphasor.

use std::collections::HashMap;

use anyhow::{Result, bail};

use super::settings::Settings;
use crate::ingest::header::is_keyphasor;
use crate::ingest::probes::Probes;
use crate::ingest::samples::{Channel, Waveform};
use crate::ingest::unit::Unit;

/// A probe and its channel.
#[derive(Debug)]
pub struct Assignment<'a> {
    pub probe: String,
    pub channel: &'a Channel,
    /// mV/µm; 1 where the channel is no voltage.
    pub mv_um: f32,
}

/// The keyphasor's channel.
///
/// # Errors
/// If nothing says which one it is.
pub fn keyphasor<'a>(waveform: &'a Waveform, settings: &Settings) -> Result<&'a Channel> {
    if let Some(name) = &settings.keyphasor.keyphasor {
        return waveform.channel(name, "--keyphasor");
    }
    match waveform.channels.iter().find(|c| is_keyphasor(&c.name)) {
        Some(channel) => Ok(channel),
        None => bail!(
            "{}: no channel is called keyphasor, kph or tacho, expected --keyphasor with one of {}",
            waveform.file,
            waveform.names()
        ),
    }
}

/// The probes in the order of the rotor, or else as stated, or as the channels stand in the file.
///
/// # Errors
/// If a probe has no channel, or a channel or a statement no probe.
pub fn probes<'a>(
    waveform: &'a Waveform,
    keyphasor: &Option<(usize, String)>,
    of_rotor: Option<&[String]>,
    settings: &Settings,
) -> Result<Vec<Assignment<'a>>> {
    let file = &waveform.file;
    let known = Probes { of_rotor: of_rotor.map(<[String]>::to_vec), ..Probes::default() };
    let stated = |probe: &str| settings.channel.iter().find(|assigned| assigned.probe == probe);
    let is_key = |channel: &Channel| keyphasor.as_ref().is_some_and(|(number, _)| channel.number == *number);
    let time = settings.time.as_ref().and_then(|name| waveform.channel(name, "--time").ok());
    let is_time = |channel: &Channel| time.is_some_and(|time| time.number == channel.number);
    let others = || waveform.channels.iter().filter(|c| !is_key(c) && !is_time(c));
    let names: Vec<String> = match of_rotor {
        Some(names) => names.to_vec(),
        None if settings.channel.is_empty() => {
            others().filter(|c| c.may_vibrate()).map(|c| c.name.clone()).collect()
        }
        None => settings.channel.iter().map(|assigned| assigned.probe.clone()).collect(),
    };
    let stated_probes = settings.channel.iter().map(|assigned| ("--channel", &assigned.probe));
    let sensed = settings.mv_um.iter().filter_map(|s| Some(("--mv-um", s.probe.as_ref()?)));
    if let Some((option, probe)) = stated_probes.chain(sensed).find(|(_, probe)| !names.contains(probe)) {
        bail!("{file}: {option} {probe}: there is no such probe, expected one of {}", names.join(", "));
    }
    // the first channel that may be a probe's
    let mut named: HashMap<String, &Channel> = HashMap::new();
    for channel in others().filter(|channel| channel.may_vibrate()) {
        if let Some(probe) = known.named(&channel.name) {
            named.entry(probe).or_insert(channel);
        }
    }
    let mut all: Vec<Assignment> = Vec::new();
    let mut taken: HashMap<usize, usize> = HashMap::new();
    for probe in names {
        let channel = match stated(&probe) {
            Some(assigned) => waveform.channel(&assigned.channel, &format!("--channel {probe}"))?,
            None => match named.get(&probe) {
                Some(channel) => *channel,
                None => bail!(
                    "{file}: no channel is named as the probe {probe}, expected --channel {probe}= with one of {}",
                    waveform.names()
                ),
            },
        };
        if is_key(channel) {
            bail!("{file}: channel {} is the keyphasor and cannot be the probe {probe}", channel.header);
        }
        if let Some(other) = taken.insert(channel.number, all.len()) {
            let other = &all[other].probe;
            bail!("{file}: channel {} cannot be the probes {other} and {probe}", channel.header);
        }
        if let Some(unit) = channel.unit.filter(|unit| settings.unit() == Unit::Volt && *unit != Unit::Volt) {
            bail!(
                "{file}: channel {} is in {}, --unit is V, expected --unit with the unit of the channels",
                channel.header,
                unit.symbol()
            );
        }
        let own = settings.mv_um.iter().rfind(|s| s.probe.as_ref() == Some(&probe));
        let of_all = || settings.mv_um.iter().rfind(|s| s.probe.is_none());
        let mv_um = match own.or_else(of_all) {
            Some(sensitivity) => sensitivity.mv_um,
            None if settings.unit().is_voltage() => {
                bail!("{file}: the probe {probe} has no sensitivity, expected --mv-um {probe}=MV_UM")
            }
            None => 1.0,
        };
        all.push(Assignment { probe, channel, mv_um });
    }
    if all.is_empty() {
        let key = keyphasor.as_ref().map_or("the times", |(_, name)| name);
        bail!("{file}: there is no channel beside {key}, expected those of the probes");
    }
    Ok(all)
}
