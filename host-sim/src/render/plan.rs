//! Text, story and sections of an answer of `plan`.

use maud::{Markup, html};

use super::quantity::about;
use super::text::table;
use super::{Figure, PageTable, Section, Story};
use crate::answers::plan::{
    DecisionAnswer, NextMeasurement, PlanAnswer, PlannedEffect, PlannedParameter, PlannedPlane, PlannedSize,
};
use crate::scale::{number, three_digits};

/// Information from which on a further measurement is worth being named, bits.
pub const WORTH_MAKING: f64 = 0.1;
/// Probability from which on a measurement is said to decide: more often than not.
const DECIDES: f64 = 0.5;
/// Further measurements that a terminal shows.
const LISTED: usize = 8;
/// Candidates that a line names.
const NAMED: usize = 3;
/// Changes of the vibration that part the colours of the map.
const CHANGES: [f64; 2] = [0.03, 0.1];

/// The whole answer on a terminal, with the first `top` effects.
pub fn text(answer: &PlanAnswer, top: usize) -> String {
    let mut text = format!("{}\n", verdict(answer));
    answer.remarks.iter().for_each(|remark| text += &format!("  {remark}\n"));
    text +=
        &format!("\nSmallest effects found, {} probable; change of the vibration by them\n", chance(answer));
    let rows: Vec<[String; 3]> = answer.effects.iter().take(top).map(row).collect();
    text += &table(&["effect", "smallest", "change"], &rows);
    if answer.effects.len() > top {
        text += &format!("  and {} more\n", answer.effects.len() - top);
    }
    let confused = confusions(answer, top);
    if !confused.is_empty() {
        text += "\nAt that size a diagnosis would not tell them from\n";
        confused.iter().for_each(|line| text += &format!("  {line}\n"));
    }
    text += &format!("\nUnbalance (95 %)\n{}", table(&PLANE_COLUMNS, &plane_rows(answer)));
    if !answer.next.is_empty() {
        let rows: Vec<[String; 4]> = answer.next.iter().take(LISTED).map(next_row).collect();
        text += &format!("\nFurther measurements, most helpful first\n{}", table(&NEXT_COLUMNS, &rows));
    }
    text
}

const PLANE_COLUMNS: [&str; 4] = ["plane", "unbalance, g·mm", "±, g·mm", "angle, ±°"];
const NEXT_COLUMNS: [&str; 4] = ["measurement", "gain, bits", "more found", "± becomes"];

/// One sentence each on effects, unbalance and what helps most.
fn verdict(answer: &PlanAnswer) -> String {
    let runs = match answer.runs.len() {
        0 | 1 => String::new(),
        more => format!(" in {more} runs"),
    };
    let readings = format!("With these {} readings{runs}", answer.readings);
    let effects = match &answer.saturated {
        Some(why) => format!("{readings} no effect can be found: {why}."),
        None => format!(
            "{readings}, {} of {} effects would be found at sizes that matter, {} of them by name alone.",
            answer.found,
            answer.effects.len(),
            answer.named_alone.min(answer.found)
        ),
    };
    let helps = match answer.next.first().filter(|next| next.gain >= WORTH_MAKING) {
        Some(best) => format!("What helps most: {} ({:.1} bits).", best.measurement, best.gain),
        None => "No further measurement that was tried helps.".into(),
    };
    let decides = answer.between.as_ref().map_or_else(String::new, |d| decision(d) + " ");
    format!("{decides}{effects} {} {helps}", unbalance(answer))
}

/// A sentence on what decides between the effects of `--between`.
pub fn decision(d: &DecisionAnswer) -> String {
    let effects = match &d.effects[..] {
        [others @ .., last] if !others.is_empty() => format!("{} and {last}", others.join(", ")),
        all => all.join(", "),
    };
    let percent = |p: f64| format!("{:.0} %", 100.0 * p);
    let Some(measurement) = &d.measurement else {
        return format!("No further measurement could be tried that decides between {effects}.");
    };
    let how_sure =
        format!("{} probable, {} without it", percent(d.probability), percent(d.probability_without));
    if d.probability < DECIDES {
        return format!(
            "No further measurement that was tried probably decides between {effects}. Best: {measurement} ({how_sure})."
        );
    }
    format!("What decides between {effects}: {measurement} ({how_sure}).")
}

