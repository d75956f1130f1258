//! Whether what a command will write can be written, before it begins its work.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::ArgMatches;
use rotor_edge_desktop::whole_file::check_target;

/// Arguments that name a file to write; every other path is read.
const WRITTEN: [&str; 7] =
    ["output", "report", "csv", "truth", "write_mapping", "write_coefficients", "write_rotor"];

/// Checks all paths of a command line.
///
/// # Errors
/// If a file cannot be written where it should be, would replace one that is read, unless that is `forced`, or one that
/// is written as well.
pub fn check(arguments: &ArgMatches, forced: bool) -> Result<()> {
    let (written, read): (Vec<_>, Vec<_>) =
        paths(arguments).into_iter().partition(|(name, _)| WRITTEN.contains(&name.as_str()));
    for (i, (name, target)) in written.iter().enumerate() {
        check_target(target)?;
        let is_it = |other: &&(String, PathBuf)| same(target, &other.1);
        if let Some((other, _)) = written[..i].iter().find(is_it) {
            let [other, name] = [other, name].map(|id| id.replace('_', "-"));
            bail!("{}: --{other} and --{name} name one file, expected two", target.display());
        }
        if !forced && read.iter().any(|other| is_it(&other)) {
            bail!(
                "{}: is read and would be overwritten; name another file to write, or add --force",
                target.display()
            );
        }
    }
    Ok(())
}

fn paths(arguments: &ArgMatches) -> Vec<(String, PathBuf)> {
    let of = |id: &clap::Id| {
        let values = arguments.try_get_many::<PathBuf>(id.as_str()).ok().flatten();
        let name = id.as_str().to_string();
        values.into_iter().flatten().map(move |path| (name.clone(), path.clone())).collect::<Vec<_>>()
    };
    arguments.ids().flat_map(of).collect()
}

/// One file, whatever it is called.
fn same(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    }
}
