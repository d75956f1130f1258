//! The words of the trade in headers of columns, in the languages that exports have.

use super::phrases::PHRASES;
use super::unit::{Angle, Detection, Sense, SpeedUnit, TimeUnit, Unit};

/// What a word of a header says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Word {
    /// The part at running speed.
    Synchronous,
    /// The vibration of another order, or of all together.
    OtherVibration,
    Amplitude,
    Phase,
    Cos,
    Sin,
    Real,
    Imaginary,
    Gap,
    Speed,
    Run,
    Time,
    Date,
    Clock,
    /// The probe's name is in the cells.
    Point,
    /// The machine's name is in the cells.
    Machine,
    Unit(Unit),
    Detection(Detection),
    Sense(Sense),
    Angle(Angle),
    SpeedUnit(SpeedUnit),
    TimeUnit(TimeUnit),
    /// A velocity or an acceleration, whatever its unit.
    Derivative,
    /// What a plot has along its axes, as exports of plots call their columns.
    XAxis,
    YAxis,
    /// Whether a value is valid.
    Status,
    Filler,
}

/// `16X` is a probe at bearing 16, `2X` the second harmonic, unless there is a `2Y`.
const HIGHEST_ORDER: f64 = 10.0;

/// What one word says; nothing if it is none of the trade's.
fn word(lower: &str) -> Option<Word> {
    Some(match lower {
        "1x" | "x1" | "1n" | "synchronous" | "synch" => Word::Synchronous,
        "direct" | "overall" | "gesamt" | "summe" | "nx" | "smax" | "subsynchronous" | "unbalance" => {
            Word::OtherVibration
        }
        "amp" | "ampl" | "amplitude" | "amplituden" | "magnitude" | "mag" | "betrag" | "amplitud"
        | "schwingweg" => Word::Amplitude,
        "phase" | "phs" | "phas" | "ph" | "phasenwinkel" | "phasenlage" | "fase" | "phi" | "φ" | "winkel"
        | "angle" => Word::Phase,
        "cos" | "cosine" | "kosinus" => Word::Cos,
        "sin" | "sine" | "sinus" => Word::Sin,
        "real" | "re" | "realteil" => Word::Real,
        "imag" | "im" | "imaginary" | "imaginärteil" | "quad" | "quadrature" => Word::Imaginary,
        "gap" | "spalt" | "spaltspannung" | "bias" => Word::Gap,
        "speed"
        | "drehzahl"
        | "velocidad"
        | "vitesse"
        | "tacho"
        | "n"
        | "omega"
        | "ω"
        | "winkelgeschwindigkeit"
        | "drehfrequenz" => Word::Speed,
        "run" | "lauf" | "versuch" | "messlauf" | "condition" => Word::Run,
        "time" | "timestamp" | "datetime" | "elapsed" | "zeit" | "zeitstempel" | "zeitpunkt"
        | "zeitmarke" | "hora" | "temps" => Word::Time,
        "date" | "datum" | "fecha" => Word::Date,
        "uhrzeit" | "clock" | "tod" => Word::Clock,
        "point" | "channel" | "probe" | "sensor" | "messstelle" | "kanal" | "messpunkt" | "transducer"
        | "tag" => Word::Point,
        "machine" | "asset" | "maschine" | "train" | "anlage" | "equipment" => Word::Machine,
        "pp" | "pkpk" | "ss" | "cc" => Word::Detection(Detection::PeakToPeak),
        "0p" | "op" | "0pk" | "zp" | "peak" | "pk" => Word::Detection(Detection::ZeroToPeak),
        "rms" | "eff" | "effektiv" | "effektivwert" => Word::Detection(Detection::Rms),
        "lag" | "nacheilend" | "nacheilung" | "retard" | "lagging" => Word::Sense(Sense::Lag),
        "lead" | "voreilend" | "voreilung" | "avance" | "leading" => Word::Sense(Sense::Lead),
        "deg" | "degree" | "degrees" | "°" | "grad" | "degs" | "grados" => Word::Angle(Angle::Degrees),
        "rad" | "radian" | "radians" | "radiant" => Word::Angle(Angle::Radians),
        "velocity"
        | "vel"
        | "acceleration"
        | "accel"
        | "acc"
        | "geschwindigkeit"
        | "beschleunigung"
        | "schwinggeschwindigkeit"
        | "schwingbeschleunigung"
        | "schnelle" => Word::Derivative,
        "x_axis" => Word::XAxis,
        "y_axis" => Word::YAxis,
        "status" | "validity" | "quality" | "qualität" => Word::Status,
        "vibration" | "vib" | "value" | "wert" | "messwert" | "avg" | "average" | "mean" | "of"
        | "filtered" | "vector" | "displacement" | "component" | "name" | "id" | "no" | "unit" | "units"
        | "measured" | "shaft" | "der" | "the" | "und" | "and" => Word::Filler,
        _ => return unit(lower),
    })
}

