//! What a reader sees first: the verdict, five questions with their answers, and the machine.

use maud::{Markup, html};

use super::document::Figure;
use super::text::capital;

/// The first screen of a page.
#[derive(Debug, Clone, PartialEq)]
pub struct Story {
    /// One sentence with its number.
    pub verdict: String,
    /// Questions and their answers, each a line or two.
    pub answers: Vec<(&'static str, String)>,
    /// What to do, in words, and the command that does it.
    pub next: (String, Option<String>),
    /// The machine, and what stands under it beside the answers.
    pub beside: Vec<Figure>,
    /// What stands under all of that, two figures in a row.
    pub below: Vec<Figure>,
}

impl Story {
    pub(super) fn markup(&self) -> Markup {
        html! {
            section class="story" {
                div {
                    p class="verdict" { (self.verdict) }
                    dl {
                        @for (question, answer) in &self.answers { dt { (question) } dd { (answer) } }
                        dt { "What now" }
                        dd {
                            (capital(&self.next.0))
                            @if let Some(command) = &self.next.1 { pre tabindex="0" { code { (command) } } }
                        }
                    }
                }
                div { @for figure in &self.beside { (figure.markup()) } }
            }
            @if !self.below.is_empty() {
                div class="figures" { @for figure in &self.below { (figure.markup()) } }
            }
        }
    }
}
