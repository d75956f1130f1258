//! The page on a screen and a tablet, light and dark, by keyboard and for a screen reader.

use serde_json::json;

use crate::browser::Browser;
use crate::client;
use crate::program::Studio;

/// Controls that have no name for a screen reader.
const NAMELESS: &str = "[...document.querySelectorAll('button, input, select, summary')].filter((node) => \
     !node.textContent.trim() && !node.getAttribute('aria-label') && !node.labels?.length).map((node) => node.outerHTML)";
/// What lies beyond the right edge of the window.
const TOO_WIDE: &str = "[...document.querySelectorAll('#desk *, .bar *, #answer *')].filter((node) => \
     node.getBoundingClientRect().right > innerWidth + 1 && !node.closest('svg, .chart, .unseen, .said'))\
     .map((node) => node.outerHTML.slice(0, 120))";

#[test]
fn page_fits_screen_and_tablet_in_light_and_dark() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::start::<&str>(folder.path(), &[]);
    studio.changed("open", &client::sample());
    studio.changed("preview", &json!({ "effect": "seal", "at": "disk 3" }));
    let Some(mut browser) = Browser::open(&studio.address, [1280, 800]) else { return };
    browser.wait_for_verdict("missing");
    for (size, scheme, name) in [
        ([1280, 800], "light", "screen-light"),
        ([1280, 800], "dark", "screen-dark"),
        ([1024, 768], "light", "tablet-light"),
        ([1024, 768], "dark", "tablet-dark"),
    ] {
        browser.resize(size);
        browser.prefer(scheme);
        browser.wait("document.querySelectorAll('#figures .chart svg').length === 4");
        browser.keep(&format!("studio-{name}"));
        assert_eq!(browser.value(TOO_WIDE), json!([]), "{name}");
        assert_eq!(
            browser.value("document.documentElement.scrollWidth <= innerWidth"),
            json!(true),
            "{name}"
        );
        assert_eq!(
            browser.value("document.documentElement.scrollHeight <= innerHeight"),
            json!(true),
            "{name}"
        );
    }
    assert_eq!(browser.value(NAMELESS), json!([]));
    assert_eq!(browser.value("document.getElementById('said').ariaLive"), json!("polite"));
    let fetched = "performance.getEntriesByType('resource').filter((r) => !r.name.startsWith(location.origin)).map((r) => r.name)";
    assert_eq!(browser.value(fetched), json!([]));
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
}

#[test]
fn effect_is_added_by_keyboard_alone() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::start::<&str>(folder.path(), &[]);
    let Some(mut browser) = Browser::open(&studio.address, [1280, 800]) else { return };
    let go_to = |browser: &mut Browser, selector: &str| {
        for _ in 0..60 {
            browser.press("Tab", 9);
            if browser.value(&format!("document.activeElement.matches({selector:?})")) == json!(true) {
                return browser.press("Enter", 13);
            }
        }
        panic!("no way to {selector} by Tab");
    };
    go_to(&mut browser, "#open-sample");
    browser.wait_for_verdict("missing");
    go_to(&mut browser, "#places [data-place='disk 3']");
    go_to(&mut browser, "#effects [data-effect='seal']");
    browser.wait("document.querySelector('#preview #add')");
    // the preview stands above the list of effects
    browser.value("document.getElementById('add').focus()");
    browser.press("Enter", 13);
    browser.wait_for_verdict("adequate");
}
