//! Outcomes as a table for people.

use std::fmt::Write as _;

use rotor_edge_core::state::{NodeState, Reason, Status};

use super::judge::Verdict;
use super::play::Outcome;

const HEAD: &str = "| scenario | what | machine | pace | worst unbalance told | wrong after | left tracking after | told then | at the end | verdict |\n\
                    |---|---|---|---|---|---|---|---|---|---|\n";

/// One row a scenario; times in readings.
pub fn table(outcomes: &[Outcome]) -> String {
    let mut table = String::from(HEAD);
    outcomes.iter().for_each(|outcome| row(&mut table, outcome));
    table
}

fn row(table: &mut String, o: &Outcome) {
    let readings =
        |s: Option<f64>| s.map_or("–".to_string(), |s| format!("{:.0}", (s / o.pace.period_s).round()));
    let what = format!(
        "{}{}{}",
        o.plan.fault,
        o.plan.course,
        if o.plan.varies_speed { ", speed varies" } else { "" }
    );
    let _ = writeln!(
        table,
        "| {} | {what} | {} | {} | {:.0} %, {:.0}° | {} | {} | {} | {} | {} |",
        o.kind,
        o.machine.name(),
        o.pace.name,
        100.0 * o.worst.size,
        o.worst.angle_deg,
        readings(o.judgement.wrong_s),
        readings(o.judgement.left_s),
        o.judgement.told.map_or("–".to_string(), |status| said(&status)),
        said(&o.judgement.last),
        o.judgement.verdict,
    );
}

/// State and reason, and the cause of a latched flag.
fn said(status: &Status) -> String {
    let mut text = format!("{:?}", status.state).to_lowercase();
    if status.reason != Reason::None {
        let _ = write!(text, ": {:?}", status.reason);
    }
    if status.state == NodeState::Flagged {
        let _ = write!(text, " (cause {:?})", status.cause);
    }
    text
}

/// How many of each verdict, of how many that matter.
pub fn summary(outcomes: &[Outcome]) -> String {
    let number = |verdict: Verdict| outcomes.iter().filter(|o| o.judgement.verdict == verdict).count();
    let matter = outcomes.iter().filter(|o| o.judgement.verdict.matters()).count();
    let verdicts = [
        Verdict::Seen,
        Verdict::Late,
        Verdict::Returned,
        Verdict::Missed,
        Verdict::FalseAlarm,
        Verdict::Harmless,
    ];
    let counts: Vec<String> = verdicts.map(|verdict| format!("{} {verdict}", number(verdict))).to_vec();
    format!("{} scenarios, {matter} of them matter: {}", outcomes.len(), counts.join(", "))
}