fn unbalance(answer: &PlanAnswer) -> String {
    let one = |p: &PlannedPlane| match p.accuracy {
        Some(half) => format!("± {} g·mm in plane {}", three_digits(half), p.name),
        None => format!("not at all in plane {}", p.name),
    };
    let all: Vec<String> = answer.planes.iter().map(one).collect();
    format!("The unbalance is known to {} (95 %).", all.join(" and "))
}

/// The numbers of a size, the first alone where a line has no room for many; a single one needs no name.
fn size(size: &PlannedSize, all: bool) -> String {
    let named = size.parameters.len() > 1;
    let one = |p: &PlannedParameter| {
        let value = about(p.value, p.unit);
        if named || p.unit.is_empty() { format!("{} {value}", p.name) } else { value }
    };
    let shown = if all { size.parameters.len() } else { 1 };
    size.parameters.iter().take(shown).map(one).collect::<Vec<_>>().join(", ")
}

fn smallest(e: &PlannedEffect, all: bool) -> String {
    match &e.smallest {
        Some(found) if e.has_size => size(found, all),
        Some(_) => "found".into(),
        None => "not found".into(),
    }
}

fn change(e: &PlannedEffect) -> String {
    let shown = e.smallest.as_ref().unwrap_or(&e.relevant);
    let share = 100.0 * shown.change;
    match e.smallest {
        Some(_) => format!("{} %", if share < 1.0 { format!("{share:.2}") } else { three_digits(share) }),
        None => "–".into(),
    }
}

fn row(e: &PlannedEffect) -> [String; 3] {
    [e.label.clone(), smallest(e, false), change(e)]
}

