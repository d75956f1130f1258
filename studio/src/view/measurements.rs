//! What would tell the candidates apart.

use rotor_edge::answers::diagnose::AdviceAnswer;
use rotor_edge::answers::plan::NextMeasurement;
use rotor_edge::render;
use rotor_edge::scale::three_digits;
use serde::Serialize;

use crate::session::analysis::DiagnosisState;
use crate::workbench::{Bench, PlanState};

/// Further measurements that are listed.
const LISTED: usize = 6;

#[derive(Debug, Serialize)]
pub struct FurtherView {
    /// Candidates that the data cannot tell apart.
    rivals: Vec<String>,
    /// Measurements that would, as `diagnose` says them.
    advice: Vec<String>,
    is_asked: bool,
    /// Steps done and planned, of the diagnosis while the plan waits for it.
    progress: Option<[usize; 2]>,
    /// What would decide between the rivals, as `plan` says it.
    decision: Option<String>,
    /// Measurements that would help most, as `plan` says them.
    next: Vec<String>,
    error: Option<String>,
}

pub fn view(bench: &Bench, diagnosis: Option<&DiagnosisState>) -> FurtherView {
    let found = match diagnosis {
        Some(DiagnosisState::Found(found)) => Some(found),
        _ => None,
    };
    let plan = bench.plan();
    let planned = match &plan {
        Some(PlanState::Found(plan)) => Some(plan),
        _ => None,
    };
    let bits = |n: &NextMeasurement| format!("{} ({} bits)", n.measurement, three_digits(n.gain));
    FurtherView {
        rivals: found.and_then(|f| f.indistinguishable.first().cloned()).unwrap_or_default(),
        advice: found.map(|f| f.advice.iter().take(LISTED).map(sentence).collect()).unwrap_or_default(),
        is_asked: plan.is_some(),
        progress: match &plan {
            Some(PlanState::Running(progress)) => Some(progress.now()),
            Some(PlanState::Waiting) => match diagnosis {
                Some(DiagnosisState::Running(progress)) => Some(progress.now()),
                _ => Some([0, 0]),
            },
            _ => None,
        },
        decision: planned.and_then(|plan| plan.between.as_ref()).map(render::plan::decision),
        next: planned.map(|plan| plan.next.iter().take(LISTED).map(bits).collect()).unwrap_or_default(),
        error: match plan {
            Some(PlanState::Failed(why)) => Some(why),
            _ => None,
        },
    }
}

fn sentence(a: &AdviceAnswer) -> String {
    let repeats = if a.repeats > 1 { format!(", {} times", a.repeats) } else { String::new() };
    format!("{}{repeats}: the rivals differ by {:.1} standard deviations", a.measurement, a.separation_sd)
}
