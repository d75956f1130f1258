//! What a plant wants to know: which machines changed, what is missing in each model, which models to deploy.

use anyhow::Result;
use rotor_edge::bus::states::name;
use rotor_edge::scale::three_digits;
use rotor_edge_core::state::NodeState;
use rotor_edge_desktop::rotor_file;
use rusqlite::{Connection, OptionalExtension as _};
use serde::Serialize;
use serde_json::Value;

use super::machines::{StatedMachine, sources};
use super::task::FleetCommand;
use crate::item::Source;
use crate::names::{Names, counted};

/// What is known of one machine.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct MachineSummary {
    #[serde(flatten)]
    pub source: Source,
    /// Whether something changed in the time.
    pub change: ChangeStatus,
    /// What says so, or why nothing can.
    pub why: String,
    /// What is missing in its model, or what to do to know.
    pub missing: String,
    /// Whether a better model waits to be deployed.
    pub is_to_deploy: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ChangeStatus {
    /// A flag rose, or the monitor could not judge any more.
    Changed,
    /// Nothing was judged: it may have changed.
    CannotTell,
    /// Readings were judged and raised no flag.
    NoFlag,
}

/// A better model of a machine than the one that it is stated to have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Better {
    pub model: String,
    pub effects: Vec<String>,
    /// What `improve` said at the end.
    pub verdict: String,
}

/// Every monitor that was heard, over the time since `from_us`: what changed first.
///
/// # Errors
/// If the store cannot be read.
pub fn all(connection: &Connection, from_us: i64) -> Result<Vec<MachineSummary>> {
    let mut all = Vec::new();
    for (id, source) in sources(connection)? {
        let (change, why) = change(connection, id, from_us)?;
        let sql = "SELECT rotor FROM machine WHERE source = ?";
        let rotor: Option<String> = connection.query_row(sql, [id], |row| row.get(0)).optional()?;
        let (missing, is_to_deploy) = match rotor {
            None => ("its machine is not known: rotor-edge-plant machine".into(), false),
            Some(rotor) => missing(connection, &StatedMachine { id, source: source.clone(), rotor })?,
        };
        all.push(MachineSummary { source, change, why, missing, is_to_deploy });
    }
    all.sort_by_key(|line| line.change);
    Ok(all)
}

/// What the machine's own file calls its parts; a drawing that cannot be read names nothing.
fn names(connection: &Connection, id: i64) -> Result<Names> {
    let sql = "SELECT rotor FROM machine WHERE source = ?";
    let rotor: Option<String> = connection.query_row(sql, [id], |row| row.get(0)).optional()?;
    let rotor = rotor.and_then(|text| rotor_file::parse("rotor.toml", &text).ok());
    Ok(Names::of(rotor.as_ref()))
}

fn change(connection: &Connection, id: i64, from_us: i64) -> Result<(ChangeStatus, String)> {
    let count = |sql: &str| connection.query_row(sql, (id, from_us), |row| row.get::<_, i64>(0));
    let results = count("SELECT count(*) FROM result WHERE source = ? AND time_us >= ?")?;
    // where no row is left over for it, a residual says nothing
    let judged = count("SELECT count(*) FROM result WHERE source = ? AND time_us >= ? AND redundancy > 0")?;
    let risen = count(
        "SELECT count(*) FROM (SELECT flagged, time_us, coalesce(lag(flagged) OVER (ORDER BY epoch, sequence), 0) AS before \
         FROM result WHERE source = ?) WHERE flagged > before AND time_us >= ?",
    )?;
    let is_up = connection
        .query_row(
            "SELECT flagged, suspect, reason FROM result WHERE source = ? AND time_us >= ? ORDER BY epoch DESC, sequence DESC LIMIT 1",
            (id, from_us),
            |row| Ok((row.get::<_, bool>(0)?, row.get::<_, Option<u8>>(1)?, row.get::<_, String>(2)?)),
        )
        .optional()?;
    if let Some((true, suspect, _)) = is_up {
        let names = names(connection, id)?;
        let at = suspect.map_or_else(String::new, |bearing| format!(", at {}", names.bearing(bearing)));
        return Ok((ChangeStatus::Changed, format!("its flag is raised{at}")));
    }
    if risen > 0 {
        return Ok((
            ChangeStatus::Changed,
            format!("its flag was raised ({}) and is lowered now", counted(risen as usize, "time")),
        ));
    }
    let lost: Option<(String, String)> = connection
        .query_row(
            "SELECT state, reason FROM heartbeat WHERE source = ? AND time_us >= ? ORDER BY epoch DESC, sequence DESC LIMIT 1",
            (id, from_us),
            |row| Ok((row.get(0)?, row.get(1)?)),
        )
        .optional()?;
    if let Some((state, reason)) = &lost
        && [NodeState::Blind, NodeState::Stale, NodeState::Conflict].iter().any(|lost| name(lost) == *state)
    {
        return Ok((ChangeStatus::Changed, format!("it no longer evaluates readings: {state}, {reason}")));
    }
    Ok(match (results, judged) {
        (0, _) if lost.is_none() => (ChangeStatus::CannotTell, "no message was received".into()),
        (0, _) => {
            (ChangeStatus::CannotTell, "no reading was evaluated: check the source of its readings".into())
        }
        (_, 0) => {
            (ChangeStatus::CannotTell, "too few probes were usable for a residual: check the probes".into())
        }
        _ => (
            ChangeStatus::NoFlag,
            format!(
                "{judged} of {} had a residual, and no flag was raised",
                counted(results as usize, "reading")
            ),
        ),
    })
}

