//! The tables of a comparison.

use rotor_edge_desktop::compare::Comparison;

use super::chance;
use crate::render::document::PageTable;
use crate::scale::{number, three_digits};

fn table(caption: &str, columns: &[&str], rows: Vec<Vec<String>>) -> PageTable {
    PageTable { caption: caption.into(), columns: columns.iter().map(ToString::to_string).collect(), rows }
}

fn percent(share: f64) -> String {
    three_digits(100.0 * share)
}

/// The whole measurement in one table.
pub fn summary(c: &Comparison) -> PageTable {
    let row = |name: &str, value: String, noise: &str| vec![name.to_string(), value, noise.to_string()];
    let rows = vec![
        row("Readings", number(c.readings as f64, 0), ""),
        row("Measured values", number(c.values as f64, 0), ""),
        row("Residual, sum, µm 0-pk", three_digits(c.residual_um.sum), ""),
        row("Residual, mean of a reading, µm 0-pk", three_digits(c.residual_um.mean), ""),
        row("Residual, of all features, %", percent(c.residual_ratio), ""),
        row("Relative error, %", percent(c.relative_error), ""),
        row("χ² per value", three_digits(c.chi2_per_value), "1"),
        row("Chance that noise does that", chance(c.chi2_p_value), "over 0.5 %"),
        row("Correlation of neighbouring speeds", number(c.neighbours.correlation, 2), "0"),
        row("Chance that noise does that", chance(c.neighbours.p_value), "over 0.5 %"),
    ];
    table("Model against measurement", &["", "here", "noise alone"], rows)
}

/// Two models of the same data, and every probe of each.
pub fn change(before: &Comparison, after: &Comparison) -> PageTable {
    let row = |name: String, of: &dyn Fn(&Comparison) -> String, noise: &str| {
        vec![name, of(before), of(after), noise.to_string()]
    };
    let mut rows = vec![
        row("Relative error, %".into(), &|c| percent(c.relative_error), ""),
        row("χ² per value".into(), &|c| three_digits(c.chi2_per_value), "1"),
        row("Correlation of neighbouring speeds".into(), &|c| number(c.neighbours.correlation, 2), "0"),
        row("Residual, mean of a reading, µm 0-pk".into(), &|c| three_digits(c.residual_um.mean), ""),
    ];
    rows.extend(before.by_probe.iter().enumerate().map(|(i, p)| {
        let of = |c: &Comparison| c.by_probe.get(i).map_or(String::new(), |p| percent(p.relative_error));
        row(format!("Probe {}, relative error, %", p.probe), &of, "")
    }));
    table(
        "The most probable fit of both models against the measurement",
        &["", "before", "after", "noise alone"],
        rows,
    )
}

pub fn places(c: &Comparison) -> Vec<PageTable> {
    let mut tables = vec![by_probe(c)];
    if !c.whirl.is_empty() {
        tables.push(whirl(c));
    }
    if c.by_run.len() > 1 {
        tables.push(by_run(c));
    }
    tables
}

fn by_probe(c: &Comparison) -> PageTable {
    let rows = c.by_probe.iter().map(|p| {
        let of_probe = c.neighbours.series.iter().filter(|s| s.probe == p.probe);
        let most = of_probe.max_by(|a, b| a.z_score.total_cmp(&b.z_score));
        vec![
            p.probe.clone(),
            three_digits(p.residual_um),
            percent(p.relative_error),
            three_digits(p.chi2_per_value),
            most.map_or(String::new(), |s| number(s.z_score, 1)),
        ]
    });
    let columns = ["Probe", "residual, µm 0-pk", "error, %", "χ² per value", "neighbours, σ"];
    table(
        "By probe; correlation of neighbouring speeds in the run where it is largest",
        &columns,
        rows.collect(),
    )
}

fn whirl(c: &Comparison) -> PageTable {
    let rows = c.whirl.iter().flat_map(|w| {
        [("forward", &w.forward), ("backward", &w.backward)].map(|(way, part)| {
            vec![
                format!("{} {way}", w.bearing),
                three_digits(part.measured_um),
                three_digits(part.model_um),
                three_digits(part.error_um),
                number(part.error_sigmas, 1),
            ]
        })
    });
    let columns = ["Bearing, whirl", "measured, µm 0-pk", "model, µm 0-pk", "error, µm 0-pk", "error, σ"];
    table("By direction of whirl: radii, root mean square over the readings", &columns, rows.collect())
}

fn by_run(c: &Comparison) -> PageTable {
    let rows = c.by_run.iter().map(|r| {
        vec![
            r.run.clone().unwrap_or_else(|| "unnamed".into()),
            r.readings.to_string(),
            three_digits(r.residual_um),
            percent(r.relative_error),
            three_digits(r.chi2_per_value),
        ]
    });
    table("By run", &["Run", "readings", "residual, µm 0-pk", "error, %", "χ² per value"], rows.collect())
}
