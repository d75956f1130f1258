//! `replay`: the main job.

mod better;
mod bus;
mod unbalance;

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::Args;
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::rotor_file;

use super::detector_arguments::DetectorArguments;
use super::identify::{self, Days};
use super::listener::Listener;
use super::output;
use crate::answers::replay::{ReplayAnswer, ReplayJob, answers};
use crate::bus::BusConfig;
use crate::command::shell;
use crate::edge::Deployment;
use crate::ingest::dates::Dates;
use crate::render::{self, Figure, Section};
use crate::replay::check::equivalence;
use crate::replay::fit::ModelFit;
use crate::replay::timing::age_limit_s;
use crate::replay::{ReplayConfig, day, flags};
use crate::sample;
use crate::say;
use crate::terminal;
use better::{Better, trends};
use bus::Over;

#[derive(Debug, Args)]
pub struct Arguments {
    /// The rotor, rotor.toml; the built-in sample if absent
    #[arg(long, requires = "record")]
    rotor: Option<PathBuf>,
    /// Record of this rotor, measured.csv
    #[arg(long, requires = "rotor")]
    record: Option<PathBuf>,
    /// A commissioning run-up for phase I
    #[arg(long, requires = "rotor")]
    runup: Option<PathBuf>,
    /// The rotor's bearings and planes are identified already: no phase I
    #[arg(long, conflicts_with = "runup")]
    identified: bool,
    /// A better model, as `improve` writes it: the days from the event on are played with it as well
    #[arg(long)]
    better: Option<PathBuf>,
    /// The day from which on the better model is played; the first suspicious one if absent
    #[arg(long, requires = "better")]
    since: Option<f64>,
    /// Cut the controller's power before this day of the record; it restarts from its stored state. May be given
    /// several times
    #[arg(long, value_name = "DAY", conflicts_with = "bus")]
    power_cut: Vec<f64>,
    #[command(flatten)]
    detector: DetectorArguments,
    #[command(flatten)]
    over: Over,
    #[command(flatten)]
    faults: Faults,
    /// Every answer of the controller in the JSON object, not only the summary
    #[arg(long, requires = "json")]
    answers: bool,
    #[command(flatten)]
    runout: output::Runout,
    #[command(flatten)]
    form: output::Form,
}

/// What the in-process bus does to frames.
#[derive(Debug, Args)]
struct Faults {
    /// Chance that a frame is lost on its way to a receiver
    #[arg(long, default_value_t = 0.0, conflicts_with = "bus")]
    loss: f64,
    /// Chance that a frame arrives twice
    #[arg(long, default_value_t = 0.0, conflicts_with = "bus")]
    repetition: f64,
    /// Chance that a frame arrives with a flipped bit
    #[arg(long, default_value_t = 0.0, conflicts_with = "bus")]
    flip: f64,
    /// Longest extra delay of a frame, ms
    #[arg(long, default_value_t = 0.0, conflicts_with = "bus")]
    delay_ms: f64,
}

impl Arguments {
    /// The main job on the built-in sample.
    pub fn sample() -> Self {
        #[derive(clap::Parser)]
        struct Alone {
            #[command(flatten)]
            arguments: Arguments,
        }
        <Alone as clap::Parser>::parse_from(["replay"]).arguments
    }

    fn config(&self) -> Result<ReplayConfig> {
        let Faults { loss, repetition, flip, .. } = self.faults;
        for (name, value) in [("--loss", loss), ("--repetition", repetition), ("--flip", flip)] {
            if !(0.0..=1.0).contains(&value) {
                bail!("{name} {value}: expected a probability between 0 and 1");
            }
        }
        if !(0.0..=1e6).contains(&self.faults.delay_ms) {
            bail!("--delay-ms {}: expected milliseconds, not negative", self.faults.delay_ms);
        }
        let bus = BusConfig {
            loss,
            repetition,
            flip,
            longest_delay_us: (self.faults.delay_ms * 1000.0) as u64,
            seed: self.detector.seed,
            ..BusConfig::default()
        };
        let node = self.detector.config()?;
        let power_cuts_d = self.power_cut.clone();
        Ok(ReplayConfig { node, age_limit_s: self.detector.age_limit_s(), power_cuts_d, bus })
    }

    /// Power can be cut only while the record lasts.
    fn check_power_cuts(&self, record: &[Reading]) -> Result<()> {
        let [first, last] = [0, record.len() - 1].map(|row| day(record, row));
        for cut in &self.power_cut {
            if !(first..=last).contains(cut) {
                bail!("--power-cut {cut}: the record lasts from day {first} to {last}");
            }
        }
        Ok(())
    }

    /// When day 0 of the record was, where its first lines say so.
    fn dates(&self) -> Result<Dates> {
        self.record.as_deref().map_or(Ok(Dates::default()), |record| Dates::of(None, record))
    }

    fn load(&self) -> Result<(Rotor, Vec<Reading>, Option<Vec<Reading>>)> {
        let (Some(rotor), Some(record)) = (&self.rotor, &self.record) else {
            let (rotor, record, runup) = sample::load()?;
            return Ok((rotor, record, Some(runup)));
        };
        let rotor = rotor_file::read(rotor)?;
        let record = self.runout.read(record, &rotor)?;
        let runup = self.runup.as_deref().map(|path| self.runout.read(path, &rotor)).transpose()?;
        Ok((rotor, record, runup))
    }
}

