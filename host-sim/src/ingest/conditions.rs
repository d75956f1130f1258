//! Conditions of operation in exports: temperatures, pressures and loads, by their headers and units.

use rotor_edge_desktop::measurement::{Condition, ConditionUnit};

/// A unit of exports: as it is written, and what it becomes by a factor and, after it, an offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SourceUnit {
    pub symbol: &'static str,
    pub becomes: ConditionUnit,
    pub factor: f64,
    pub offset: f64,
    /// Whether it says enough only beside a word for what is measured.
    is_ambiguous: bool,
}

impl Eq for SourceUnit {}

impl SourceUnit {
    /// A value of it in the unit that it becomes.
    pub fn converted(&self, value: f64) -> f64 {
        value * self.factor + self.offset
    }

    /// By its name in a mapping.
    pub fn named(name: &str) -> Option<Self> {
        spelled(&name.trim().to_lowercase())
    }
}

const fn unit(symbol: &'static str, becomes: ConditionUnit, factor: f64) -> SourceUnit {
    SourceUnit { symbol, becomes, factor, offset: 0.0, is_ambiguous: false }
}

const FAHRENHEIT: SourceUnit =
    SourceUnit { offset: -160.0 / 9.0, ..unit("degF", ConditionUnit::DegreeCelsius, 5.0 / 9.0) };
const KELVIN: SourceUnit =
    SourceUnit { offset: -273.15, is_ambiguous: true, ..unit("K", ConditionUnit::DegreeCelsius, 1.0) };
const CELSIUS: SourceUnit = unit("degC", ConditionUnit::DegreeCelsius, 1.0);
const PERCENT: SourceUnit = SourceUnit { is_ambiguous: true, ..unit("percent", ConditionUnit::Percent, 1.0) };

/// Units in lower case; a psi is 6894.757 Pa, a kgf/cm² 98066.5 Pa, a mechanical horsepower 745.69987 W.
const SPELLINGS: [(SourceUnit, &[&str]); 13] = [
    (CELSIUS, &["°c", "ºc", "degc", "deg c", "deg. c", "grad c", "celsius"]),
    (FAHRENHEIT, &["°f", "ºf", "degf", "deg f", "deg. f", "fahrenheit"]),
    (KELVIN, &["k", "kelvin"]),
    (unit("bar", ConditionUnit::Bar, 1.0), &["bar", "bara", "barg", "bar a", "bar g"]),
    (unit("mbar", ConditionUnit::Bar, 1e-3), &["mbar"]),
    (unit("kPa", ConditionUnit::Bar, 1e-2), &["kpa"]),
    (unit("MPa", ConditionUnit::Bar, 10.0), &["mpa"]),
    (unit("psi", ConditionUnit::Bar, 0.068_947_57), &["psi", "psig", "psia"]),
    (unit("kgf/cm2", ConditionUnit::Bar, 0.980_665), &["kgf/cm2", "kgf/cm²", "kg/cm2", "kg/cm²"]),
    (unit("MW", ConditionUnit::Megawatt, 1.0), &["mw", "megawatt"]),
    (unit("kW", ConditionUnit::Megawatt, 1e-3), &["kw", "kilowatt"]),
    (unit("hp", ConditionUnit::Megawatt, 745.699_87e-6), &["hp"]),
    (PERCENT, &["%", "percent", "pct", "prozent"]),
];
/// A letter alone is a temperature's unit where the header says that it is one.
const LETTERS: [(SourceUnit, &str); 2] = [(CELSIUS, "c"), (FAHRENHEIT, "f")];
/// Words of what is measured.
const TEMPERATURES: [&str; 2] = ["temp", "öltemp"];
const LOADS: [&str; 6] = ["load", "power", "last", "leistung", "valve", "ventil"];
const PRESSURES: [&str; 3] = ["press", "druck", "presión"];

fn spelled(lower: &str) -> Option<SourceUnit> {
    SPELLINGS.iter().find(|(_, all)| all.contains(&lower)).map(|(unit, _)| *unit)
}

/// Whether a text is nothing but such a unit.
pub fn is_unit(text: &str) -> bool {
    let unit = text.trim().trim_matches(|c| "[]()".contains(c)).trim().to_lowercase();
    spelled(&unit).is_some_and(|unit| !unit.is_ambiguous)
}