/// What each effect is confused with at its smallest size, a line each; the first few.
fn confusions(answer: &PlanAnswer, top: usize) -> Vec<String> {
    let confused =
        answer.effects.iter().take(top).filter(|e| e.smallest.is_some() && !e.confused_with.is_empty());
    let line = |e: &PlannedEffect| {
        let names: Vec<&str> = e.confused_with.iter().take(NAMED).map(|i| i.effect.as_str()).collect();
        let more = match e.confused_with.len() - names.len() {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        format!("{}: {}{more}", e.label, names.join(", "))
    };
    confused.map(line).collect()
}

fn plane_rows(answer: &PlanAnswer) -> Vec<[String; 4]> {
    let row = |p: &PlannedPlane| {
        [
            p.name.clone(),
            three_digits(p.unbalance_g_mm),
            p.accuracy.map_or("unknown".into(), three_digits),
            three_digits(p.angle_95_deg),
        ]
    };
    answer.planes.iter().map(row).collect()
}

fn next_row(m: &NextMeasurement) -> [String; 4] {
    let ratios: Vec<String> = m.accuracy_ratio.iter().map(|r| format!("{:.0} %", 100.0 * r)).collect();
    [m.measurement.clone(), format!("{:.1}", m.gain), format!("{:+}", m.found_more), ratios.join(", ")]
}

fn chance(answer: &PlanAnswer) -> String {
    format!("{:.0} %", 100.0 * answer.probability)
}

/// The first screen of the page.
pub fn story(answer: &PlanAnswer, next: (String, Option<String>)) -> Story {
    let unseen: Vec<&str> =
        answer.effects.iter().filter(|e| e.smallest.is_none()).map(|e| e.label.as_str()).collect();
    let not_found = match unseen.len() {
        0 => "Every effect is found if it is large enough.".into(),
        _ => format!("Not found at any size: {}.", unseen.join(", ")),
    };
    let most = answer.next.first().filter(|m| m.gain >= WORTH_MAKING);
    let helps = match (&answer.between, most) {
        (Some(between), _) => decision(between),
        (None, Some(m)) if m.found_more > 0 => {
            format!("{}: {:.1} bits, {} effects more are found.", m.measurement, m.gain, m.found_more)
        }
        (None, Some(m)) => format!("{}: {:.1} bits.", m.measurement, m.gain),
        (None, None) => "No further measurement that was tried helps.".into(),
    };
    Story {
        verdict: verdict(answer),
        answers: vec![
            ("The unbalance", unbalance(answer)),
            ("What stays hidden", not_found),
            ("What helps most", super::text::capital(&helps)),
            (
                "How sure",
                "By the model of the file and its noise, without any measurement: bearings that differ from the file change it."
                    .into(),
            ),
        ],
        next,
        beside: vec![map(answer)],
        below: Vec::new(),
    }
}

/// The page below the story.
pub fn sections(answer: &PlanAnswer) -> Vec<Section> {
    let columns = |names: &[&str]| names.iter().map(|n| (*n).to_string()).collect::<Vec<_>>();
    let effects = PageTable {
        caption: format!("Every effect at every place; found with {} probability", chance(answer)),
        columns: columns(&[
            "effect",
            "smallest found",
            "change of the vibration",
            "smallest named alone",
            "confused with",
        ]),
        rows: answer.effects.iter().map(effect_cells).collect(),
    };
    let planes = PageTable {
        caption: "Unbalance as these measurements would know it, 95 % half-widths".into(),
        columns: columns(&PLANE_COLUMNS),
        rows: plane_rows(answer).into_iter().map(Vec::from).collect(),
    };
    let next = PageTable {
        caption: "Further measurements: expected information, effects found and half-widths with them".into(),
        columns: columns(&[
            "measurement",
            "gain, bits",
            "more found",
            "more named alone",
            "half-width, of that without",
        ]),
        rows: answer.next.iter().map(next_cells).collect(),
    };
    let assumed = format!(
        "{} readings from {} to {} rpm; noise {:.2} % of the amplitude and {} µm 0-pk.",
        answer.readings,
        number(answer.range_rpm[0], 0),
        number(answer.range_rpm[1], 0),
        100.0 * answer.noise.relative,
        three_digits(answer.noise.floor_um)
    );
    let section = |heading: &str, paragraphs: Vec<String>, table: PageTable| Section {
        heading: heading.into(),
        paragraphs,
        tables: if table.rows.is_empty() { Vec::new() } else { vec![table] },
        figures: Vec::new(),
    };
    vec![
        section("Effects", std::iter::once(assumed).chain(answer.remarks.iter().cloned()).collect(), effects),
        section("Unbalance", Vec::new(), planes),
        section("Further measurements", Vec::new(), next),
    ]
}

fn effect_cells(e: &PlannedEffect) -> Vec<String> {
    let alone = e
        .smallest_alone
        .as_ref()
        .map_or("–".into(), |s| if e.has_size { size(s, true) } else { "yes".into() });
    let confused: Vec<&str> = e.confused_with.iter().map(|i| i.effect.as_str()).collect();
    vec![e.label.clone(), smallest(e, true), change(e), alone, confused.join(", ")]
}

fn next_cells(m: &NextMeasurement) -> Vec<String> {
    let [measurement, gain, found, ratios] = next_row(m);
    vec![measurement, gain, found, format!("{:+}", m.named_alone_more), ratios]
}

/// Effects over places: the change of the vibration from which on each is found.
fn map(answer: &PlanAnswer) -> Figure {
    Figure::new(
        "Smallest effects found",
        "Each effect at each place, with the change of the vibration from which on it is found; a dash where it is not found at \
         any size.",
        cells(answer),
    )
}

fn cells(answer: &PlanAnswer) -> Markup {
    let mut effects: Vec<&str> = Vec::new();
    for e in &answer.effects {
        if !effects.contains(&e.effect) {
            effects.push(e.effect);
        }
    }
    let class = |e: &PlannedEffect| {
        let change = e.smallest.as_ref()?.change;
        Some(format!("class-{}", CHANGES.iter().filter(|limit| change > **limit).count()))
    };
    html! {
        div class="table" {
            table {
                thead { tr { th scope="col" { "effect" } th scope="col" { "places" } } }
                tbody {
                    @for effect in effects {
                        tr {
                            td { (effect) }
                            td {
                                ul class="legend classes" {
                                    @for e in answer.effects.iter().filter(|e| e.effect == effect) {
                                        li {
                                            i class=[class(e)] {}
                                            (e.at.as_deref().unwrap_or("machine")) " " (change(e))
                                        }
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answers::plan::PlannedNoise;

    fn effect(change: f64, has_size: bool) -> PlannedEffect {
        let size = PlannedSize {
            parameters: vec![PlannedParameter { name: "m", unit: "m", value: 1.234e-6 }],
            change,
            found: 0.9,
            alone: 0.5,
        };
        PlannedEffect {
            effect: "shaft_bow",
            at: None,
            smallest: Some(size.clone()),
            smallest_alone: None,
            relevant: size,
            found: true,
            confused_with: Vec::new(),
            imitations: Vec::new(),
            has_size,
            label: "shaft_bow".into(),
        }
    }

    fn answer() -> PlanAnswer {
        PlanAnswer {
            machine: "fan".into(),
            readings: 51,
            runs: Vec::new(),
            range_rpm: [1000.0, 6000.0],
            probability: 0.9,
            unbalance: Vec::new(),
            noise: PlannedNoise { relative: 0.02, floor_um: 0.1 },
            saturated: None,
            found: 1,
            named_alone: 0,
            effects: vec![effect(0.021, true)],
            planes: vec![PlannedPlane {
                name: "1".into(),
                unbalance_g_mm: 300.0,
                accuracy: Some(12.34),
                angle_95_deg: 3.0,
            }],
            next: Vec::new(),
            between: None,
            remarks: Vec::new(),
        }
    }

    #[test]
    fn measurement_that_decides_is_the_first_sentence() {
        let with = |probability: f64, measurement: Option<&str>| {
            let between = DecisionAnswer {
                effects: vec!["rub@left".into(), "rub@right".into()],
                measurement: measurement.map(Into::into),
                probability,
                probability_without: 0.18,
            };
            text(&PlanAnswer { between: Some(between), ..answer() }, 10)
        };
        for (probability, measurement, expected) in [
            (
                0.81,
                Some("a slow roll"),
                "What decides between rub@left and rub@right: a slow roll (81 % probable, 18 % without it). With",
            ),
            (
                0.3,
                Some("a slow roll"),
                "No further measurement that was tried probably decides between rub@left and rub@right. Best: a slow roll (30 % ",
            ),
            (0.0, None, "No further measurement could be tried that decides"),
        ] {
            let text = with(probability, measurement);
            assert!(text.starts_with(expected), "{text}");
        }
    }

    #[test]
    fn answer_comes_first_and_fits_a_terminal() {
        let text = text(&answer(), 10);
        assert!(
            text.starts_with("With these 51 readings, 1 of 1 effects would be found at sizes that matter"),
            "{text}"
        );
        assert!(text.contains("± 12.3 g·mm in plane 1 (95 %)") && text.contains("1.23 µm"), "{text}");
        assert!(text.contains("No further measurement that was tried helps."), "{text}");
    }

    #[test]
    fn effect_without_size_is_found_or_not() {
        assert_eq!(smallest(&effect(0.5, false), false), "found");
        let none = PlannedEffect { smallest: None, ..effect(0.5, true) };
        assert_eq!((smallest(&none, false).as_str(), change(&none).as_str()), ("not found", "–"));
    }

    #[test]
    fn readings_that_bearings_use_up_say_why_nothing_is_found() {
        let full = PlanAnswer { saturated: Some("4 readings hold 8 numbers".into()), ..answer() };
        assert!(verdict(&full).contains("no effect can be found: 4 readings hold 8 numbers."));
    }
}
