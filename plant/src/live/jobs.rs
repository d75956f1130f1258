//! Jobs of the fleet: how many, what each cost and what it says.

use anyhow::Result;
use maud::{Markup, html};
use rusqlite::Connection;

use super::page::{path, said};
use crate::fleet::machines::path_of;
use crate::fleet::queue::{Listed, newest, numbers};

/// Jobs that a page has room for, the newest.
const MOST_LISTED: u32 = 200;

/// How many are in each state, and the newest.
///
/// # Errors
/// If the store cannot be read.
pub fn live(connection: &Connection) -> Result<Markup> {
    let numbers = numbers(connection)?;
    let jobs = newest(connection, None, MOST_LISTED)?;
    let all: u32 = numbers.iter().map(|(_, number)| number).sum();
    Ok(html! {
        @if jobs.is_empty() { p { "No job was requested yet. Request one with: rotor-edge-plant fleet track STORE" } }
        ul class="states" { @for (state, number) in &numbers { li class=(state) { b { (number) } " " (said(state)) } } }
        @if all as usize > jobs.len() { p { "The newest " (jobs.len()) " of " (all) "; rotor-edge-plant fleet status lists all." } }
        @if !jobs.is_empty() { (table(&jobs)) }
    })
}

pub fn table(jobs: &[Listed]) -> Markup {
    html! {
        table class="jobs" {
            thead { tr { @for name in ["command", "machine", "state", "time", "answer", ""] { th scope="col" { (name) } } } }
            tbody {
                @for job in jobs {
                    @let machine = path(&job.source.plant, &job.source.bus, job.source.node);
                    tr class=(job.state) {
                        td { (job.command) }
                        td { a href=(machine) { (path_of(&job.source)) } }
                        td class="state" { (job.state) @if job.tries > 1 { ", " (job.tries) " tries" } }
                        td { (job.seconds.map_or("–".into(), |s| format!("{s:.1} s"))) }
                        td { (job.in_a_word()) }
                        td { @if job.has_report { a href={ (machine) "/report/" (job.command) } { "report" } } }
                    }
                }
            }
        }
    }
}