/// The unit that one word is.
fn unit(lower: &str) -> Option<Word> {
    Some(match lower {
        "um" | "micron" | "microns" | "micrometer" | "mikrometer" => Word::Unit(Unit::Micrometre),
        "mil" | "mils" => Word::Unit(Unit::Mil),
        "mm" => Word::Unit(Unit::Millimetre),
        "m" => Word::Unit(Unit::Metre),
        "inch" | "in" => Word::Unit(Unit::Inch),
        "mv" => Word::Unit(Unit::Millivolt),
        "v" | "volt" | "volts" | "vdc" => Word::Unit(Unit::Volt),
        "rpm" => Word::SpeedUnit(SpeedUnit::Rpm),
        "cpm" | "upm" => Word::SpeedUnit(SpeedUnit::Rpm),
        "krpm" | "kcpm" => Word::SpeedUnit(SpeedUnit::Krpm),
        "hz" => Word::SpeedUnit(SpeedUnit::Hz),
        "per_second" | "rps" => Word::SpeedUnit(SpeedUnit::PerSecond),
        "radians_per_second" => Word::SpeedUnit(SpeedUnit::RadS),
        "ms" | "msec" | "msecs" | "millisecond" | "milliseconds" | "millisekunden" => {
            Word::TimeUnit(TimeUnit::Milliseconds)
        }
        "microseconds" | "microsecond" | "usec" | "usecs" => Word::TimeUnit(TimeUnit::Microseconds),
        "nanoseconds" | "nanosecond" | "nsec" | "nsecs" => Word::TimeUnit(TimeUnit::Nanoseconds),
        "s" | "sec" | "secs" | "second" | "seconds" | "sekunden" => Word::TimeUnit(TimeUnit::Seconds),
        "min" | "mins" | "minute" | "minutes" | "minuten" => Word::TimeUnit(TimeUnit::Minutes),
        "h" | "hr" | "hrs" | "hour" | "hours" | "stunden" => Word::TimeUnit(TimeUnit::Hours),
        "d" | "day" | "days" | "tage" => Word::TimeUnit(TimeUnit::Days),
        "excel" => Word::TimeUnit(TimeUnit::Excel),
        "epoch" | "unix" | "epoch_s" => Word::TimeUnit(TimeUnit::EpochSeconds),
        "epoch_ms" => Word::TimeUnit(TimeUnit::EpochMilliseconds),
        "epoch_us" => Word::TimeUnit(TimeUnit::EpochMicroseconds),
        "epoch_ns" => Word::TimeUnit(TimeUnit::EpochNanoseconds),
        "um_per_s" => Word::Unit(Unit::MicrometrePerSecond),
        "mm_per_s" => Word::Unit(Unit::MillimetrePerSecond),
        "mil_per_s" => Word::Unit(Unit::MilPerSecond),
        "in_per_s" | "ips" => Word::Unit(Unit::InchPerSecond),
        "m_per_s" => Word::Unit(Unit::MetrePerSecond),
        "mm_per_s2" => Word::Unit(Unit::MillimetrePerSecondSquared),
        "in_per_s2" => Word::Unit(Unit::InchPerSecondSquared),
        "m_per_s2" => Word::Unit(Unit::MetrePerSecondSquared),
        "g" | "gs" => Word::Unit(Unit::G),
        _ => return None,
    })
}

/// A part of a header: what it says, or a word that is a name.
#[derive(Debug, Clone, PartialEq)]
pub enum Part {
    Says(Word),
    Name(String),
}

/// Whether a word is an order such as `2X`, and which.
pub fn order(word: &str) -> Option<f64> {
    let digits = word.strip_suffix(['x', 'X'])?;
    digits.parse().ok().filter(|_| digits.starts_with(|c: char| c.is_ascii_digit()))
}

/// The words of a text. `is_probe` says which words are names of probes although they look like an order or a unit.
pub fn parts(text: &str, is_probe: impl Fn(&str) -> bool) -> Vec<Part> {
    let mut text = text.to_string();
    for microseconds in ["µs", "μs"] {
        replace_whole(&mut text, microseconds, "microseconds");
    }
    let mut plain: String = text.chars().map(|c| if "µμ".contains(c) { 'u' } else { c }).collect();
    let mut lower = plain.to_lowercase();
    for (phrase, stands_for) in PHRASES {
        if lower.contains(phrase) {
            replace_whole(&mut plain, phrase, stands_for);
            lower = plain.to_lowercase();
        }
    }
    let between = |c: char| !(c.is_alphanumeric() || "°.".contains(c));
    let mut parts = Vec::new();
    // an underscore is part of words that phrases and units stand for, and else apart
    let whole = |token: &str| word(&token.to_lowercase()).is_some() || is_probe(token);
    let tokens = plain
        .split(|c| between(c) && c != '_')
        .flat_map(|token| if whole(token) { vec![token] } else { token.split('_').collect() });
    for token in tokens.map(|t| t.trim_matches('.')).filter(|t| !t.is_empty()) {
        let lower = token.to_lowercase();
        match word(&lower) {
            _ if is_probe(token) && !parts.iter().any(|p| *p == Part::Name(token.into())) => {
                parts.push(Part::Name(token.into()));
            }
            // a second is written small
            Some(Word::TimeUnit(TimeUnit::Milliseconds)) if token == "MS" => {
                parts.push(Part::Name(token.into()))
            }
            Some(word) => parts.push(Part::Says(word)),
            None if let Some(unit) =
                short_time(token).filter(|_| is_of_time(&plain, token, parts.last())) =>
            {
                parts.push(Part::Says(Word::TimeUnit(unit)));
            }
            None if order(token).is_some_and(|n| n < HIGHEST_ORDER) => {
                parts.push(Part::Says(Word::OtherVibration))
            }
            None => match glued(&lower) {
                Some(words) => parts.extend(words.map(Part::Says)),
                None => parts.push(Part::Name(token.into())),
            },
        }
    }
    parts
}

