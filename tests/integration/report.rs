//! A report in a real browser: every figure drawn, nothing clipped, nothing fetched, nothing logged.
//!
//! `tests/report/browser` finds or installs Chromium. Set `ROTOR_EDGE_REPORT_DIR` to keep the pages with
//! their screenshots and prints, to be looked at.

mod chromium;

use std::collections::HashSet;
use std::path::PathBuf;

use chromium::{Chromium, Look, Measured};
use nalgebra::Complex;
use rotor_edge::answers::check::CheckAnswer;
use rotor_edge::render::bars::{Bar, bars};
use rotor_edge::render::centreline::centreline;
use rotor_edge::render::check::sections;
use rotor_edge::render::trend::{Trend, trend};
use rotor_edge::render::waterfall::{Stage, waterfall};
use rotor_edge::render::{ComparedModel, Figure, Prediction, Section, comparison_sections, page, verdict};
use rotor_edge::sample;
use rotor_edge::scale::number;
use rotor_edge_desktop::check::{CheckUnbalance, check};
use rotor_edge_desktop::compare::{Adequacy, Comparison};
use rotor_edge_desktop::identify::{PhaseOne, PhaseOneConfig, identify};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::{self, Reading};
use rotor_edge_desktop::model;
use rotor_edge_desktop::rotor_file;
use rotor_edge_tests::{repository, sampled};

/// Bearings and planes that phase I fits.
const FREE_PARAMETERS: usize = 12;
/// Widths that a report is read at, px of the style sheet.
const PHONE_PX: u32 = 390;
const SCREEN_PX: u32 = 1280;
/// Smaller text than this cannot be read.
const LEAST_TEXT_PX: f64 = 10.0;
/// Of text to paper, as WCAG 2.2 asks (success criterion 1.4.3).
const LEAST_CONTRAST: f64 = 4.5;
/// What a page may weigh.
const MOST_BYTES: usize = 1_500_000;

fn fit(rotor: &Rotor, readings: &[Reading]) -> PhaseOne {
    identify(rotor, readings, &PhaseOneConfig { iterations: 5, ..PhaseOneConfig::default() }).unwrap()
}

fn predict(label: &str, found: &PhaseOne, readings: &[Reading]) -> Prediction {
    let elements = model::Model::finite_elements(&found.rotor);
    let row = |r: &Reading| -> Vec<Complex<f64>> {
        let response = elements.response(r.speed_rad_s()).unwrap();
        response.at(&found.unbalance_kg_m).iter().copied().collect()
    };
    Prediction { label: label.into(), predicted_m: readings.iter().map(row).collect() }
}

/// The sample's drawing and its run-up of the day after a ring was replaced.
fn changed_turbine() -> (Rotor, Vec<Reading>, Vec<Reading>) {
    let (rotor, _, before) = sample::load().unwrap();
    let path = repository("host-sim/sample/turbine/runup-day126.csv");
    let after = measurement::read(&path, &rotor).unwrap();
    (rotor, before, after)
}

/// A prediction with what it leaves of the readings.
fn model(rotor: &Rotor, readings: &[Reading], prediction: Prediction) -> ComparedModel {
    let noise = rotor.noise.unwrap();
    let comparison = Comparison::new(rotor, readings, &prediction.predicted_m, &noise, FREE_PARAMETERS);
    ComparedModel { prediction, comparison }
}

/// The run-up of day 126 with the model of day 0 and one fitted anew.
fn run_up_page() -> (Vec<Section>, Comparison) {
    let (rotor, before, after) = changed_turbine();
    let (old, new) = (fit(&rotor, &before), fit(&rotor, &after));
    let models = [predict("model of day 0", &old, &after), predict("model", &new, &after)];
    let models = models.map(|prediction| model(&rotor, &after, prediction));
    (comparison_sections(&rotor, &after, &models), models[1].comparison.clone())
}

