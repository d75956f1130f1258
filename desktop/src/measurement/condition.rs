//! Conditions of operation beside the vibration: temperatures, pressures, load.

use super::reading::Reading;

/// Unit of a condition, as columns have it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ConditionUnit {
    DegreeCelsius,
    Bar,
    Megawatt,
    Percent,
}

/// Ends of columns, and units as they are written.
const UNITS: [(ConditionUnit, &str, &str); 4] = [
    (ConditionUnit::DegreeCelsius, "degc", "°C"),
    (ConditionUnit::Bar, "bar", "bar"),
    (ConditionUnit::Megawatt, "mw", "MW"),
    (ConditionUnit::Percent, "percent", "%"),
];
/// Temperature below which there is none, °C.
const ABSOLUTE_ZERO_DEGC: f64 = -273.15;
/// Words in names of conditions, by which a column without a unit is known.
const WORDS: [&str; 4] = ["temp", "press", "load", "power"];

impl ConditionUnit {
    pub const ALL: [Self; 4] = [Self::DegreeCelsius, Self::Bar, Self::Megawatt, Self::Percent];

    /// End of a column's name.
    pub fn suffix(self) -> &'static str {
        UNITS.iter().find(|(unit, ..)| *unit == self).map_or("", |(_, suffix, _)| suffix)
    }

    /// As text writes it.
    pub fn symbol(self) -> &'static str {
        UNITS.iter().find(|(unit, ..)| *unit == self).map_or("", |(.., symbol)| symbol)
    }
}

/// A condition of operation: the column `oil_temperature_degc` is `oil_temperature` in °C.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Condition {
    pub name: String,
    pub unit: ConditionUnit,
}

impl Condition {
    /// The condition of a column of `measured.csv`.
    pub fn of_column(column: &str) -> Option<Self> {
        let (name, suffix) = column.trim().rsplit_once('_')?;
        let (unit, ..) = UNITS.iter().find(|(_, of, _)| *of == suffix)?;
        (!name.is_empty()).then(|| Self { name: name.into(), unit: *unit })
    }

    /// Its column in `measured.csv`.
    pub fn column(&self) -> String {
        format!("{}_{}", self.name, self.unit.suffix())
    }

    /// Its name in a sentence.
    pub fn words(&self) -> String {
        self.name.replace('_', " ")
    }

    /// Why a number cannot be its value.
    pub(super) fn refusal(&self, value: f64) -> Option<String> {
        let is_too_cold = self.unit == ConditionUnit::DegreeCelsius && value < ABSOLUTE_ZERO_DEGC;
        is_too_cold.then(|| format!("{value} °C is below absolute zero, expected °C"))
    }
}

/// What a column lacks that is a condition by its name, but has no unit that is known.
pub(super) fn without_unit(column: &str) -> Option<String> {
    let lower = column.to_lowercase();
    WORDS.iter().any(|word| lower.contains(word)).then(|| {
        let ends: Vec<String> = UNITS.iter().map(|(_, suffix, _)| format!("_{suffix}")).collect();
        format!(
            "the column {column} has no unit that is known, expected a name that ends with {}; `rotor-edge import` converts \
             other units",
            ends.join(", ")
        )
    })
}

/// Values of a condition by reading, by its number.
pub fn values(readings: &[Reading], condition: usize) -> Vec<Option<f64>> {
    readings.iter().map(|r| r.conditions.get(condition).copied().flatten()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn condition_columns_round_trip_and_others_are_none() {
        for column in ["oil_temperature_degc", "load_mw", "lube_oil_pressure_bar", "load_percent"] {
            assert_eq!(Condition::of_column(column).unwrap().column(), column);
        }
        for column in ["oil_temperature", "_degc", "speed_rpm", "15X_cos_um", "15X_gap_v"] {
            assert_eq!(Condition::of_column(column), None, "{column}");
        }
    }
}