/// What is missing in the model that a machine is stated to have, and whether a better one waits.
fn missing(connection: &Connection, machine: &StatedMachine) -> Result<(String, bool)> {
    if let Some(better) = better(connection, machine)? {
        let effects = better.effects.join(", ");
        return Ok((
            format!("{effects}; the model with it is {}", better.verdict),
            better.verdict == "adequate",
        ));
    }
    let sql = "SELECT answer FROM job WHERE source = ? AND rotor = ? AND state = 'done' AND command IN ('diagnose', 'improve') \
               ORDER BY ended_us DESC LIMIT 1";
    let answer =
        connection.query_row(sql, (machine.id, &machine.rotor), |row| row.get::<_, String>(0)).optional()?;
    let Some(answer) = answer else {
        return Ok(("not diagnosed yet: rotor-edge-plant fleet diagnose".into(), false));
    };
    Ok((in_a_word(FleetCommand::Diagnose, &answer), false))
}

/// The newest better model that `improve` made of the one that a machine is stated to have.
///
/// # Errors
/// If the store cannot be read.
pub fn better(connection: &Connection, machine: &StatedMachine) -> Result<Option<Better>> {
    let sql = "SELECT answer, model FROM job WHERE source = ? AND rotor = ? AND state = 'done' AND command = 'improve' \
               AND model IS NOT NULL ORDER BY ended_us DESC LIMIT 1";
    let row = |row: &rusqlite::Row| Ok((row.get::<_, String>(0)?, row.get::<_, String>(1)?));
    let Some((answer, model)) = connection.query_row(sql, (machine.id, &machine.rotor), row).optional()?
    else {
        return Ok(None);
    };
    let answer: Value = serde_json::from_str(&answer)?;
    let effects = effects(&answer);
    let verdict = answer["verdict"].as_str().unwrap_or_default().into();
    Ok((!effects.is_empty()).then_some(Better { model, effects, verdict }))
}

fn effects(improved: &Value) -> Vec<String> {
    let steps = improved["steps"].as_array().into_iter().flatten();
    steps.filter_map(|step| step["effect"].as_str().map(Into::into)).collect()
}

/// The static unbalance on the last day of a forecast, with its 95 % interval.
fn forecast_end(day: &Value) -> Option<String> {
    let number = |key: &str| day["U_g"][key].as_f64().map(three_digits);
    let date = day["time"].as_str().and_then(|time| time.get(..10)).map(String::from);
    let date = date.or_else(|| Some(format!("day {:.0}", day["time_d"].as_f64()?)))?;
    Some(format!(
        "static unbalance {} g·mm on {date} ({} to {})",
        number("value")?,
        number("low")?,
        number("high")?
    ))
}

/// What a person wants to know of an answer first.
pub fn in_a_word(command: FleetCommand, answer: &str) -> String {
    let Ok(answer) = serde_json::from_str::<Value>(answer) else { return answer.into() };
    let verdict = answer["verdict"].as_str().unwrap_or("–");
    let number = |key: &str| answer[key].as_array().map_or(0, Vec::len);
    match command {
        FleetCommand::Track => {
            format!("{}, {}", counted(number("estimates"), "day"), counted(number("flags"), "flag"))
        }
        FleetCommand::Improve => {
            let added = effects(&answer);
            format!(
                "{verdict}; added: {}",
                if added.is_empty() { "nothing".into() } else { added.join(", ") }
            )
        }
        FleetCommand::Deploy => "the monitor runs it".into(),
        FleetCommand::Forecast => {
            let last = answer["forecast"].as_array().and_then(|days| days.last());
            last.and_then(forecast_end).unwrap_or_else(|| "no forecast".into())
        }
        FleetCommand::Diagnose => match answer["candidates"][0]["effect"].as_str() {
            Some(effect) if verdict == "missing" => format!("missing: {effect}"),
            _ => verdict.into(),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_show_counts_and_last_forecast_with_interval() {
        let track = in_a_word(FleetCommand::Track, r#"{"estimates": [1, 2], "flags": [9]}"#);
        assert_eq!(track, "2 days, 1 flag");
        let day = |time: &str, value: f64| {
            format!(
                r#"{{"time_d": 364.0, "time": {time}, "U_g": {{"value": {value}, "low": 203.4, "high": 1280.0}}}}"#
            )
        };
        let answer = |last: String| format!(r#"{{"forecast": [{}, {last}]}}"#, day("null", 1.0));
        let forecast = |last: String| in_a_word(FleetCommand::Forecast, &answer(last));
        assert_eq!(forecast(day("null", 742.3)), "static unbalance 742 g·mm on day 364 (203 to 1,280)");
        let dated = forecast(day(r#""2026-03-01T06:00:00Z""#, 742.3));
        assert_eq!(dated, "static unbalance 742 g·mm on 2026-03-01 (203 to 1,280)");
        assert_eq!(in_a_word(FleetCommand::Forecast, r#"{"forecast": []}"#), "no forecast");
    }
}