/// What is awkward to lay out: a record at one speed, lost readings, several runs, long names, one reading.
fn awkward_page() -> Vec<Section> {
    let (rotor, record, mut run_up) = sample::load().unwrap();
    let found = fit(&rotor, &record[..3]);
    let mut readings: Vec<Reading> = record[..150].to_vec();
    for reading in &mut readings[40..60] {
        reading.probes[2] = None;
    }
    for (row, reading) in run_up.iter_mut().enumerate() {
        reading.run = Some(if row % 2 == 0 { "as found" } else { "trial weight at the coupling" }.into());
        reading.time_d = Some(200.0);
    }
    readings.extend(run_up);
    readings.push(Reading { run: Some("one reading".into()), ..record[0].clone() });
    let models = [
        predict("model", &found, &readings),
        predict("with speed_dependent_stiffness at bearing 15", &found, &readings),
        predict("with seal at disk 3", &found, &readings),
    ];
    let models = models.map(|prediction| model(&rotor, &readings, prediction));
    let mut sections = comparison_sections(&rotor, &readings, &models);
    sections.push(Section { heading: "Others".into(), figures: other_figures(), ..Section::default() });
    sections
}

/// What `check --report` says of a drawing.
fn check_page(rotor: &str) -> Vec<Section> {
    let rotor = rotor_file::read(&repository(rotor)).unwrap();
    let found = check(&rotor, None, CheckUnbalance::Assumed).unwrap();
    sections(&CheckAnswer::from(&found), &found)
}

/// How probabilities change as three effects are added.
fn probabilities() -> Figure {
    let stage = |added: Option<&str>, complete: f64, candidates: &[(&str, f64)]| Stage {
        added: added.map(String::from),
        complete,
        candidates: candidates.iter().map(|(label, p)| ((*label).to_string(), *p)).collect(),
    };
    let [seal, stiffness, bow] = ["seal@disk 3", "speed_dependent_stiffness@bearing 15", "shaft_bow"];
    waterfall(&[
        stage(None, 0.0, &[(seal, 0.6), (stiffness, 0.3), (bow, 0.1)]),
        stage(Some(seal), 0.02, &[(stiffness, 0.5), (bow, 0.48)]),
        stage(Some(stiffness), 0.05, &[(bow, 0.9), ("runout", 0.05)]),
        stage(Some(bow), 0.95, &[("runout", 0.03)]),
    ])
    .unwrap()
}

fn other_figures() -> Vec<Figure> {
    let days = || (0..460).map(f64::from);
    let ratio = |d: f64, after: f64| if d < 125.0 { 0.037 } else { after } + 0.01 * (0.7 * d).sin();
    let drawn = Trend {
        along: "time, days".into(),
        quantity: "residual of the features".into(),
        measured: None,
        curves: vec![
            ("before".into(), days().map(|d| (d, ratio(d, 0.398))).collect()),
            ("with seal at disk 3".into(), days().map(|d| (d, ratio(d, 0.041))).collect()),
        ],
        events: vec![(125.0, "ring replaced".into()), (320.0, "new model on the controller".into())],
        flags: vec![127.0],
        bands: vec![(
            "95 %".into(),
            days().map(|d| [d, 0.8 * ratio(d, 0.398), 1.2 * ratio(d, 0.398)]).collect(),
        )],
        limits: vec![("limit".into(), 1.0 / 3.0)],
        begin: Some("2024-03-01T05:00:00Z".into()),
        ..Trend::default()
    };
    let bar = |label: &str, share: f64| Bar {
        label: label.into(),
        share,
        value: format!("{:.1} %", 100.0 * share),
        emphasised: share > 0.5,
        floor: None,
    };
    let candidates = [
        bar("seal at disk 3", 0.962),
        bar("speed_dependent_stiffness at bearing 15", 0.031),
        bar("shaft_bow", 0.007),
        bar("runout at probe 15X", 0.0),
    ];
    let said = "What the figure says.";
    let spiral = |turns: f64| {
        let at = |k: i32| (0.1 * f64::from(k), turns * f64::from(k) / 40.0);
        (0..200)
            .map(at)
            .map(|(radius_um, angle)| (radius_um * angle.cos(), radius_um * angle.sin()))
            .collect()
    };
    let runs = [
        ("as found: 600 to 11,000 rpm".into(), spiral(1.0)),
        ("trial: 600 to 11,000 rpm".into(), spiral(-0.3)),
    ];
    vec![
        Figure::new("Centreline at 15", said, centreline(&runs)),
        Figure::new("Residual before and after", said, trend(&drawn)),
        Figure::new("Candidates", said, bars(&candidates)),
        probabilities(),
    ]
}