/// The name of a file, or of what is played where none is given.
fn name(path: &Option<PathBuf>) -> String {
    path.as_ref().map_or("the built-in sample".into(), |path| path.display().to_string())
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let (rotor, record, runup) = arguments.load()?;
    if arguments.over.external && !rotor.unused.is_empty() {
        bail!(
            "--external: the rotor has a probe with used = false, whose readings the monitor expects; replay without it"
        );
    }
    let config = arguments.config()?;
    arguments.check_power_cuts(&record)?;
    let begun = Instant::now();
    let phase_one = match arguments.identified {
        true if rotor.plane.iter().any(|p| p.unbalance_g_mm.is_none()) => {
            bail!(
                "{}: [[plane]]: unbalance_g_mm is missing, expected it in every plane with --identified; \
                 `rotor-edge identify` writes it",
                name(&arguments.rotor)
            )
        }
        true => None,
        false => {
            let days = Days::FIRST_THREE.select(&record).with_context(|| name(&arguments.record))?;
            Some(identify::phase_one(
                &rotor,
                &days,
                runup.as_deref(),
                arguments.detector.seed,
                Listener::Terminal,
            )?)
        }
    };
    let identified = phase_one.as_ref().map_or(&rotor, |p| &p.rotor);
    let fastest_rpm = record.iter().chain(runup.iter().flatten()).map(|r| r.speed_rpm).fold(0.0, f64::max);
    let deployment = Deployment::new(identified, fastest_rpm)?;
    let bar = output::progress("replay", record.len());
    let played =
        arguments.over.play(&deployment, &record, &config, |row| bar.set_position(row as u64 + 1))?;
    bar.finish_and_clear();
    if played.answers.is_empty() {
        bail!(
            "0 of {} readings were evaluated: nothing can be said of the model or of the machine ({} frames sent, {} lost)",
            record.len(),
            played.traffic.sent,
            played.traffic.lost
        );
    }
    let agreement = equivalence(&deployment, &config, &record, &played.answers)?;
    let raised = flags(&record, &played.answers);
    let last = unbalance::last(identified, &deployment, &record, &played.answers, phase_one.as_ref())?;
    let better = arguments.better.as_deref().map(|path| {
        let since_d = arguments.since.or_else(|| raised.first().map(|f| f.since_d));
        Better::play(path, &record, since_d, fastest_rpm, &config)
    });
    let better = better.transpose()?;
    let job = ReplayJob {
        rotor_name: rotor.name.clone(),
        recorded: record.len(),
        days: [0, record.len() - 1].map(|row| day(&record, row)),
        phase_one: phase_one.as_ref().map(|found| (found.into(), runup.as_ref().map(Vec::len))),
        bus: arguments.over.label(),
        age_limit_s: f64::from(age_limit_s(&config, &record)),
        power_cuts_d: config.power_cuts_d.clone(),
        dates: arguments.dates()?,
    };
    let mut answer = ReplayAnswer::of(&rotor, &record, &played, &agreement, &raised, last, job);
    answer.better = better.as_ref().map(|b| b.answer(&record, &played));
    if let Some(path) = &arguments.form.report {
        let drawn = trends(&answer, &rotor, &record, &played, better.as_ref());
        report(path, &answer, drawn, &next(arguments, &answer))?;
    }
    if arguments.form.json {
        answer.answers = arguments.answers.then(|| answers(&record, &played));
        output::json(&answer)?;
    } else {
        terminal::print(&render::replay::text(&answer));
        say!("\nThe whole replay took {:.2} s.", begun.elapsed().as_secs_f64());
        say!("Next: {}", next(arguments, &answer));
    }
    agreement.verdict()
}

/// Writes the page; `drawn` is the figure of the first screen, and what stands below it.
fn report(
    path: &Path,
    answer: &ReplayAnswer,
    (residual, sections): (Figure, Vec<Section>),
    next: &str,
) -> Result<()> {
    let (words, commands) = next.split_once('\n').unwrap_or((next, ""));
    let commands: Vec<&str> = commands.lines().map(str::trim_start).collect();
    let command = (!commands.is_empty()).then(|| commands.join("\n"));
    let story = render::replay::story(answer, residual, (words.into(), command));
    output::story(path, &format!("{}: replay", answer.job.rotor_name), &story, sections)
}

/// Which command to run next.
fn next(arguments: &Arguments, answer: &ReplayAnswer) -> String {
    match (answer.flags.first(), &arguments.rotor, &arguments.record) {
        (None, ..) => "nothing to do; replay again when there are new readings.".into(),
        (Some(_), Some(rotor), Some(record)) if matches!(answer.fit, ModelFit::BeganOn { .. }) => format!(
            "follow the unbalance from that day on\n  rotor-edge track {} {}",
            shell::path(rotor),
            shell::path(record)
        ),
        (Some(_), Some(rotor), Some(_)) => format!(
            "learn which physical effect is missing, from a run-up of the machine as it is now\n  \
             rotor-edge improve {} RUNUP.csv -o better.toml",
            shell::path(rotor)
        ),
        (Some(_), ..) if arguments.better.is_some() => {
            "send the better model to the controller, with rotor-edge deploy.".into()
        }
        (Some(_), ..) => {
            "learn which physical effect is missing, from the run-up that was recorded the day after, \
                          and see the controller's residual fall\n  \
                          cargo run --release -- improve host-sim/sample/turbine/rotor.toml \
                          host-sim/sample/turbine/runup-day126.csv -o better.toml\n  \
                          cargo run --release -- replay --better better.toml --report replay.html"
                .into()
        }
    }
}