/// Units of time that are names or directions where nothing says otherwise.
fn short_time(token: &str) -> Option<TimeUnit> {
    match token {
        "us" => Some(TimeUnit::Microseconds),
        "ns" => Some(TimeUnit::Nanoseconds),
        _ => None,
    }
}

/// Whether a word is a unit of time: it stands alone, in brackets, or behind a word for the time.
fn is_of_time(text: &str, token: &str, before: Option<&Part>) -> bool {
    let is_time = |part: &Part| match part {
        Part::Says(Word::Time | Word::Date | Word::Clock) => true,
        Part::Name(name) => name == "t",
        Part::Says(_) => false,
    };
    text.trim() == token
        || ["[]", "()"].iter().any(|b| text.contains(&format!("{}{token}{}", &b[..1], &b[1..])))
        || before.is_some_and(is_time)
}

/// Two words that were written as one, such as `1xamp` or `umpp`.
fn glued(lower: &str) -> Option<[Word; 2]> {
    let cuts = lower.char_indices().map(|(i, _)| i).skip(1);
    let both = |at: usize| Some([word(&lower[..at])?, word(&lower[at..])?]);
    cuts.filter_map(both).find(|[a, b]| {
        let is_first = match a {
            Word::Unit(unit) => *unit == Unit::G || !unit.is_derivative(),
            // "°lag"
            Word::Angle(_) => return matches!(b, Word::Sense(_)),
            a => matches!(a, Word::Synchronous | Word::Amplitude | Word::Phase | Word::Gap),
        };
        is_first
            && matches!(
                b,
                Word::Synchronous
                    | Word::Amplitude
                    | Word::Phase
                    | Word::Detection(_)
                    | Word::Unit(Unit::Volt)
            )
    })
}

/// Replaces a phrase wherever it is not part of a longer word; upper case counts as lower.
fn replace_whole(text: &mut String, phrase: &str, by: &str) {
    let mut from = 0;
    loop {
        let lower = text.to_lowercase();
        if lower.len() != text.len() {
            return;
        }
        let Some(at) = lower.get(from..).and_then(|rest| rest.find(phrase)).map(|at| from + at) else {
            return;
        };
        let end = at + phrase.len();
        let joins = |c: Option<char>| c.is_some_and(char::is_alphanumeric);
        let whole = !joins(text[..at].chars().next_back()) && !joins(text[end..].chars().next());
        if whole {
            text.replace_range(at..end, by);
        }
        from = at + if whole { by.len() } else { phrase.len() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_of_the_trade_come_apart_into_words_and_the_probe() {
        use Word::{Amplitude, Phase, Synchronous};
        let says = |text: &str| -> (Vec<Word>, String) {
            let (mut words, mut names) = (Vec::new(), Vec::new());
            for part in parts(text, |_| false) {
                match part {
                    Part::Says(word) => words.push(word),
                    Part::Name(name) => names.push(name),
                }
            }
            (words, names.join(" "))
        };
        let um = Word::Unit(Unit::Micrometre);
        let pp = Word::Detection(Detection::PeakToPeak);
        assert_eq!(says("16X 1X Amp [µm pp]"), (vec![Synchronous, Amplitude, um, pp], "16X".into()));
        assert_eq!(says("BRG1_1xAmpl (umpp)").0, [Synchronous, Amplitude, um, pp]);
        assert_eq!(says("Phase (deg lag)").0, [Phase, Word::Angle(Angle::Degrees), Word::Sense(Sense::Lag)]);
        assert_eq!(says("Drehzahl [1/min]").0, [Word::Speed, Word::SpeedUnit(SpeedUnit::Rpm)]);
        assert_eq!(says("V2 Peak-to-Peak mil").0, [pp, Word::Unit(Unit::Mil)]);
        assert_eq!(says("app-pending").1, "app pending");
        let lag = Word::Sense(Sense::Lag);
        assert_eq!(says("16X Phase (°lag)").0, [Phase, Word::Angle(Angle::Degrees), lag]);
        let micro = Word::TimeUnit(TimeUnit::Microseconds);
        for text in ["us", "(us)", "time_us", "Time [us]"] {
            assert_eq!(says(text).0.last(), Some(&micro), "{text}");
        }
        assert_eq!(says("US plant").1, "US plant");
    }
}
