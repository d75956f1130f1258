//! Sentences of an answer of `check`, for terminal and page.

use rotor_edge_desktop::check::modes::STRONG_LOG_DECREMENT;
use rotor_edge_desktop::units::SAME_SPEED;

use super::tables::{damped_critical, resonates};
use crate::answers::check::{CheckAnswer, StabilityThreshold, TrialResponse};
use crate::scale::{number, three_digits};

/// Speeds that one sentence lists at most.
const LISTED: usize = 3;

/// The answer in one sentence: stability, critical speeds, separation margins.
pub fn headline(answer: &CheckAnswer) -> String {
    let mut parts = vec![stability(answer)];
    if answer.range_rpm[1] > 0.0 {
        parts.push(critical_speeds(answer));
        parts.extend(margins(answer));
    }
    let sentence = parts.join("; ");
    format!("{sentence}.")
}

fn speed_range(answer: &CheckAnswer) -> String {
    let [from, to] = answer.range_rpm.map(|s| number(s, 0));
    match answer.range_rpm {
        [0.0, 0.0] => "at rest".into(),
        [one, other] if one == other => format!("at {to} rpm"),
        _ => format!("from {from} to {to} rpm"),
    }
}

/// Without a full stop.
fn stability(answer: &CheckAnswer) -> String {
    let over = speed_range(answer);
    let onset = answer.stability_threshold.as_ref();
    match (answer.stability, onset) {
        ("unstable", Some(t)) if answer.range_rpm[0] == answer.range_rpm[1] => {
            format!("Unstable {over}: {}", motion(t))
        }
        ("unstable", Some(t)) if t.from_the_first => {
            format!(
                "Unstable from {} rpm, the slowest speed looked at: {}",
                number(t.speed_rpm, 0),
                motion(t)
            )
        }
        ("unstable", Some(t)) => format!("Unstable from {} rpm: {}", number(t.speed_rpm, 0), motion(t)),
        (_, Some(t)) => {
            format!("Stable {over}, unstable from {} rpm: {}", number(t.speed_rpm, 0), motion(t))
        }
        ("stable", None) => format!("Stable {over}"),
        (_, None) if answer.undamped => "Undamped: no amplitude, stability not judged".into(),
        (_, None) => format!("No mode grows {over}, but some are undamped: their stability is not judged"),
    }
}

fn motion(t: &StabilityThreshold) -> String {
    if t.frequency_rpm >= 0.5 {
        format!("the shaft whirls at {} rpm", number(t.frequency_rpm, 0))
    } else {
        "the shaft moves away without oscillation".into()
    }
}

fn critical_speeds(answer: &CheckAnswer) -> String {
    let count = answer.damped_critical_speeds.iter().filter(|m| resonates(m)).count();
    let place = match answer.running_range_rpm {
        Some([from, to]) if [from, to] == answer.range_rpm && from < to => "in the running range".to_string(),
        _ => speed_range(answer),
    };
    match count {
        0 => format!("no critical speed {place}"),
        1 => format!("1 critical speed {place}"),
        _ => format!("{count} critical speeds {place}"),
    }
}

/// Critical speeds of one mode, as different computations have it, differ by less than this, relative.
pub const SAME_CRITICAL: f64 = SAME_SPEED;

/// A separation margin.
pub struct Margin {
    /// Of the peak, rpm.
    speed_rpm: f64,
    /// Of its mode, rpm.
    pub critical_rpm: f64,
    margin_percent: f64,
    needed_percent: f64,
    pub is_kept: bool,
}

/// Margins of all peaks and of critical speeds without amplitude, the worst of each critical speed first.
fn all_margins(answer: &CheckAnswer) -> Vec<Margin> {
    let peaks = answer.unbalance.iter().flat_map(|t| &t.probes).flat_map(|p| &p.peaks);
    let of_peaks = peaks.filter_map(|p| {
        Some(Margin {
            speed_rpm: p.speed_rpm,
            critical_rpm: p.critical_speed_rpm?,
            margin_percent: p.margin_percent?,
            needed_percent: p.needed_percent?,
            is_kept: p.margin_kept?,
        })
    });
    let without = answer.critical_speeds_without_amplitude.iter().filter_map(|c| {
        Some(Margin {
            speed_rpm: c.speed_rpm,
            critical_rpm: c.speed_rpm,
            margin_percent: c.margin_percent?,
            needed_percent: c.needed_percent?,
            is_kept: c.margin_kept?,
        })
    });
    let mut all: Vec<Margin> = of_peaks.chain(without).collect();
    let lacking = |m: &Margin| m.needed_percent - m.margin_percent;
    all.sort_by(|a, b| a.critical_rpm.total_cmp(&b.critical_rpm).then(lacking(b).total_cmp(&lacking(a))));
    all
}

/// The worst margin of each critical speed.
pub fn margins_by_critical(answer: &CheckAnswer) -> Vec<Margin> {
    let mut all = all_margins(answer);
    all.dedup_by(|next, first| next.critical_rpm <= first.critical_rpm * (1.0 + SAME_CRITICAL));
    all
}

/// A margin beside its critical speed in a figure.
pub fn margin_in_a_word(margin: &Margin) -> String {
    let needed = number(margin.needed_percent, 0);
    match margin.margin_percent < 0.0 {
        true => format!("inside, {needed} % needed"),
        false => format!("{} %, {needed} % needed", number(margin.margin_percent, 0)),
    }
}

/// The worst failing margin of each critical speed.
fn failing(answer: &CheckAnswer) -> Vec<Margin> {
    let mut failing: Vec<Margin> = all_margins(answer).into_iter().filter(|m| !m.is_kept).collect();
    failing.dedup_by(|next, first| next.critical_rpm <= first.critical_rpm * (1.0 + SAME_SPEED));
    failing
}

