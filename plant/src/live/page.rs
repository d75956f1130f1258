//! The page.

use maud::{DOCTYPE, Markup, html};

use super::glance::Glance;

/// Its look.
pub const STYLE: &str = include_str!("page.css");
/// Replaces the table by what it is told.
pub const SCRIPT: &str = include_str!("page.js");

/// The whole page, as it is at this moment.
pub fn whole(all: &[Glance]) -> String {
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                link rel="icon" href="data:,";
                link rel="stylesheet" href="page.css";
                title { "Monitors" }
            }
            body {
                h1 { "Monitors" }
                p id="link" role="status" { "The page as it was loaded." }
                main id="monitors" { (table(all)) }
                script src="page.js" {}
            }
        }
    };
    markup.into_string()
}

/// All monitors, the worst first, and how many are in each state.
pub fn table(all: &[Glance]) -> Markup {
    let mut states: Vec<(&str, usize)> = Vec::new();
    for glance in all {
        match states.iter_mut().find(|(state, _)| *state == glance.state_now) {
            Some((_, number)) => *number += 1,
            None => states.push((&glance.state_now, 1)),
        }
    }
    html! {
        @if all.is_empty() { p { "Nothing was heard of any monitor yet." } }
        ul class="states" { @for (state, number) in states { li class=(state) { b { (number) } " " (said(state)) } } }
        table {
            thead { tr { @for name in ["plant", "bus", "node", "state", "residual", "heard", ""] { th scope="col" { (name) } } } }
            tbody {
                @for glance in all {
                    tr class=(glance.state_now) {
                        td { (glance.newest.plant) } td { (glance.newest.bus) } td { (glance.newest.node) }
                        td class="state" { (said(&glance.state_now)) }
                        td { (glance.newest.ratio.map_or("–".into(), |ratio| format!("{:.1} %", 100.0 * ratio))) }
                        td { (glance.age_s.map_or("never".into(), ago)) }
                        td { (glance.why) }
                    }
                }
            }
        }
    }
}

fn said(state: &str) -> String {
    state.replace('_', " ")
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
    }

    #[test]
    fn a_plant_without_monitors_says_so() {
        assert!(whole(&[]).contains("Nothing was heard of any monitor yet."));
    }
}
