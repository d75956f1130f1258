//! What one machine did over a time, as a page of figures.

use anyhow::Result;
use nalgebra::Complex;
use rotor_edge::render::chart::{Chart, Column, Look};
use rotor_edge::render::orbit::{OrbitPanel, orbit};
use rotor_edge::render::trend::{Trend, trend};
use rotor_edge::render::{Figure, Section, page};
use rotor_edge_desktop::compare::probe_pairs;
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::phasor_m;
use rusqlite::{Connection, OptionalExtension as _};

use super::history::{MOST_ROWS, Quantity, STRETCHES, Stretch, of};
use super::moment::moment;
use crate::names::Names;

/// Longer times are told in days, h.
const LONGEST_IN_HOURS: f64 = 48.0;
const US_AN_HOUR: f64 = 3_600e6;

const fn single(name: &'static str, columns: &'static [&'static str]) -> Quantity {
    Quantity { name, columns }
}

const RESIDUAL: [Quantity; 2] =
    [single("residual", &["residual_um"]), single("no alarm below", &["floor_um"])];
/// Unbalance of each plane.
pub const UNBALANCE: [Quantity; 4] = [
    single("plane 1", &["u1_cos_g_mm", "u1_sin_g_mm"]),
    single("plane 2", &["u2_cos_g_mm", "u2_sin_g_mm"]),
    single("plane 3", &["u3_cos_g_mm", "u3_sin_g_mm"]),
    single("plane 4", &["u4_cos_g_mm", "u4_sin_g_mm"]),
];
const SPEED: [Quantity; 1] = [single("speed", &["speed_rpm"])];
const PROBES: [Quantity; 8] = [
    single("probe 1", &["p1_cos_um", "p1_sin_um"]),
    single("probe 2", &["p2_cos_um", "p2_sin_um"]),
    single("probe 3", &["p3_cos_um", "p3_sin_um"]),
    single("probe 4", &["p4_cos_um", "p4_sin_um"]),
    single("probe 5", &["p5_cos_um", "p5_sin_um"]),
    single("probe 6", &["p6_cos_um", "p6_sin_um"]),
    single("probe 7", &["p7_cos_um", "p7_sin_um"]),
    single("probe 8", &["p8_cos_um", "p8_sin_um"]),
];

/// Of each probe, m; none where it was lost.
type Phasors = Vec<Option<Complex<f64>>>;

/// A period and how it is told.
struct Period {
    from_us: i64,
    to_us: i64,
}

impl Period {
    /// Unit of its axis, µs.
    fn unit(&self) -> (f64, &'static str) {
        match (self.to_us - self.from_us) as f64 / US_AN_HOUR {
            hours if hours <= LONGEST_IN_HOURS => (US_AN_HOUR, "h"),
            _ => (24.0 * US_AN_HOUR, "days"),
        }
    }

    /// Where a moment is on the axis: what was is before zero.
    fn place(&self, time_us: i64) -> f64 {
        (time_us - self.to_us) as f64 / self.unit().0
    }
}

/// The figures of the monitor with this number, over the hours before now. `rotor` is its machine, where that is stated.
///
/// # Errors
/// If the store cannot be read.
pub fn figures(
    connection: &Connection,
    source: i64,
    rotor: Option<&Rotor>,
    hours: f64,
    now_us: i64,
) -> Result<String> {
    let period = Period { from_us: now_us - (hours * US_AN_HOUR) as i64, to_us: now_us };
    let names = Names::of(rotor);
    let mut figures = Vec::new();
    let flags = flags(connection, source, &period)?;
    let tables: [(&str, &str, &str, &[Quantity], &str); 4] = [
        (
            "Residual",
            "residual, µm 0-pk",
            "result",
            &RESIDUAL,
            "What the model does not explain. Triangles: the flag rose.",
        ),
        ("Unbalance", "unbalance, g·mm", "result", &UNBALANCE, "Amount in each plane of the model."),
        ("Vibration", "1x, µm 0-pk", "reading", &PROBES, "What the probes see at running speed."),
        ("Speed", "speed, rpm", "reading", &SPEED, ""),
    ];
    for (title, unit, table, quantities, caption) in tables {
        let stretches = of(connection, (table, source), quantities, (period.from_us, period.to_us))?;
        let mut drawn = drawn(&period, quantities, &stretches, unit);
        let [probes, planes] = names.counts();
        match title {
            "Vibration" if probes == drawn.curves.len() => rename(&mut drawn, |number| names.probe(number)),
            "Unbalance" if planes == drawn.curves.len() => rename(&mut drawn, |number| names.plane(number)),
            _ => {}
        }
        if title == "Residual" {
            drawn.flags.clone_from(&flags);
        }
        if !drawn.curves.is_empty() {
            let mut chart = trend(&drawn);
            mark_lonely(&mut chart, &drawn);
            figures.push(Figure::new(title, caption, chart));
        }
    }
    let text = if figures.is_empty() {
        "Nothing was recorded in this period.".into()
    } else {
        format!(
            "Until {}. A curve has {STRETCHES} points, each the mean of up to {MOST_ROWS} values. The band shows minimum and maximum of the first \
             curve. A gap means that nothing was recorded.",
            moment(now_us)
        )
    };
    let trends = Section { heading: "Trends".into(), paragraphs: vec![text], figures, ..Section::default() };
    Ok(page("Over time", None, &[trends, orbits(connection, source, rotor)?], |_| Vec::new()))
}

/// When the flag rose, in the unit of [`Period::place`].
fn flags(connection: &Connection, source: i64, period: &Period) -> Result<Vec<f64>> {
    let sql = "SELECT time_us FROM state WHERE source = ? AND time_us > ? AND time_us <= ? AND state = 'flagged' AND clock_doubtful = 0";
    let mut statement = connection.prepare(sql)?;
    let all = statement.query_map((source, period.from_us, period.to_us), |row| row.get(0))?;
    all.map(|time_us| Ok(period.place(time_us?))).collect()
}

/// A curve a quantity that is there, with gaps where nothing was recorded.
fn drawn(period: &Period, quantities: &[Quantity], stretches: &[Stretch], unit: &str) -> Trend {
    let mut drawn = Trend {
        along: format!("time before now, {}", period.unit().1),
        quantity: unit.into(),
        ..Trend::default()
    };
    for (number, quantity) in quantities.iter().enumerate() {
        let at = |stretch: &Stretch| (period.place(stretch.at_us), stretch.spreads[number]);
        if stretches.iter().all(|stretch| stretch.spreads[number].is_none()) {
            continue;
        }
        if drawn.curves.is_empty() {
            let band = stretches.iter().map(at).map(|(at, spread)| {
                spread.map_or([at, f64::NAN, f64::NAN], |spread| [at, spread.least, spread.most])
            });
            drawn.bands = vec![(format!("{}, minimum to maximum", quantity.name), band.collect())];
        }
        let curve = stretches.iter().map(at).map(|(at, spread)| (at, spread.map_or(f64::NAN, |s| s.mean)));
        drawn.curves.push((quantity.name.into(), curve.collect()));
    }
    drawn
}

/// A value between two gaps is no line and would not be seen.
fn mark_lonely(chart: &mut Chart, drawn: &Trend) {
    let columns = [Column::of_axis(&drawn.along), Column::of_axis(&drawn.quantity)];
    for (number, (name, points)) in drawn.curves.iter().enumerate() {
        let is_there =
            |place: Option<usize>| place.and_then(|i| points.get(i)).is_some_and(|p| p.1.is_finite());
        let is_lonely =
            |i: &usize| is_there(Some(*i)) && !is_there(i.checked_sub(1)) && !is_there(Some(i + 1));
        let lonely = (0..points.len()).filter(is_lonely).map(|i| [points[i].0, points[i].1]);
        chart.draw(0, name, Look::Dots(number), &columns, lonely);
    }
}

/// Curves as the machine's file calls them, by their number from 1.
fn rename(drawn: &mut Trend, name: impl Fn(u8) -> String) {
    for ((own, _), number) in drawn.curves.iter_mut().zip(1..) {
        *own = name(number);
    }
    if let Some((own, _)) = drawn.bands.first_mut() {
        *own = format!("{}, minimum to maximum", name(1));
    }
}

/// The orbit of the last reading at each bearing with two probes.
fn orbits(connection: &Connection, source: i64, rotor: Option<&Rotor>) -> Result<Section> {
    let mut section = Section { heading: "Orbits".into(), ..Section::default() };
    let Some(rotor) = rotor else {
        section.paragraphs = vec![
            "Which machine it is was not stated, and so nobody knows where its probes look: rotor-edge-plant machine STORE \
             PLANT/BUS/NODE rotor.toml"
                .into(),
        ];
        return Ok(section);
    };
    let columns: Vec<&str> = PROBES.iter().flat_map(|probe| probe.columns.iter().copied()).collect();
    let sql = format!(
        "SELECT time_us, speed_rpm, probes, {} FROM reading WHERE source = ? AND speed_rpm IS NOT NULL \
         ORDER BY epoch DESC, sequence DESC LIMIT 1",
        columns.join(", ")
    );
    let row = |row: &rusqlite::Row| {
        let mut probes = Vec::new();
        for probe in 0..usize::from(row.get::<_, u8>(2)?) {
            let parts = row.get::<_, Option<f64>>(3 + 2 * probe)?.zip(row.get(4 + 2 * probe)?);
            probes.push(parts.map(|(cos_um, sin_um)| phasor_m(cos_um, sin_um)));
        }
        Ok((row.get::<_, i64>(0)?, row.get::<_, f64>(1)?, probes))
    };
    let last: Option<(i64, f64, Phasors)> = connection.query_row(&sql, [source], row).optional()?;
    let Some((time_us, speed_rpm, probes)) = last.filter(|(.., probes)| probes.len() == rotor.probe.len())
    else {
        section.paragraphs = vec!["No reading of as many probes as the drawing has.".into()];
        return Ok(section);
    };
    for pair in probe_pairs(rotor) {
        let [Some(a), Some(b)] = pair.probes.map(|probe| probes[probe]) else { continue };
        let panel = OrbitPanel { speed_rpm, measured_m: pair.xy([a, b]), models_m: Vec::new() };
        let title = format!("At {}", rotor.bearing[pair.bearing].name);
        section.figures.push(Figure::new(
            title,
            "The 1x part of the path of the shaft.",
            orbit(&[], &[panel]),
        ));
    }
    section.paragraphs = vec![format!("The reading of {}, seen along the shaft.", moment(time_us))];
    Ok(section)
}