/// What a header says of a condition of operation.
#[derive(Debug, Clone, PartialEq)]
pub enum StatedCondition {
    /// Its name, and the unit of its numbers.
    Known(String, SourceUnit),
    /// It is one by its name, and states no unit.
    WithoutUnit(String),
}

/// The condition that a header is; `None` if it is none.
pub fn stated(header: &str) -> Option<StatedCondition> {
    let lower = header.trim().to_lowercase();
    let has = |words: &[&str]| words.iter().any(|word| lower.contains(word));
    let (is_temperature, is_load) = (has(&TEMPERATURES), has(&LOADS));
    let is_named = is_temperature || is_load || has(&PRESSURES);
    let fits = |unit: &SourceUnit| match unit.becomes {
        ConditionUnit::Percent => is_load,
        _ => !unit.is_ambiguous || is_temperature,
    };
    let letter =
        |text: &str| LETTERS.iter().find(|(_, l)| is_temperature && *l == text).map(|(unit, _)| *unit);
    for (before, unit) in ends(&lower) {
        let Some(unit) = spelled(&unit).or_else(|| letter(&unit)).filter(fits) else { continue };
        let name = plain(&before);
        if !name.is_empty() {
            return Some(StatedCondition::Known(name, unit));
        }
    }
    let name = plain(&lower);
    (is_named && !name.is_empty()).then_some(StatedCondition::WithoutUnit(name))
}

/// Texts before and within what may be the unit: in brackets, else the last words.
fn ends(lower: &str) -> Vec<(String, String)> {
    let mut all = Vec::new();
    for (open, close) in [('[', ']'), ('(', ')')] {
        if let Some((before, rest)) = lower.split_once(open)
            && let Some((within, after)) = rest.split_once(close)
        {
            all.push((format!("{before} {after}"), within.trim().to_string()));
        }
    }
    let words: Vec<&str> =
        lower.split(|c: char| c.is_whitespace() || c == '_' || c == ',').filter(|w| !w.is_empty()).collect();
    for count in [2, 1] {
        if words.len() > count {
            let (before, unit) = words.split_at(words.len() - count);
            all.push((before.join(" "), unit.join(" ")));
        }
    }
    all
}

/// A name for a column: letters, digits and underscores.
fn plain(text: &str) -> String {
    let words = text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("_")
}

impl StatedCondition {
    /// The name of the column that it becomes, without the unit.
    pub fn name(&self) -> &str {
        match self {
            Self::Known(name, _) | Self::WithoutUnit(name) => name,
        }
    }
}

/// The condition of a name that the owner chose.
pub fn named(name: &str, unit: SourceUnit) -> Condition {
    Condition { name: plain(&name.to_lowercase()), unit: unit.becomes }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_state_conditions_with_their_units() {
        for (header, name, symbol) in [
            ("Lube Oil Temp [°C]", "lube_oil_temp", "degC"),
            ("Bearing temp (C)", "bearing_temp", "degC"),
            ("oil_temperature_degc", "oil_temperature", "degC"),
            ("Oil supply temp deg F", "oil_supply_temp", "degF"),
            ("Öltemperatur [K]", "öltemperatur", "K"),
            ("load_mw", "load", "MW"),
            ("Generator power, kW", "generator_power", "kW"),
            ("Load %", "load", "percent"),
            ("Oil pressure (psig)", "oil_pressure", "psi"),
        ] {
            match stated(header) {
                Some(StatedCondition::Known(found, unit)) => {
                    assert_eq!((&*found, unit.symbol), (name, symbol))
                }
                other => panic!("{header}: {other:?}"),
            }
        }
    }

    #[test]
    fn headers_of_vibration_and_bare_units_are_no_conditions() {
        for header in
            ["16X 1X Amp [um pp]", "Speed [%]", "MW", "Speed [rpm]", "gap [V]", "C", "1X Phase [deg lag]"]
        {
            assert_eq!(stated(header), None, "{header}");
        }
        assert_eq!(stated("Load"), Some(StatedCondition::WithoutUnit("load".into())));
    }

    #[test]
    fn temperatures_and_pressures_are_converted() {
        let of = |name: &str, x: f64| SourceUnit::named(name).unwrap().converted(x);
        assert!((of("degF", 113.0) - 45.0).abs() < 1e-12);
        assert!((of("K", 318.15) - 45.0).abs() < 1e-9);
        assert!((of("psi", 14.503_77) - 1.0).abs() < 1e-6);
        assert!((of("kW", 2_500.0) - 2.5).abs() < 1e-12);
    }
}
