//! Horizontal bars: anything ranked, such as the probabilities of candidates.

use maud::html;

#[derive(Debug, Clone, PartialEq)]
pub struct Bar {
    pub label: String,
    /// Its length, of the longest possible 1.
    pub share: f64,
    /// The value as it is written at the right, as in `97 %`.
    pub value: String,
    /// Drawn in full colour; others are faint.
    pub emphasised: bool,
    /// What of it is not to be had away, of the longest possible 1; hatched.
    pub floor: Option<f64>,
}

/// Bars in the order given, each under its own label so that long names fit a phone.
pub fn bars(bars: &[Bar]) -> maud::Markup {
    html! {
        ul class="bars" {
            @for bar in bars {
                li class=[bar.emphasised.then_some("emphasised")] {
                    span { (bar.label) }
                    span { (bar.value) }
                    div {
                        div style=(width(bar.share)) {}
                        @if let Some(floor) = bar.floor { i style=(width(floor)) {} }
                    }
                }
            }
        }
    }
}

fn width(share: f64) -> String {
    format!("width:{:.2}%", 100.0 * share.clamp(0.0, 1.0))
}
