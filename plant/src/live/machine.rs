//! One machine: what its monitor says now, its last reading and result, when it changed, what was asked about it.

use anyhow::Result;
use maud::{Markup, html};
use rotor_edge::render::sketch::{Mark, sketch};
use rotor_edge::scale::three_digits;
use rotor_edge_core::reading::ProbeVector;
use rotor_edge_desktop::machine::drawing::Rotor;
use rusqlite::{Connection, OptionalExtension as _};

use super::glance::{Glance, change_in_words};
use super::jobs;
use super::moment::moment;
use super::page::{ago_us, path, said, seen};
use crate::fleet::queue;
use crate::names::Names;

/// Changes of state and jobs that are listed.
const MOST_LISTED: u32 = 10;

/// What is told anew whenever it changes. `rotor` is the machine, where that is stated.
///
/// # Errors
/// If the store cannot be read.
pub fn live(connection: &Connection, glance: &Glance, rotor: Option<&Rotor>, now_us: i64) -> Result<Markup> {
    let names = Names::of(rotor);
    let newest = &glance.newest;
    let source = newest.source;
    let jobs = queue::newest(connection, Some(source), MOST_LISTED)?;
    Ok(html! {
        p class={ "now " (glance.state_now) } {
            b class="state" { (said(&glance.state_now)) }
            @if glance.state_since_us > 0 { " since " (moment(glance.state_since_us)) }
            @if !glance.why.is_empty() { ": " (glance.why) }
            (seen(glance.acknowledged.as_ref(), now_us))
        }
        p { (newest.heard_us.map_or("No message yet.".into(), |heard_us| format!("Last message {}.", ago_us(now_us, heard_us)))) }
        @if let Some((_, state, since_us)) = glance.unseen_alarm() { span id="alarm" data-state=(state) data-since=(since_us) {} }
        div class="overview" {
            @if let Some(rotor) = rotor { div class="drawing" { (drawing(rotor, glance)) } }
            div class="tables" {
                (reading(connection, source, &names, now_us)?)
                (result(connection, source, &names, now_us)?)
            }
        }
        (changes(connection, source, &names)?)
        @if !jobs.is_empty() { h2 { "Jobs" } (jobs::table(&jobs)) }
    })
}

/// The machine to scale; of one that is flagged, with the bearing that is suspected.
fn drawing(rotor: &Rotor, glance: &Glance) -> Markup {
    let suspect = glance.newest.suspect.filter(|_| glance.newest.state.as_deref() == Some("flagged"));
    let bearing = suspect.and_then(|number| rotor.bearing.get(usize::from(number).checked_sub(1)?));
    let mark = bearing.map(|b| Mark { position_m: b.position_m, text: "suspect".into(), is_main: true });
    sketch(&rotor.name, rotor, mark.as_slice())
}

fn reading(connection: &Connection, source: i64, names: &Names, now_us: i64) -> Result<Markup> {
    let sql = "SELECT * FROM reading WHERE source = ? ORDER BY epoch DESC, sequence DESC LIMIT 1";
    let told = |row: &rusqlite::Row| {
        let number = |name: String| row.get::<_, Option<f64>>(name.as_str());
        let mut lines = Vec::new();
        for probe in 1..=row.get::<_, u8>("probes")? {
            let vector = number(format!("p{probe}_cos_um"))?.zip(number(format!("p{probe}_sin_um"))?);
            let vector = vector.map(|(cos, sin)| ProbeVector { cos_um: cos as f32, sin_um: sin as f32 });
            lines.push((probe, vector, number(format!("p{probe}_gap_v"))?));
        }
        let keyphasor: String = row.get("keyphasor")?;
        Ok((row.get::<_, i64>("time_us")?, number("speed_rpm".into())?, keyphasor, lines))
    };
    let Some((time_us, speed_rpm, keyphasor, lines)) =
        connection.query_row(sql, [source], told).optional()?
    else {
        return Ok(html! { p { "No reading was received yet." } });
    };
    Ok(html! {
        table {
            caption { "Last reading, " (ago_us(now_us, time_us)) }
            thead { tr { th scope="col" {} th scope="col" { "µm 0-pk" } th scope="col" { "lag, °" } th scope="col" { "gap, V" } } }
            tbody {
                tr {
                    td { "speed" }
                    td colspan="3" {
                        (speed_rpm.map_or("lost".into(), |rpm| format!("{rpm:.1} rpm")))
                        ", keyphasor " (said(&keyphasor))
                    }
                }
                @for (probe, vector, gap_v) in lines {
                    tr {
                        td { (names.probe(probe)) }
                        td { (vector.map_or("lost".into(), |v| three_digits(v.amplitude_um().into()))) }
                        td { (vector.map_or("–".into(), |v| format!("{:.0}", v.lag_deg()))) }
                        td { (gap_v.map_or("–".into(), |v| format!("{v:.2}"))) }
                    }
                }
            }
        }
    })
}