#[test]
fn changed_turbine_misses_physics_and_report_has_every_figure() {
    let (sections, comparison) = run_up_page();
    assert_eq!(comparison.verdict, Adequacy::Misses);
    assert!(!comparison.reversed);
    assert!(verdict(&comparison)[0].contains("misses physics"), "{:?}", verdict(&comparison));
    let ids: Vec<&str> = sections.iter().flat_map(|s| &s.figures).map(|f| f.id.as_str()).collect();
    for probe in ["15x", "15y", "16x", "16y"] {
        for kind in ["bode", "polar", "error-of-probe"] {
            assert!(ids.contains(&format!("{kind}-{probe}-run-day-126").as_str()), "{ids:?}");
        }
    }
    for id in [
        "residual-map-before",
        "residual-map-after",
        "orbits-at-bearing-15",
        "error-of-backward-whirl-at-bearing-16",
    ] {
        assert!(ids.contains(&format!("{id}-run-day-126").as_str()), "{ids:?}");
    }
    assert_eq!(ids.iter().collect::<HashSet<_>>().len(), ids.len(), "ids are unique");
}

#[test]
fn the_turbine_before_the_change_is_adequate() {
    let (rotor, before, _) = changed_turbine();
    let fitted = model(&rotor, &before, predict("model", &fit(&rotor, &before), &before));
    let Comparison { verdict: said, neighbours, .. } = &fitted.comparison;
    assert_eq!(*said, Adequacy::Adequate, "{neighbours:?}");
    let said = verdict(&fitted.comparison);
    assert!(said[0].contains("adequate"), "{}", said[0]);
}

#[test]
fn a_page_names_no_address_to_fetch_from_and_stays_small() {
    let (sections, _) = run_up_page();
    let text = page("Comparison", None, &sections, |_| Vec::new());
    for address in
        ["<script src", "@import", "url(http", "<link rel=\"stylesheet", "<img src", "fetch(\"http"]
    {
        assert!(!text.contains(address), "{address}");
    }
    assert!(text.len() < MOST_BYTES, "{} bytes", text.len());
}

/// Each set of fonts alone, or the machine's own where none is there, on a screen and on a phone; half of the pages are dark.
fn looks() -> Vec<(Look, u32)> {
    let sets =
        ["dejavu", "liberation", "noto"].map(|set| PathBuf::from(format!("/usr/share/fonts/truetype/{set}")));
    assert!(std::env::var_os("CI").is_none() || sets.iter().all(|set| set.is_dir()), "fonts are missing");
    let mut fonts: Vec<Option<PathBuf>> = sets.into_iter().filter(|set| set.is_dir()).map(Some).collect();
    if fonts.is_empty() {
        fonts.push(None);
    }
    let of_set = |(number, set): (usize, Option<PathBuf>)| {
        let mut widths = [(set.clone(), SCREEN_PX), (set, PHONE_PX)];
        // every second one is on a screen and on a phone in turn
        widths.rotate_left(number % 2);
        widths
    };
    let widths = fonts.into_iter().enumerate().flat_map(of_set);
    let is_dark = |at: usize| at / 2 % 2 == 1;
    widths
        .enumerate()
        .map(|(at, (fonts, width_px))| (Look { fonts, is_dark: is_dark(at) }, width_px))
        .collect()
}

#[test]
fn figure_hover_shows_values_and_zoom_changes_range() {
    let Some(browser) = Chromium::find() else { return };
    let text = page("Run-up", None, &run_up_page().0, |_| Vec::new());
    let seen = browser.used(&text, "bode-15x-run-day-126");
    let [speed, amplitude] = [seen.last[0], seen.last[1]];
    assert!(seen.hover.contains(&format!("speed {}", number(speed, 0))), "{seen:?}");
    let four_digits = format!("measured: amplitude {amplitude:.2} µm pk-pk");
    assert!(seen.hover.contains(&four_digits), "{four_digits} is not in {}", seen.hover);
    assert_ne!(seen.before, seen.zoomed, "zooming changes the range");
    assert_eq!(seen.before, seen.reset, "a reset takes it back");
    assert!(seen.without < seen.all, "{seen:?}");
    assert!(seen.said.starts_with("model: speed 1,500 rpm, amplitude"), "{}", seen.said);
    let first = "1,500 rpm".to_string();
    assert!(!seen.unpointed.contains(&first) && seen.pointed.contains(&first), "an orbit follows: {seen:?}");
    assert!(seen.rows > 100, "{} rows", seen.rows);
    let drawn = seen.computed;
    assert!(drawn.orbits >= 3 && drawn.circles >= 1, "measured and two models, and the rim: {drawn:?}");
}

