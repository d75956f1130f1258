//! The command lines that together take less than a minute.

use super::manifest::{Group, read};
use super::session::{check, recorded_names};

#[test]
fn quick_commands_give_their_golden_answers() {
    check(Group::Quick);
}

#[test]
fn answers_and_commands_have_the_same_names() {
    let mut names: Vec<String> = read().into_iter().map(|command| command.name).collect();
    names.sort();
    assert_eq!(recorded_names(), names, "run tests/golden/accept, or remove the folder");
}
