//! `--with` and the `--set` behind each: in the order of the command line.

use clap::error::ErrorKind;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, Error, FromArgMatches};
use rotor_edge_desktop::machine::drawing::ParameterValue;
use rotor_edge_desktop::simulate::StatedEffect;

use crate::command::notation::setting;

const WITH: &str = "with";
const SET: &str = "set";

/// The effects that the machine has beside those of its file.
#[derive(Debug, Clone, Default)]
pub struct Effects(pub Vec<StatedEffect>);

impl FromArgMatches for Effects {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let labels = matches.get_many::<String>(WITH).unwrap_or_default();
        let places = matches.indices_of(WITH).unwrap_or_default();
        let mut effects: Vec<(usize, StatedEffect)> =
            places.zip(labels).map(|(at, label)| (at, StatedEffect::of_label(label))).collect();
        let settings = matches.get_many::<(String, ParameterValue)>(SET).unwrap_or_default();
        for (at, value) in matches.indices_of(SET).unwrap_or_default().zip(settings) {
            let Some((_, effect)) = effects.iter_mut().rfind(|(before, _)| *before < at) else {
                let what = "--set stands before any --with, expected the effect whose parameter it is";
                return Err(Error::raw(ErrorKind::MissingRequiredArgument, format!("{what}\n")));
            };
            effect.parameters.push(value.clone());
        }
        Ok(Self(effects.into_iter().map(|(_, effect)| effect).collect()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Args for Effects {
    fn augment_args(command: Command) -> Command {
        let with = Arg::new(WITH)
            .long(WITH)
            .value_name("EFFECT[@PLACE]")
            .action(ArgAction::Append)
            .help("Add an effect that the rotor file does not have, as in seal@\"disk 3\"; set its parameters with --set");
        let set = Arg::new(SET)
            .long(SET)
            .value_name("NAME=VALUE")
            .action(ArgAction::Append)
            .value_parser(setting)
            .help("A parameter of the --with before it, SI units, as in k=2e7; a phasor as SIZE@DEGREES");
        command.arg(with).arg(set)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}