fn assert_whole(name: &str, seen: &Measured, width_px: u32, figures: &[Figure]) {
    assert_eq!(seen.width, f64::from(width_px), "{name}: the browser took another width");
    assert_eq!(seen.fetched, Vec::<String>::new(), "{name}");
    assert!(seen.wider_than_screen_px <= 0.0, "{name} at {width_px}: scrolls sideways");
    assert!(seen.faintest_text >= LEAST_CONTRAST, "{name}: a text of contrast {}", seen.faintest_text);
    assert_eq!(seen.wide_tables, Vec::<String>::new(), "{name} at {width_px}");
    let ids = |ids: Vec<&String>| ids.into_iter().cloned().collect::<Vec<_>>();
    let drawn = ids(seen.figures.iter().map(|f| &f.id).collect());
    assert_eq!(drawn, ids(figures.iter().map(|f| &f.id).collect()), "{name}: every figure, in its order");
    for (f, given) in seen.figures.iter().zip(figures) {
        let at = format!("{name} at {width_px}: {}", f.id);
        assert!(f.width > 250.0 && f.height > 50.0, "{at}: {} × {}", f.width, f.height);
        assert!(f.shapes > 3, "{at}: {} shapes", f.shapes);
        assert!(f.caption.starts_with(&given.title) && f.caption.contains(&given.caption), "{at}");
        assert!(f.smallest_text_px >= LEAST_TEXT_PX, "{at}: text of {} px", f.smallest_text_px);
        assert!(f.faintest_text >= LEAST_CONTRAST, "{at}: a text of contrast {}", f.faintest_text);
        assert!(f.clipped.is_empty(), "{at}: clipped {:?}", f.clipped);
        assert!(f.overlapping.is_empty(), "{at}: overlapping {:?}", f.overlapping);
    }
}

#[test]
fn the_browser_check_sees_an_error_and_a_page_may_not_fetch() {
    let Some(browser) = Chromium::find() else { return };
    let text = page("Broken", None, &[], |_| Vec::new());
    let fetching = text.replace("</body>", "<img src=\"http://example.invalid/x.png\"></body>");
    let logged = browser.console(&fetching);
    assert!(logged.iter().any(|l| l.contains("Content Security Policy")), "{logged:?}");
}

/// What only `tests/all` runs.
mod slow {
    use super::*;

    #[test]
    fn reports_are_whole_in_a_browser_on_a_screen_and_on_a_phone() {
        let Some(browser) = Chromium::find() else { return };
        let pages = [
            ("run-up", run_up_page().0),
            ("awkward", awkward_page()),
            ("check", check_page("host-sim/sample/turbine/rotor.toml")),
            ("check of a train", check_page("tests/reference/check/four_bearing_train.toml")),
        ];
        for (name, sections) in pages {
            let figures: Vec<Figure> = sections.iter().flat_map(|s| s.figures.clone()).collect();
            let words =
                |_: &str| vec![("residual".to_string(), "What the model does not explain. ".repeat(9))];
            let text = page(&format!("Report {name}"), None, &sections, words);
            browser.keep(name, &text, &[SCREEN_PX, PHONE_PX]);
            assert_eq!(browser.console(&text), Vec::<String>::new(), "{name}");
            for (look, width_px) in sampled(2, looks()) {
                let at = format!("{name}, {look:?}");
                assert_whole(&at, &browser.measure(&text, width_px, &look), width_px, &figures);
            }
        }
    }

    #[test]
    fn a_print_holds_what_the_script_has_drawn() {
        let Some(browser) = Chromium::find() else { return };
        let text = page("Run-up", None, &run_up_page().0, |_| Vec::new());
        let bare = text.replace("</style>", ".chart svg { display: none; }</style>");
        let [with, without] = [&text, &bare].map(|page| browser.print_bytes(page));
        assert!(with > 2 * without, "{with} bytes, {without} without figures");
    }
}
