//! Thresholds by name, as the command line gives them.

use std::str::FromStr;

use anyhow::{Context, Result, anyhow, bail};
use rotor_edge_core::thresholds::Thresholds;
use serde_json::Value;

/// `name=value`.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    name: String,
    value: Value,
}

impl FromStr for Setting {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> Result<Self> {
        let Some((name, value)) = text.split_once('=') else {
            bail!("\"{text}\": expected name=value, such as persistence_s=30");
        };
        let value = value.split(',').map(number).collect::<Result<Vec<Value>>>()?;
        let value = match <[Value; 1]>::try_from(value) {
            Ok([value]) => value,
            Err(several) => Value::Array(several),
        };
        Ok(Self { name: name.trim().into(), value })
    }
}

fn number(text: &str) -> Result<Value> {
    let text = text.trim();
    let whole = text.parse::<u64>().ok().map(Value::from);
    let real = || text.parse::<f64>().ok().filter(|number| number.is_finite()).map(Value::from);
    whole.or_else(real).ok_or_else(|| anyhow!("\"{text}\" is not a number"))
}

impl Setting {
    /// Whether it sets this threshold.
    pub fn is_of(&self, name: &str) -> bool {
        self.name == name
    }

    /// Puts the value into its place.
    ///
    /// # Errors
    /// If there is no such threshold, or the value is of another kind; whether it is within its bounds is not asked.
    pub fn apply(&self, thresholds: &mut Thresholds) -> Result<()> {
        let mut fields = serde_json::to_value(*thresholds)?;
        let known: Vec<String> = fields.as_object().map_or(vec![], |fields| fields.keys().cloned().collect());
        let Some(place) = fields.get_mut(&self.name) else {
            bail!("there is no threshold {}; there are {}", self.name, known.join(", "));
        };
        let before = place.clone();
        *place = self.value.clone();
        *thresholds = serde_json::from_value(fields)
            .with_context(|| format!("{}={}: expected a value such as {before}", self.name, self.value))?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(text: &str) -> Result<Thresholds> {
        let mut thresholds = Thresholds::DEFAULT;
        text.parse::<Setting>()?.apply(&mut thresholds)?;
        Ok(thresholds)
    }

    #[test]
    fn each_threshold_is_set_by_its_name_and_nothing_else_changes() {
        let default = Thresholds::DEFAULT;
        assert_eq!(set("rise=0.25").unwrap(), Thresholds { rise: 0.25, ..default });
        assert_eq!(set("persistence_readings=5").unwrap(), Thresholds { persistence_readings: 5, ..default });
        assert_eq!(
            set("gap_range_v=-16,-4.5").unwrap(),
            Thresholds { gap_range_v: [-16.0, -4.5], ..default }
        );
        assert_eq!(set("growth_s=3600").unwrap(), Thresholds { growth_s: 3600.0, ..default });
    }

    #[test]
    fn what_is_no_threshold_is_refused_with_what_was_expected() {
        for (text, says) in [
            ("rise", "expected name=value"),
            ("rise=high", "\"high\" is not a number"),
            ("rise=nan", "not a number"),
            ("height=1", "there is no threshold height; there are"),
            ("persistence_readings=2.5", "expected a value such as 3"),
            ("persistence_readings=300", "expected a value such as 3"),
            ("gap_range_v=-3", "expected a value such as [-18.0,-2.0]"),
            ("rise=1,2", "expected a value such as 0.5"),
        ] {
            let message = format!("{:#}", set(text).unwrap_err());
            assert!(message.contains(says), "{message}");
        }
    }
}