/// One sentence for each critical speed whose separation margin fails.
pub fn failing_margins(answer: &CheckAnswer) -> Vec<String> {
    let [from, to] = answer.running_range_rpm.unwrap_or(answer.range_rpm);
    let of = |m: Margin| {
        let [speed, needed] = [m.speed_rpm, m.needed_percent].map(|v| number(v, 0));
        if (from..=to).contains(&m.speed_rpm) {
            return format!("{speed} rpm is inside the running range; {needed} % outside is needed.");
        }
        let side = if m.speed_rpm < from { "below" } else { "above" };
        let margin = number(m.margin_percent, 0);
        format!("{speed} rpm is {margin} % {side} the running range; {needed} % is needed.")
    };
    failing(answer).into_iter().map(of).collect()
}

/// Whether the separation margins are kept, without a full stop; `None` without a running range.
pub fn margins(answer: &CheckAnswer) -> Option<String> {
    answer.running_range_rpm?;
    let speeds: Vec<String> = failing(answer).iter().map(|m| number(m.speed_rpm, 0)).collect();
    if all_margins(answer).is_empty() {
        return (answer.stability != "unstable").then(|| "no peak needs a separation margin".into());
    }
    let (last, before) = match &speeds[..] {
        [] => return Some("every separation margin is kept".into()),
        [only] => return Some(format!("the separation margin fails at {only} rpm")),
        [before @ .., last] if before.len() <= LISTED => (last.clone(), before),
        more => (format!("{} more speeds", more.len() - LISTED), &more[..LISTED]),
    };
    let unit = if before.len() + 1 == speeds.len() { " rpm" } else { "" };
    Some(format!("the separation margin fails at {} and {last}{unit}", before.join(", ")))
}

/// That some peaks are no resonances, if so.
pub fn between_resonances(response: &TrialResponse) -> Option<String> {
    let mut peaks = response.probes.iter().flat_map(|p| &p.peaks);
    peaks.any(|p| p.critical_speed_rpm.is_none()).then(|| {
        "A peak without a critical speed stands between resonances: it has no amplification factor and no margin.".into()
    })
}

/// Why there is no undamped critical speed, if there is none.
pub fn no_critical_speed(answer: &CheckAnswer) -> Option<&'static str> {
    answer.critical_speeds_rpm.is_empty().then_some(
        "None: without damping and without the antisymmetric part of their stiffness, the bearings do not hold the shaft. \
         The damped modes apply.",
    )
}

/// Why there is no damped critical speed, if there is none.
pub fn no_damped_critical_speed(answer: &CheckAnswer) -> Option<String> {
    let none = !damped_critical(answer).into_iter().any(resonates);
    none.then(|| match answer.range_rpm[1] {
        0.0 => "None: the shaft is at rest.".into(),
        to => format!("None up to {} rpm.", number(1.3 * to, 0)),
    })
}

/// Strongly damped modes that the speed meets, if there are any.
pub fn strongly_damped_critical(answer: &CheckAnswer) -> Option<String> {
    let all = damped_critical(answer);
    let met: Vec<String> = (all.into_iter().filter(|m| !resonates(m)))
        .map(|m| format!("{} rpm ({})", number(m.speed_rpm, 0), three_digits(m.log_decrement)))
        .collect();
    (!met.is_empty()).then(|| {
        format!("Strongly damped modes without a resonance peak (log decrement): {}.", met.join(", "))
    })
}

/// What a table of strongly damped modes lists.
pub fn strongly_damped_caption() -> String {
    format!("log decrement above {STRONG_LOG_DECREMENT:.2}: no resonance peak")
}

/// The unbalance that a response is to.
pub fn unbalance(answer: &CheckAnswer, response: &TrialResponse) -> String {
    if response.basis == "rotor_file" {
        let of = |p: &crate::answers::shared::PlaneUnbalance| {
            format!("{} {} g·mm at {}°", p.name, three_digits(p.unbalance_g_mm), number(p.angle_deg, 0))
        };
        let planes: Vec<String> = response.planes.iter().map(of).collect();
        return format!("The unbalance that the rotor file states: {}.", planes.join(", "));
    }
    let phase = match response.trial {
        "static" => "in phase",
        _ => "the two sides of the centre of gravity against each other",
    };
    let permitted = match response.basis {
        "balance_grade" => "the balance grade of the rotor file permits".to_string(),
        _ => format!("API 617 permits at {} rpm", number(answer.range_rpm[1], 0)),
    };
    format!(
        "{} g·mm at each plane, {phase}: together twice what {permitted}.",
        three_digits(response.each_g_mm())
    )
}

/// Why a response has no peaks or lacks some, if so.
pub fn missing_peaks(answer: &CheckAnswer, response: &TrialResponse) -> Option<String> {
    let has_peaks = response.probes.iter().any(|p| !p.peaks.is_empty());
    let onset = answer.stability_threshold.as_ref();
    if answer.undamped {
        return Some("Undamped: the peaks have no amplitude and no amplification factor.".into());
    }
    if let Some(t) = onset {
        let from = number(t.speed_rpm, 0);
        return Some(format!(
            "The machine is unstable from {from} rpm: there it has no steady response, so no peaks."
        ));
    }
    if !answer.critical_speeds_without_amplitude.is_empty() {
        return Some(
            "Peaks at critical speeds without damping have no amplitude; the table \"Without amplitude\" lists them.".into(),
        );
    }
    (!has_peaks).then(|| format!("No peak up to {} rpm.", number(1.3 * answer.range_rpm[1], 0)))
}
