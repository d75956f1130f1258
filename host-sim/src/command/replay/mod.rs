//! `replay`: the main job.

mod better;
mod bus;
mod fit;
mod unbalance;

use rotor_edge_desktop::units::SECONDS_A_DAY;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Result, bail};
use clap::Args;
use rotor_edge_desktop::identify::PhaseOne;
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::rotor_file;

use super::detector_arguments::DetectorArguments;
use super::identify::{self, Days};
use super::listener::Listener;
use super::output;
use crate::answers::replay::{ReplayAnswer, answers};
use crate::bus::BusConfig;
use crate::bus::numbers::probe_numbers;
use crate::bus::states::name;
use crate::command::shell;
use crate::edge::Deployment;
use crate::replay::check::{Equivalence, equivalence};
use crate::replay::timing::age_limit_s;
use crate::replay::{self, Flag, Replay, ReplayConfig, day, flags};
use crate::sample;
use crate::watch::words::span;
use better::{Better, trends};
use bus::Over;
use fit::ModelFit;

#[derive(Debug, Args)]
pub struct Arguments {
    /// The rotor, rotor.toml; the built-in sample if absent
    #[arg(long, requires = "record")]
    rotor: Option<PathBuf>,
    /// Its record, measured.csv
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
    /// Cut the controller's power before this day of the record, and let it go on from what it stored; may be given several
    /// times
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
                "--identified needs a rotor with unbalance_g_mm in every [[plane]]; run `rotor-edge identify` first"
            )
        }
        true => None,
        false => {
            let days = Days::FIRST_THREE.select(&record)?;
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
    if let Some(path) = &arguments.form.report {
        let sections = trends(&rotor, &record, &played, &raised, better.as_ref());
        output::report(path, &format!("{}: replay", rotor.name), sections)?;
    }
    if arguments.form.json {
        let before = better.as_ref().map(|b| b.summary(&record, &played));
        let answers = arguments.answers.then(|| answers(&record, &played));
        output::json(&ReplayAnswer::of(&rotor, &played, &agreement, &raised, before, answers, last))?;
    } else {
        let job =
            Job { rotor: &rotor, record: &record, phase_one: phase_one.as_ref(), runup: runup.as_deref() };
        job.print(&arguments.over.label(), &config, &played, &agreement, &raised);
        unbalance::print(&last);
        if let Some(better) = &better {
            better.print(&record, &played);
        }
        println!("\nThe whole replay took {:.2} s.", begun.elapsed().as_secs_f64());
        job.print_next(arguments, &played, &raised);
    }
    agreement.verdict()
}

struct Job<'a> {
    rotor: &'a Rotor,
    record: &'a [Reading],
    phase_one: Option<&'a PhaseOne>,
    runup: Option<&'a [Reading]>,
}

