//! The command lines that do the same.

use std::path::Path;

use rotor_edge::command::shell;

use crate::session::Session;
use crate::session::step::Change;

/// One line a step, the diagnosis of the result at last; what no command does stands there as a comment.
pub fn lines(session: &Session) -> Vec<String> {
    let taken = session.branches[session.branch].taken();
    let (mut lines, mut rotor) = (Vec::new(), session.files.rotor.name.clone());
    let mut data = session.files.data.name.clone();
    if !session.mask.is_empty() {
        lines.push("# readings are left out: save those that are kept as kept.csv".into());
        data = "kept.csv".into();
    }
    // the readings that are saved hold no runout any more
    let slow_roll = session.files.slow_roll.as_ref().filter(|_| session.mask.is_empty());
    let slow_roll = slow_roll.map(|s| format!(" --slow-roll {}", shell::word(s.name()))).unwrap_or_default();
    let path = |name: &str| shell::path(Path::new(name));
    for (k, step) in taken.iter().enumerate() {
        let output = if k + 1 == taken.len() { "better.toml".into() } else { format!("better-{k}.toml") };
        match &step.change {
            Change::Given => continue,
            Change::Added { .. } => lines.push(format!(
                "rotor-edge add {} {} --data {}{slow_roll} -o {output}",
                path(&rotor),
                shell::word(&step.label()),
                path(&data)
            )),
            Change::Fitted { .. } => {
                lines.push(format!(
                    "# {}: no command holds parameters; save the model as {output}",
                    step.label()
                ));
            }
        }
        rotor = output;
    }
    lines.push(format!("rotor-edge diagnose {} {}{slow_roll}", path(&rotor), path(&data)));
    lines
}
