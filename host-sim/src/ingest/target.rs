//! What a column becomes: a quantity, of a probe if it is one of a probe, in stated units.

use std::fmt;
use std::str::FromStr;

use anyhow::{Error, Result, bail};
use serde::{Deserialize, Serialize};

use super::column_units::ColumnUnits;
use super::conditions::SourceUnit;
use super::words::{Part, parts};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quantity {
    Run,
    /// A moment, or the date of one if there is a column with the clock.
    Time,
    Clock,
    Speed,
    Point,
    Machine,
    Amplitude,
    Phase,
    /// Of `u(t) = cos · cos Ωt + sin · sin Ωt`.
    Cos,
    Sin,
    /// Of a phasor whose angle is the phase, which may be a lag or a lead.
    Real,
    Imaginary,
    Gap,
    /// A temperature, a pressure or a load; its name stands where that of a probe does.
    Condition,
    /// Whether the value of another column is valid.
    Status,
    /// Nothing: the column is ignored.
    Left,
}

const NAMES: [(Quantity, &str); 16] = [
    (Quantity::Run, "run"),
    (Quantity::Time, "time"),
    (Quantity::Clock, "clock"),
    (Quantity::Speed, "speed"),
    (Quantity::Point, "point"),
    (Quantity::Machine, "machine"),
    (Quantity::Amplitude, "amplitude"),
    (Quantity::Phase, "phase"),
    (Quantity::Cos, "cos"),
    (Quantity::Sin, "sin"),
    (Quantity::Real, "real"),
    (Quantity::Imaginary, "imaginary"),
    (Quantity::Gap, "gap"),
    (Quantity::Condition, "condition"),
    (Quantity::Status, "status"),
    (Quantity::Left, "left"),
];

impl Quantity {
    pub fn name(self) -> &'static str {
        NAMES.iter().find(|(q, _)| *q == self).map_or("", |(_, name)| name)
    }

    fn named(name: &str) -> Option<Self> {
        NAMES.iter().find(|(_, n)| *n == name.trim()).map(|(q, _)| *q)
    }

    /// Whether it is one of a probe.
    pub fn is_of_probe(self) -> bool {
        self == Self::Gap || self.is_vibration()
    }

    pub fn is_vibration(self) -> bool {
        use Quantity::{Amplitude, Cos, Imaginary, Phase, Real, Sin};
        matches!(self, Amplitude | Phase | Cos | Sin | Real | Imaginary)
    }
}

/// `[probe:]quantity[:unit]`, such as `16X:amplitude:um pp`, `speed:rpm`, `time:excel`, `left`; of a condition of operation
/// `name:condition:unit`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Target {
    pub probe: Option<String>,
    pub quantity: Quantity,
    pub stated: ColumnUnits,
}

impl FromStr for Target {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let expected = "expected probe:quantity:unit, such as 16X:amplitude:\"um pp\", 16X:phase:\"deg lag\", speed:rpm, \
                        time or left";
        let segments: Vec<&str> = text.split(':').collect();
        let Some(at) = segments.iter().take(2).rposition(|s| Quantity::named(s).is_some()) else {
            let names: Vec<&str> = NAMES.iter().map(|(_, name)| *name).collect();
            bail!("\"{text}\": no quantity, {expected}; there are {}", names.join(", "));
        };
        let quantity = Quantity::named(segments[at]).unwrap_or(Quantity::Left);
        let mut stated = ColumnUnits::default();
        let unit = segments[at + 1..].join(" ");
        if quantity == Quantity::Condition && !unit.trim().is_empty() {
            let Some(found) = SourceUnit::named(&unit) else {
                bail!("\"{text}\": unknown unit, expected degC, degF, K, bar, kPa, psi, MW, kW or percent");
            };
            stated.condition = Some(found);
        }
        let unit = if quantity == Quantity::Condition { String::new() } else { unit };
        for part in parts(&unit, |_| false) {
            let Part::Says(word) = &part else { bail!("\"{text}\": unknown unit, {expected}") };
            if !stated.take(*word) {
                bail!("\"{text}\": unknown unit, {expected}");
            }
        }
        let probe = (at == 1).then(|| segments[0].trim().to_string());
        let has_name = quantity.is_of_probe() || quantity == Quantity::Condition;
        if probe.is_some() && !has_name {
            bail!("\"{text}\": {} is not of a probe, {expected}", quantity.name());
        }
        Ok(Self { probe, quantity, stated })
    }
}

impl TryFrom<String> for Target {
    type Error = Error;

    fn try_from(text: String) -> Result<Self> {
        text.parse()
    }
}

impl From<Target> for String {
    fn from(target: Target) -> Self {
        target.to_string()
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = self.stated.to_string();
        let probe = self.probe.iter().map(String::as_str);
        let unit = (!unit.is_empty()).then_some(unit.as_str());
        let segments: Vec<&str> = probe.chain([self.quantity.name()]).chain(unit).collect();
        f.write_str(&segments.join(":"))
    }
}

/// What a column of that name becomes, or of that number, from 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rule {
    pub from: String,
    pub to: Target,
}

impl FromStr for Rule {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let Some((from, to)) = text.rsplit_once('=') else {
            bail!("\"{text}\": expected NAME=probe:quantity:unit, such as \"1x Ampl=16X:amplitude:um pp\"");
        };
        Ok(Self { from: from.trim().into(), to: to.parse()? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_written_as_they_are_read() {
        for text in [
            "16X:amplitude:um pp",
            "1X:phase:deg lag",
            "amplitude:mil 0p",
            "speed:rad/s",
            "time:epoch_ms",
            "time:epoch_ns",
            "left",
            "P1:gap:V",
            "oil_temperature:condition:degC",
            "load:condition:MW",
        ] {
            assert_eq!(text.parse::<Target>().unwrap().to_string(), text);
        }
        let rule: Rule = "n=1 [µm]=16X:cos:um rms".parse().unwrap();
        assert_eq!((rule.from.as_str(), rule.to.to_string()), ("n=1 [µm]", "16X:cos:um rms".into()));
    }

    #[test]
    fn what_is_no_target_is_refused_with_what_was_expected() {
        for (text, says) in [
            ("16X:height", "no quantity"),
            ("16X:amplitude:furlong", "unknown unit"),
            ("16X:speed", "not of a probe"),
            ("oil:condition:furlong", "expected degC, degF"),
        ] {
            assert!(text.parse::<Target>().unwrap_err().to_string().contains(says), "{text}");
        }
        assert!("16X".parse::<Rule>().is_err());
    }
}
