//! Sentences and a section for what data determine besides the verdict.

use rotor_edge_desktop::diagnose::{FittedParameter, ForceGrowth};
use rotor_edge_desktop::identify::Identifiability;
use rotor_edge_desktop::interval::HALF_95;
use rotor_edge_desktop::significance::percent;

use super::{dimensions, text};
use crate::answers::diagnose::FittedAnswer;
use crate::answers::dimensions::DimensionAnswer;
#[cfg(test)]
use crate::answers::findings::REJECTED;
use crate::answers::findings::{DeterminedAnswer, DeterminedPlaneAnswer, NoiseAnswer, UnknownCauseAnswer};
use crate::answers::identify::{DepartureAnswer, IdentifiedCoefficient};
use crate::render::quantity::quantity;
use crate::render::{PageTable, Section};
use crate::scale::three_digits;

/// Label of a cause that no known effect is, among candidates.
pub const OUTSIDE: &str = "a cause outside the list";

/// The noise over what was stated, in one line.
pub fn noise(noise: &NoiseAnswer) -> String {
    let between = if noise.between_runs > 0.0 {
        format!(", {:.2} % of the response from run to run", 100.0 * noise.between_runs)
    } else {
        String::new()
    };
    format!(
        "Noise: {:.2} times the stated noise, correlation between readings {:.2}{between}",
        noise.scale, noise.correlation
    )
}

/// Each plane, one line each, with its 95 % interval where the model has one; or why it has none.
pub fn planes(determined: &DeterminedAnswer) -> Vec<String> {
    let planes = determined.planes.as_deref().unwrap_or_default();
    let mut lines: Vec<String> = Vec::new();
    lines.extend(determined.why.filter(|_| !determined.model_adequate).map(String::from));
    lines.extend(planes.iter().map(|p| plane(p, determined.model_adequate)));
    let Some([condition]) = determined.condition else { return lines };
    if planes.len() > 1 {
        lines.push(format!(
            "Condition number of the planes: {condition:.1} (above 10, the split between planes is unreliable)"
        ));
    }
    lines
}

fn plane(p: &DeterminedPlaneAnswer, model_adequate: bool) -> String {
    let [low, high] = p.interval_95;
    // two digits of the half-width, or three of a size without one
    let (digits, of) = if model_adequate { (2, 0.5 * (high - low)) } else { (3, p.unbalance_g_mm) };
    let decimals = (digits - 1 - of.max(f64::MIN_POSITIVE).log10().floor() as i32).clamp(0, 3) as usize;
    let head = format!("Unbalance of {}: {:.decimals$} g·mm", p.name, p.unbalance_g_mm);
    if !model_adequate {
        return format!("{head} at {:.0}°", p.angle_deg);
    }
    let angle = if p.angle_95_deg < 90.0 {
        format!("{:.0}° ± {:.0}°", p.angle_deg, p.angle_95_deg)
    } else {
        "any angle".to_string()
    };
    format!("{head} ({low:.decimals$} to {high:.decimals$} with 95 %) at {angle}")
}

const BEARING_COLUMNS: [&str; 5] = ["bearing", "parameter", "fitted", "start", "from"];

/// Bearing coefficients, film and table parameters, one row each.
fn bearing_rows(bearings: &[IdentifiedCoefficient], model_adequate: bool) -> Vec<[String; 5]> {
    let row = |p: &IdentifiedCoefficient| {
        let interval = p.interval_95.filter(|_| model_adequate);
        [
            p.bearing.clone(),
            p.symbol.clone(),
            quantity(p.value, interval, p.unit),
            quantity(p.start, None, p.unit),
            origin(p.origin).into(),
        ]
    };
    bearings.iter().map(row).collect()
}

fn origin(identified: Identifiability) -> &'static str {
    match identified {
        Identifiability::FromData => "the data",
        Identifiability::StayedAtStart => "the start",
        Identifiability::AtBound => "the bound",
    }
}

/// What the table of bearings shows, and how sure it is.
fn bearing_caption(model_adequate: bool) -> &'static str {
    match model_adequate {
        true => "Bearings as fitted (± is a 95 % half-width)",
        false => "Bearings as fitted (no 95 % interval, because the model does not describe these data)",
    }
}

