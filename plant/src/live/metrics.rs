//! Numbers in Prometheus' text format.

use std::fmt::Write as _;

use super::glance::Glance;

/// As names of labels may hold anything.
fn label(value: &str) -> String {
    value.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")
}

/// One metric: name, what it is, and its value for a monitor that has one.
type Metric = (&'static str, &'static str, fn(&Glance) -> Option<f64>);

const METRICS: [Metric; 6] = [
    ("rotor_edge_age_seconds", "Since the last sign of life.", |g| g.age_s),
    ("rotor_edge_silent", "1 if nothing is heard any more.", |g| {
        Some(f64::from(u8::from(g.state_now == "silent")))
    }),
    (
        "rotor_edge_acknowledged",
        "1 if somebody has seen the state that it is in and that needs somebody.",
        |g| g.is_alarm.then(|| f64::from(u8::from(g.acknowledged.is_some()))),
    ),
    ("rotor_edge_flagged", "1 if the flag was up in the last result.", |g| {
        g.newest.flagged.map(|flagged| f64::from(u8::from(flagged)))
    }),
    ("rotor_edge_residual_micrometres", "Residual of the last result.", |g| g.newest.residual_um),
    ("rotor_edge_residual_ratio", "Residual over the sum of the features.", |g| g.newest.ratio),
];

/// All metrics of all monitors.
pub fn text(all: &[Glance]) -> String {
    let mut text = String::new();
    let labels = |g: &Glance| {
        let newest = &g.newest;
        format!("plant=\"{}\",bus=\"{}\",node=\"{}\"", label(&newest.plant), label(&newest.bus), newest.node)
    };
    for (name, help, value) in METRICS {
        // writing to a String cannot fail
        let _ = writeln!(text, "# HELP {name} {help}\n# TYPE {name} gauge");
        for glance in all {
            if let Some(value) = value(glance) {
                let _ = writeln!(text, "{name}{{{}}} {value}", labels(glance));
            }
        }
    }
    let _ = writeln!(
        text,
        "# HELP rotor_edge_state 1 for the state that a monitor is in.\n# TYPE rotor_edge_state gauge"
    );
    for glance in all {
        let _ =
            writeln!(text, "rotor_edge_state{{{},state=\"{}\"}} 1", labels(glance), label(&glance.state_now));
    }
    text
}
