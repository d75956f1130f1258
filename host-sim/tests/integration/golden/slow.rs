//! The command lines that take long: samplers, joint estimates, searches over orders of a model.

use super::manifest::Group;
use super::session::check;

#[test]
fn slow_commands_give_their_golden_answers() {
    check(Group::Slow);
}