/// Bearings as fitted under their heading; nothing where the data decide nothing about them.
pub fn bearings_text(bearings: &[IdentifiedCoefficient], model_adequate: bool) -> String {
    if bearings.is_empty() {
        return String::new();
    }
    let rows = bearing_rows(bearings, model_adequate);
    format!("\n{}\n{}", bearing_caption(model_adequate), text::table(&BEARING_COLUMNS, &rows))
}

/// The same as a table of a page.
pub fn bearings_table(bearings: &[IdentifiedCoefficient], model_adequate: bool) -> Option<PageTable> {
    (!bearings.is_empty()).then(|| PageTable {
        caption: bearing_caption(model_adequate).into(),
        columns: BEARING_COLUMNS.map(String::from).to_vec(),
        rows: bearing_rows(bearings, model_adequate).into_iter().map(Vec::from).collect(),
    })
}

/// Bearings and drawing as fitted.
pub fn fitted_text(
    bearings: &[IdentifiedCoefficient],
    drawing: &[DimensionAnswer],
    model_adequate: bool,
) -> String {
    bearings_text(bearings, model_adequate) + &dimensions::in_text(drawing, model_adequate)
}

/// The same as tables of a page.
pub fn fitted_tables(
    bearings: &[IdentifiedCoefficient],
    drawing: &[DimensionAnswer],
    model_adequate: bool,
) -> Vec<PageTable> {
    let tables = [bearings_table(bearings, model_adequate), dimensions::in_page(drawing, model_adequate)];
    tables.into_iter().flatten().collect()
}

/// Numbers of bearings that are not as stated, a sentence each.
pub fn not_as_stated(departures: &[DepartureAnswer]) -> impl Iterator<Item = String> {
    departures.iter().map(|d| {
        let found = quantity(d.value, Some(d.interval_95), d.unit);
        let stated = quantity(d.stated, Some(d.stated_interval_95), d.unit);
        let worn = match d.symbol == "clearance" && d.value > d.stated {
            true => "; a worn bearing has a larger clearance",
            false => "",
        };
        format!(
            "Bearing {} is not as stated: {} {found} by the data alone instead of {stated}{worn}.",
            d.bearing, d.symbol
        )
    })
}

/// Least probability with which the place of an unknown cause is stated: more probable than all others together.
const PLACED: f64 = 0.5;

/// A cause outside the list, in sentences.
pub fn unknown(cause: &UnknownCauseAnswer) -> String {
    let growth = growth(cause).map_or_else(String::new, |growth| format!(" {growth}"));
    format!(
        "An unknown effect is missing ({} probable). {}{growth} Possible causes: {}.",
        percent(cause.probability),
        nature(cause, true),
        cause.looks_like
    )
}

/// Whether its place is more probable than all others together.
pub fn is_placed(cause: &UnknownCauseAnswer) -> bool {
    cause.place_probability > PLACED
}

/// What it acts like, and where if that is `placed` in the same sentence.
pub fn nature(cause: &UnknownCauseAnswer, placed: bool) -> String {
    let probable = percent(cause.place_probability);
    match (cause.acts_like, &cause.drawing) {
        (_, Some(drawing)) if is_placed(cause) => {
            format!(
                "The drawing deviates by more than its tolerance ({probable} probable), most in {drawing}."
            )
        }
        (_, Some(_)) => "It acts like an error of the drawing; which one cannot be determined.".into(),
        ("bearings", None) => acts(cause, "bearings whose coefficients change with speed", placed),
        ("stiffness", None) => acts(cause, "a support that the model lacks", placed),
        _ => acts(cause, "a force", placed),
    }
}

/// Where an unknown cause acts, where that is known.
pub fn place(cause: &UnknownCauseAnswer) -> String {
    match is_placed(cause) {
        true => format!(
            "{:.3} m from the left end ({} probable)",
            cause.position_m,
            percent(cause.place_probability)
        ),
        false => "its position cannot be determined".into(),
    }
}

