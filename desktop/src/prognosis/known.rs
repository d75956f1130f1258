//! The columns of a track that hold what its filter knew on each day.

use super::filter_state::FilterState;
use crate::error::Error;

/// Columns with the static and dynamic unbalance of a day, in the order of the series.
pub(super) const COLUMNS: [&str; 4] = ["static_g_mm", "static_deg", "dynamic_g_mm", "dynamic_deg"];
/// Prefix of the columns with what was known on the day itself, where the estimates know the future.
pub const KNOWN: &str = "known_";
/// What stands beside a number: its movement a day, the standard deviations of both, their correlation, and the
/// standard deviation of a day's push.
const BESIDE: [&str; 5] = ["per_d", "sd", "per_d_sd", "correlation", "push_sd"];
/// Share of a movement that is left after a day.
const KEPT: &str = "known_kept_per_d";

pub fn header() -> Vec<String> {
    let of = |name: &str| {
        let beside = BESIDE.iter().map(move |part| format!("{KNOWN}{name}_{part}"));
        std::iter::once(format!("{KNOWN}{name}")).chain(beside).collect::<Vec<_>>()
    };
    COLUMNS.iter().flat_map(|name| of(name)).chain([KEPT.to_string()]).collect()
}

pub fn cells(known: &[FilterState; 4]) -> Vec<String> {
    let of = |o: &FilterState| [o.level, o.per_d, o.level_sd, o.per_d_sd, o.correlation, o.push_sd];
    let numbers = known.iter().flat_map(of).chain([known[0].kept]);
    numbers.map(|value| format!("{value:.6e}")).collect()
}

/// Where they stand in a file.
pub struct Places(Vec<usize>);

impl Places {
    /// `None` if the file has none; `find` tells the place of a column.
    pub fn find(find: impl Fn(&str) -> Option<usize>) -> Option<Self> {
        header().iter().map(|name| find(name)).collect::<Option<Vec<usize>>>().map(Self)
    }

    /// Reads a row; `number` reads a cell.
    ///
    /// # Errors
    /// If a cell is no number; what `out_of_range` makes of a number that cannot be one.
    pub fn read(
        &self,
        number: impl Fn(usize) -> Result<f64, Error>,
        out_of_range: impl Fn(usize) -> Error,
    ) -> Result<[FilterState; 4], Error> {
        let cells = self.0.iter().map(|place| number(*place)).collect::<Result<Vec<f64>, Error>>()?;
        let within = |k: usize, value: f64| match (k == 4 * (BESIDE.len() + 1), k % (BESIDE.len() + 1)) {
            (true, _) => (0.0..=1.0).contains(&value),
            (false, 2 | 3 | 5) => value >= 0.0,
            (false, 4) => (-1.0..=1.0).contains(&value),
            _ => true,
        };
        if let Some(wrong) = cells.iter().enumerate().position(|(k, value)| !within(k, *value)) {
            return Err(out_of_range(self.0[wrong]));
        }
        let kept = cells[cells.len() - 1];
        Ok(std::array::from_fn(|i| {
            let own = &cells[i * (BESIDE.len() + 1)..];
            let (level, per_d, level_sd, per_d_sd, correlation, push_sd) =
                (own[0], own[1], own[2], own[3], own[4], own[5]);
            FilterState { level, per_d, level_sd, per_d_sd, correlation, kept, push_sd }
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::super::series::parse;
    use super::*;

    fn track(change: impl Fn(&mut FilterState)) -> String {
        let mut text = format!("time_d,{},{}\n", COLUMNS.join(","), header().join(","));
        // half a turn between the third day and the sixth, the fourth and the fifth without a reading
        for (day, deg) in [(0, 170.0), (1, 176.0), (2, 179.0), (5, -178.0)] {
            let mut one = FilterState {
                level: deg,
                per_d: 1.5,
                level_sd: 2.0,
                per_d_sd: 0.5,
                correlation: 0.25,
                kept: 0.75,
                push_sd: 0.1,
            };
            change(&mut one);
            let known = [FilterState { level: 400.0 + f64::from(day), ..one }, one, one, one];
            text += &format!("{day},{},{deg},30,40,{}\n", 400 + day, cells(&known).join(","));
        }
        text
    }

    #[test]
    fn known_state_is_unwrapped_and_advanced_over_missing_days() {
        let history = parse("track.csv", &track(|_| ())).unwrap();
        let angles = history.series[1].filter_states.as_ref().unwrap();
        assert_eq!(angles.len(), 6);
        assert_eq!((angles[0].level, angles[0].correlation, angles[0].kept), (170.0, 0.25, 0.75));
        assert_eq!((angles[3], angles[4]), (angles[2].next_day(), angles[2].next_day().next_day()));
        assert_eq!(angles[5].level, 182.0);
    }

    #[test]
    fn impossible_state_is_refused_with_row_and_column() {
        let refusal = parse("t.csv", &track(|o| o.correlation = -1.5)).unwrap_err().to_string();
        assert!(
            refusal.contains("row 2, column known_static_g_mm_correlation: is out of range"),
            "{refusal}"
        );
        let refusal = parse("t.csv", &track(|o| o.kept = 1.5)).unwrap_err().to_string();
        assert!(refusal.contains("column known_kept_per_d"), "{refusal}");
        let without = track(|_| ()).replace("known_kept_per_d", "other");
        assert!(parse("t.csv", &without).unwrap().series[0].filter_states.is_none());
    }
}