fn result(connection: &Connection, source: i64, names: &Names, now_us: i64) -> Result<Markup> {
    let sql = "SELECT * FROM result WHERE source = ? ORDER BY epoch DESC, sequence DESC LIMIT 1";
    let told = |row: &rusqlite::Row| {
        let number = |name: String| row.get::<_, Option<f64>>(name.as_str());
        let mut lines = Vec::new();
        for plane in 1..=row.get::<_, u8>("planes")? {
            let parts = number(format!("u{plane}_cos_g_mm"))?.zip(number(format!("u{plane}_sin_g_mm"))?);
            let value = parts.map(|(cos, sin)| {
                let angle_deg = sin.atan2(cos).to_degrees();
                format!("{} g·mm at {angle_deg:.0}°", three_digits(cos.hypot(sin)))
            });
            lines.push((format!("unbalance, {}", names.plane(plane)), value));
        }
        for (name, column) in [("residual", "residual_um"), ("no alarm below", "floor_um")] {
            let value = number(column.into())?;
            lines.push((name.into(), value.map(|um| format!("{} µm 0-pk", three_digits(um)))));
        }
        let ratio = number("ratio".into())?.map(|ratio| format!("{:.1} %", 100.0 * ratio));
        lines.push(("residual / vibration".into(), ratio));
        lines.push(("flag".into(), Some(if row.get("flagged")? { "up" } else { "down" }.into())));
        let redundancy: u32 = row.get("redundancy")?;
        let spare = if redundancy == 0 {
            "none: the residual cannot show a misfit".into()
        } else {
            redundancy.to_string()
        };
        lines.push(("redundant values".into(), Some(spare)));
        Ok((row.get::<_, i64>("time_us")?, lines))
    };
    let Some((time_us, lines)) = connection.query_row(sql, [source], told).optional()? else {
        return Ok(html! { p { "The monitor has evaluated no reading yet." } });
    };
    Ok(html! {
        table {
            caption { "Last result, " (ago_us(now_us, time_us)) }
            tbody { @for (name, value) in lines { tr { td { (name) } td { (value.as_deref().unwrap_or("–")) } } } }
        }
    })
}

fn changes(connection: &Connection, source: i64, names: &Names) -> Result<Markup> {
    let sql = "SELECT time_us, state, reason, cause, suspect FROM state WHERE source = ? ORDER BY epoch DESC, sequence DESC LIMIT ?";
    let mut statement = connection.prepare_cached(sql)?;
    let row = |row: &rusqlite::Row| {
        let (state, reason, cause): (String, Option<String>, Option<String>) =
            (row.get(1)?, row.get(2)?, row.get(3)?);
        let words = change_in_words(Some(&state), &reason, &cause, row.get(4)?, names);
        Ok((row.get::<_, i64>(0)?, state, words))
    };
    let all: Vec<_> = statement.query_map((source, MOST_LISTED), row)?.collect::<rusqlite::Result<_>>()?;
    Ok(html! {
        @if !all.is_empty() {
            table class="changes" {
                caption { "Last changes" }
                tbody {
                    @for (time_us, state, words) in &all {
                        tr class=(state) {
                            td { (moment(*time_us)) }
                            td class="state" { (said(state)) }
                            td { (words) }
                        }
                    }
                }
            }
        }
    })
}

/// How somebody says that the alarm was seen; what it is comes from the live part when it is sent.
pub fn form(glance: &Glance) -> Markup {
    let newest = &glance.newest;
    let alarm = glance.unseen_alarm();
    let (state, since_us) = alarm.map_or_else(Default::default, |(_, state, since_us)| (state, since_us));
    html! {
        form id="acknowledge" method="post" action={ (path(&newest.plant, &newest.bus, newest.node)) "/acknowledge" } hidden[state.is_empty()] {
            input type="hidden" name="state" value=(state);
            input type="hidden" name="since_us" value=(since_us);
            label { "Your name " input name="who" required maxlength="80" autocomplete="name"; }
            label { "Token " input name="token" type="password" required autocomplete="current-password"; }
            button { "Mark as seen" }
        }
    }
}