fn acts(cause: &UnknownCauseAnswer, as_what: &str, placed: bool) -> String {
    let place = match (placed, is_placed(cause)) {
        (false, _) => String::new(),
        (true, true) => format!(", most likely {}", place(cause)),
        (true, false) => format!("; {}", place(cause)),
    };
    format!("It acts like {as_what}{place}.")
}

/// How the force of an unknown cause grows with speed; none of an error of the drawing.
pub fn growth(cause: &UnknownCauseAnswer) -> Option<String> {
    if cause.drawing.is_some() {
        return None;
    }
    let (force_n, speed_rpm) = (cause.force_n.unwrap_or(f64::NAN), cause.speed_rpm.unwrap_or(f64::NAN));
    let force_n = three_digits(force_n);
    let growth = match cause.force_growth {
        Some(ForceGrowth::Constant) => format!("is about the same at every speed, {force_n} N at most"),
        Some(ForceGrowth::Squared) => {
            format!("grows with the square of speed, to {force_n} N at {speed_rpm:.0} rpm")
        }
        Some(ForceGrowth::Peaked) | None => format!("is largest at {speed_rpm:.0} rpm, {force_n} N"),
    };
    let whirl = cause.whirl.unwrap_or("forward and backward");
    Some(format!("The force {growth}, in {whirl} whirl."))
}

/// Fitted parameters, one line each, with their 95 % intervals where the model with them describes the data.
pub fn parameters(fitted: &FittedAnswer) -> Vec<String> {
    let fits = fitted.model_fits;
    let line = |p: &FittedParameter| match p.value.as_slice() {
        [re, im] => {
            let (size, angle) = (re.hypot(*im), im.atan2(*re).to_degrees());
            let half = p.sd.filter(|sd| fits && sd.is_finite() && *sd > 0.0).map(|sd| HALF_95 * sd);
            let interval = half.map(|half| [(size - half).max(0.0), size + half]);
            // a length that turns with the shaft is an amplitude
            let size = quantity(size, interval, p.unit).replace("µm", "µm 0-pk");
            format!("{} = {size} at {angle:.1}°", p.name)
        }
        other => {
            let value = other.first().copied().unwrap_or(f64::NAN);
            let interval = p.interval_95.first().copied().filter(|_| fits);
            format!("{} = {}", p.name, quantity(value, interval, p.unit))
        }
    };
    let mut lines: Vec<String> = fitted.parameters.iter().map(line).collect();
    if !fits && !lines.is_empty() {
        lines.push("no 95 % interval, because the model with this effect does not describe the data".into());
    }
    lines.extend(fitted.disqualified.clone());
    lines
}

/// All of it as a section of a page, with tables of what was fitted.
pub fn section(
    found: &NoiseAnswer,
    determined: &DeterminedAnswer,
    tables: Vec<PageTable>,
    cause: Option<&UnknownCauseAnswer>,
) -> Section {
    let mut paragraphs: Vec<String> = cause.map(unknown).into_iter().collect();
    paragraphs.push(sentence(&noise(found)));
    paragraphs.extend(planes(determined).iter().map(|line| sentence(line)));
    let heading = match determined.model_adequate {
        true => "What the data determine",
        false => "Fitted values of a rejected model",
    };
    Section { heading: heading.into(), paragraphs, tables, ..Section::default() }
}

