//! What pages have in common, and the one of all monitors.

use maud::{DOCTYPE, Markup, html};

use super::alarm::Acknowledged;
use super::glance::Glance;
use crate::item::plain_word;

pub const STYLE: &str = include_str!("page.css");
/// Replaces what is live by what it is told.
pub const SCRIPT: &str = include_str!("page.js");

/// A whole page as it is at this moment: what `events` tells anew, and what stays `beside` it.
pub fn whole(title: &str, events: &str, live: &Markup, beside: &Markup) -> String {
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                link rel="icon" href="data:,";
                link rel="stylesheet" href="/page.css";
                title { (title) }
            }
            body data-events=(events) {
                nav { a href="/" { "Machines" } " " a href="/jobs" { "Jobs" } }
                h1 { (title) }
                p id="link" role="status" { "This page shows the state at the time it was loaded." }
                main id="live" { (live) }
                (beside)
                script src="/page.js" {}
            }
        }
    };
    markup.into_string()
}

/// All monitors, the worst first, and how many are in each state.
pub fn monitors(all: &[Glance], now_us: i64) -> Markup {
    let mut states: Vec<(&str, usize)> = Vec::new();
    for glance in all {
        match states.iter_mut().find(|(state, _)| *state == glance.state_now) {
            Some((_, number)) => *number += 1,
            None => states.push((&glance.state_now, 1)),
        }
    }
    html! {
        @if all.is_empty() { p { "No monitor has sent a message yet." } }
        ul class="states" { @for (state, number) in states { li class=(state) { b { (number) } " " (said(state)) } } }
        ul class="tiles" { @for glance in all { (tile(glance, now_us)) } }
    }
}

/// One machine by its own name: state, age, residual, unbalance and its last day.
fn tile(glance: &Glance, now_us: i64) -> Markup {
    let newest = &glance.newest;
    let known = &glance.known;
    html! {
        li class=(glance.state_now) {
            h2 { a href=(path(&newest.plant, &newest.bus, newest.node)) { (named(glance)) } }
            p class="place" { (newest.plant) ", " (newest.bus) ", node " (newest.node) }
            p {
                b class="state" { (said(&glance.state_now)) } ", "
                (glance.age_s.map_or("no message yet".into(), |age_s| format!("last message {}", ago(age_s))))
            }
            p {
                "Unbalance: " (known.recent.in_words(&known.names)) "."
                @if let Some(ratio) = newest.ratio { " Residual: " (format!("{:.1} %", 100.0 * ratio)) "." }
            }
            (known.recent.drawing())
            @if !glance.why.is_empty() || glance.acknowledged.is_some() {
                p class="why" { (glance.why) (seen(glance.acknowledged.as_ref(), now_us)) }
            }
        }
    }
}

/// The name of a machine, or its monitor where nobody stated the machine.
pub fn named(glance: &Glance) -> String {
    glance.machine.clone().unwrap_or_else(|| format!("Monitor {}", glance.newest.node))
}

/// Where the page of a monitor is.
pub fn path(plant: &str, bus: &str, node: u8) -> String {
    format!("/machine/{}/{}/{node}", plain_word(plant), plain_word(bus))
}

pub fn seen(acknowledged: Option<&Acknowledged>, now_us: i64) -> Markup {
    html! {
        @if let Some(seen) = acknowledged {
            " " span class="seen" { "seen by " (seen.who) ", " (ago_us(now_us, seen.time_us)) }
        }
    }
}

/// A word of the protocol as people say it.
pub fn said(word: &str) -> String {
    word.replace('_', " ")
}

/// How long ago that was.
pub fn ago_us(now_us: i64, then_us: i64) -> String {
    ago((now_us - then_us).max(0) as f64 * 1e-6)
}

fn ago(age_s: f64) -> String {
    match age_s {
        s if s < 60.0 => format!("{s:.0} s ago"),
        s if s < 7_200.0 => format!("{:.0} min ago", s / 60.0),
        s if s < 172_800.0 => format!("{:.0} h ago", s / 3_600.0),
        s => format!("{:.0} days ago", s / 86_400.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ages_are_told_in_the_unit_that_fits() {
        let told = [0.4, 59.0, 61.0, 7_300.0, 180_000.0].map(ago);
        assert_eq!(told, ["0 s ago", "59 s ago", "1 min ago", "2 h ago", "2 days ago"]);
        assert_eq!(ago_us(5, 9), "0 s ago", "a clock that is ahead");
    }

    #[test]
    fn a_plant_without_monitors_says_so() {
        assert!(monitors(&[], 0).into_string().contains("No monitor has sent a message yet."));
    }
}