impl Job<'_> {
    fn print(
        &self,
        bus: &str,
        config: &ReplayConfig,
        played: &Replay,
        agreement: &Equivalence,
        raised: &[Flag],
    ) {
        let rows = self.record.len();
        println!(
            "{}: {rows} readings, days {:.0} to {:.0}",
            self.rotor.name,
            self.day(0),
            self.day(rows - 1)
        );
        if let Some(found) = self.phase_one {
            let runup = self.runup.map_or(String::new(), |r| format!(" and a run-up of {} speeds", r.len()));
            println!("\nPhase I, from the first three days{runup}");
            identify::print(&found.into());
        }
        let (t, c) = (played.traffic, played.counters);
        println!("\n{bus}");
        println!("  frames sent {}, received {}, lost {}", t.sent, t.received, t.lost);
        println!(
            "  readings evaluated {} ({} without all probes), skipped {}, lost {}, rejected {}, repeated {}, late {}",
            c.readings, c.partial, c.skipped, c.lost, c.rejected, c.repeated, c.late
        );
        let age_limit_s = f64::from(age_limit_s(config, self.record));
        let age_limit = match age_limit_s / SECONDS_A_DAY {
            days if days >= 1.0 => format!("{days:.1} d"),
            _ => span((age_limit_s * 1e6) as u64),
        };
        println!(
            "  its clock is the record's; a verdict counts for {age_limit} (--age-limit-s {age_limit_s})"
        );
        for day in &config.power_cuts_d {
            println!("  power lost before day {day}, back from what it had stored");
        }
        println!(
            "\nThe core (f32, on the bus) against the desktop crate (f64)             measured     allowed"
        );
        println!(
            "  features, of the reading's largest                                   {:>10.1e}  {:>10.0e}",
            agreement.max_relative_feature_error,
            replay::check::FEATURE_LIMIT
        );
        println!(
            "  residual above the exact optimum, of the feature sum                 {:>10.1e}  {:>10.0e}",
            agreement.max_relative_excess,
            replay::check::EXCESS_LIMIT
        );
        println!(
            "  the same in µm                                                       {:>10.1e}",
            agreement.max_residual_excess_um
        );
        println!(
            "  largest gap that the core's own certificate leaves, of the feature sum {:>8.1e}  {:>10.0e}",
            agreement.max_relative_gap,
            replay::check::EXCESS_LIMIT
        );
        println!(
            "  unbalance against the exact optimum's                         {:>10.2} g·mm, {:.2}°",
            agreement.max_unbalance_difference_g_mm, agreement.max_angle_difference_deg
        );
        self.print_flags(played, raised);
        self.print_states(played);
    }

    /// What the controller said of itself, as long as it is not too much.
    fn print_states(&self, played: &Replay) {
        const MOST: usize = 12;
        println!("\nWhat the controller said of itself");
        for change in played.states.iter().take(MOST) {
            let status = &change.status;
            let missing = match probe_numbers(status.missing_mask) {
                numbers if numbers.is_empty() => String::new(),
                numbers => format!(", without {}", self.probe_names(&numbers)),
            };
            println!(
                "  from day {:<10} {}: {}{missing}",
                change.time_d,
                name(status.state),
                name(status.reason)
            );
        }
        if played.states.len() > MOST {
            println!("  and {} changes more (--json has all)", played.states.len() - MOST);
        }
    }

    fn probe_names(&self, numbers: &[u8]) -> String {
        let names = numbers.iter().filter_map(|number| self.rotor.probe.get(usize::from(*number) - 1));
        names.map(|probe| probe.name.as_str()).collect::<Vec<_>>().join(", ")
    }

    fn print_flags(&self, played: &Replay, raised: &[Flag]) {
        println!("\nDoes the model still fit?");
        let fit = ModelFit::of(self.record, &played.answers, raised);
        fit.words(played.answers.len(), self.record.len()).iter().for_each(|line| println!("  {line}"));
        for flag in raised {
            let suspect = flag.suspect.and_then(|b| self.rotor.bearing.get(b));
            let suspect = suspect.map_or("no bearing", |bearing| &bearing.name);
            println!(
                "  Flag raised on day {:.0}, up for {} readings; suspect bearing: {suspect}",
                flag.time_d, flag.readings
            );
        }
    }

    /// Which command to run next.
    fn print_next(&self, arguments: &Arguments, played: &Replay, raised: &[Flag]) {
        let fit = ModelFit::of(self.record, &played.answers, raised);
        match (raised.first(), &arguments.rotor, &arguments.record) {
            (None, ..) => println!("Next: nothing to do; replay again when there are new readings."),
            (Some(_), Some(rotor), Some(record)) if matches!(fit, ModelFit::BeganOn { .. }) => println!(
                "Next: follow the unbalance from that day on\n  rotor-edge track {} {}",
                shell::path(rotor),
                shell::path(record)
            ),
            (Some(_), Some(rotor), Some(_)) => println!(
                "Next: learn which physical effect is missing, from a run-up of the machine as it is now\n  \
                 rotor-edge improve {} RUNUP.csv -o better.toml",
                shell::path(rotor)
            ),
            (Some(_), ..) if arguments.better.is_some() => {
                println!("Next: look at it, with --report replay.html.")
            }
            (Some(_), ..) => println!(
                "Next: learn which physical effect is missing, from the run-up that was recorded the day after,\n\
                 and see the controller's residual fall\n  \
                 cargo run --release -- improve host-sim/sample/turbine/rotor.toml \
                 host-sim/sample/turbine/runup-day126.csv -o better.toml\n  \
                 cargo run --release -- replay --better better.toml --report replay.html"
            ),
        }
    }

    fn day(&self, row: usize) -> f64 {
        day(self.record, row)
    }
}