/// A line as a sentence of its own.
fn sentence(line: &str) -> String {
    if line.ends_with('.') { line.into() } else { format!("{line}.") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn determined(model_adequate: bool) -> DeterminedAnswer {
        let plane = DeterminedPlaneAnswer {
            name: "A".into(),
            unbalance_g_mm: 1070.0,
            angle_deg: 30.0,
            interval_95: [1049.0, 1091.0],
            angle_95_deg: 2.0,
            region: [21.0, 21.0, 0.0],
            determined: true,
        };
        DeterminedAnswer {
            planes: Some(vec![plane]),
            condition: Some([1.0]),
            why: (!model_adequate).then_some(REJECTED),
            model_adequate,
        }
    }

    fn stiffness() -> IdentifiedCoefficient {
        IdentifiedCoefficient {
            bearing: "DE".into(),
            symbol: "factor on k_xx".into(),
            unit: "N/m",
            value: 1.6e8,
            start: 1.76e8,
            relative_sd: Some(0.02),
            interval_95: Some([1.54e8, 1.66e8]),
            identified: true,
            origin: Identifiability::FromData,
        }
    }

    const NOISE: NoiseAnswer = NoiseAnswer { scale: 1.0, correlation: 0.0, between_runs: 0.0 };

    #[test]
    fn rejected_model_has_no_interval_and_says_why() {
        let page = section(&NOISE, &determined(false), fitted_tables(&[stiffness()], &[], false), None);
        let shown = format!("{page:?}{}", bearings_text(&[stiffness()], false));
        for interval in ["1049", "1091", "±", "154", "166"] {
            assert!(!shown.contains(interval), "{interval}: {shown}");
        }
        assert!(shown.contains("does not describe these data, so no 95 % interval is stated"), "{shown}");
        assert!(!shown.contains("for sure") && shown.contains("Unbalance of A: 1070 g·mm at 30°"), "{shown}");
    }

    #[test]
    fn adequate_model_states_bearings_and_planes_with_95_percent() {
        let page = format!(
            "{:?}",
            section(&NOISE, &determined(true), fitted_tables(&[stiffness()], &[], true), None)
        );
        assert!(page.contains("1070 g·mm (1049 to 1091 with 95 %) at 30° ± 2°"), "{page}");
        let mut small = determined(true);
        small.planes.iter_mut().flatten().for_each(|p| {
            p.unbalance_g_mm = 3.006;
            p.interval_95 = [2.994, 3.018];
        });
        assert!(planes(&small)[0].contains("3.006 g·mm (2.994 to 3.018 with 95 %)"), "{:?}", planes(&small));
        let text = bearings_text(&[stiffness()], true);
        assert!(
            text.contains("DE") && text.contains("factor on k_xx  160.0 ± 6.0 MN/m  176.0 MN/m  the data"),
            "{text}"
        );
    }

    fn cause(place_probability: f64, growth: ForceGrowth) -> UnknownCauseAnswer {
        UnknownCauseAnswer {
            acts_like: "force",
            drawing: None,
            position_m: 0.65,
            place_probability,
            probability: 1.0,
            growth: Some("the same at every speed"),
            force_growth: Some(growth),
            whirl: Some("forward"),
            forward_share: Some(0.9),
            speed_rpm: Some(3600.0),
            force_n: Some(12.34),
            looks_like: "a bent shaft",
        }
    }

    #[test]
    fn unknown_cause_without_place_does_not_claim_one() {
        let said = unknown(&cause(0.002, ForceGrowth::Constant));
        let expected = "An unknown effect is missing (more than 99.9 % probable). It acts like a force; its position cannot be \
                        determined. The force is about the same at every speed, 12.3 N at most, in forward whirl. Possible \
                        causes: a bent shaft.";
        assert_eq!(said, expected);
        assert!(!said.contains("3600"), "constant, so largest nowhere: {said}");
    }

    #[test]
    fn unknown_cause_with_place_states_it_and_the_growth() {
        let said = unknown(&cause(0.57, ForceGrowth::Squared));
        assert!(said.contains("most likely 0.650 m from the left end (57.0 % probable)"), "{said}");
        assert!(said.contains("grows with the square of speed, to 12.3 N at 3600 rpm"), "{said}");
    }

    #[test]
    fn effect_parameters_of_rejected_model_have_no_interval() {
        let parameter = |value: Vec<f64>| FittedParameter::new("k", "N/m", value, 1e6);
        let fitted = |model_fits| FittedAnswer {
            effect: "seal",
            at: None,
            label: "seal".into(),
            parameters: vec![parameter(vec![17e6]), parameter(vec![3e6, 4e6])],
            model_fits,
            disqualified: None,
            what: "",
            inspect: "",
        };
        assert_eq!(parameters(&fitted(true)), ["k = 17.0 ± 2.0 MN/m", "k = 5.0 ± 2.0 MN/m at 53.1°"]);
        let without = parameters(&fitted(false)).join("; ");
        assert!(!without.contains('±') && without.contains("no 95 % interval"), "{without}");
    }
}
