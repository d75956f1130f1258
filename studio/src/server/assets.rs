//! The page, its scripts and its styles, all of them in the program.

use axum::Router;
use axum::http::header;
use axum::response::{Html, IntoResponse};
use axum::routing::get;
use rotor_edge::render::page::{SCRIPTS, STYLE};

use crate::workbench::Workbench;

const PAGE: &str = include_str!("../page/page.html");
/// The page's own scripts by name.
pub const MODULES: [(&str, &str); 6] = [
    ("/studio.js", include_str!("../page/studio.js")),
    ("/server.js", include_str!("../page/server.js")),
    ("/figures.js", include_str!("../page/figures.js")),
    ("/places.js", include_str!("../page/places.js")),
    ("/sliders.js", include_str!("../page/sliders.js")),
    ("/sections.js", include_str!("../page/sections.js")),
];
pub const OWN_STYLE: &str = include_str!("../page/studio.css");

/// Everything that is the same for every session, below a path.
pub fn routes(below: &str) -> Router<Workbench> {
    let path = |own: &str| format!("{below}{own}");
    let script =
        |text: &'static str| get(move || async move { typed("text/javascript; charset=utf-8", text) });
    let style = |text: &'static str| get(move || async move { typed("text/css; charset=utf-8", text) });
    let mut routes = Router::new()
        .route(&path("/"), get(|| async { Html(PAGE) }))
        .route(&path("/library.js"), script(SCRIPTS[0]))
        .route(&path("/drawing.js"), script(SCRIPTS[1]))
        .route(&path("/report.css"), style(STYLE))
        .route(&path("/studio.css"), style(OWN_STYLE));
    for (own, text) in MODULES {
        routes = routes.route(&path(own), script(text));
    }
    routes
}

fn typed(kind: &'static str, text: &'static str) -> impl IntoResponse {
    ([(header::CONTENT_TYPE, kind)], text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn page_with_everything_it_loads_is_below_1_5_mb() {
        let own: usize = MODULES.iter().map(|(_, text)| text.len()).sum();
        let all = PAGE.len() + own + OWN_STYLE.len() + STYLE.len() + SCRIPTS[0].len() + SCRIPTS[1].len();
        assert!(all < 1_500_000, "{all} bytes");
    }

    #[test]
    fn page_loads_nothing_from_elsewhere() {
        for text in [PAGE, OWN_STYLE].into_iter().chain(MODULES.map(|(_, text)| text)) {
            let foreign = text.match_indices("://").map(|(at, _)| &text[at.saturating_sub(6)..]);
            let foreign: Vec<&str> = foreign.filter(|found| !found.contains("www.w3.org")).collect();
            assert!(foreign.is_empty(), "{foreign:?}");
        }
    }
}
