//! The session as the page shows it: plain data, all sentences and numbers made here.

pub mod commands;
pub mod figures;
mod measurements;
mod parameters;
mod places;

use anyhow::Result;
use rotor_edge::answers::diagnose::{CandidateAnswer, FittedAnswer};
use rotor_edge::command::shown;
use rotor_edge::render::fitted::{machine, steps};
use rotor_edge::render::{ComparedModel, Drawing, diagnose, findings, verdict};
use rotor_edge::scale::three_digits;
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::significance::percent;
use serde::Serialize;

use crate::session::analysis::{Analysis, DiagnosisState};
use crate::session::mask::Mask;
use crate::session::practice::Reveal;
use crate::session::step::{Change, Step, effect_words};
use crate::session::{BRANCHES, Session};
use crate::workbench::Bench;
use measurements::FurtherView;
use parameters::ParameterView;
use places::PlaceView;

/// Everything that the page shows but the figures.
#[derive(Debug, Serialize)]
pub struct StateView {
    pub version: u64,
    /// `None` before anything is open.
    pub session: Option<SessionView>,
    /// Sessions that were left behind unsaved.
    unsaved: Vec<UnsavedView>,
}

#[derive(Debug, Serialize)]
struct UnsavedView {
    name: String,
    sentence: String,
    is_usable: bool,
}

#[derive(Debug, Serialize)]
pub struct SessionView {
    machine: String,
    rotor_file: String,
    data_file: String,
    verdict: VerdictView,
    steps: Vec<StepView>,
    /// The fall of the error as an element.
    fall: String,
    can_undo: bool,
    can_redo: bool,
    branches: Vec<BranchView>,
    /// The machine to scale as an element.
    drawing: String,
    places: Vec<PlaceView>,
    preview: Option<PreviewView>,
    /// The effect that is being fitted to be looked at, in words.
    looking: Option<String>,
    parameters: Vec<ParameterView>,
    is_moved: bool,
    mask: MaskView,
    practice: Option<PracticeView>,
    further: FurtherView,
    /// The command lines that do the same.
    commands: Vec<String>,
    session_file: Option<String>,
    /// Why the session's file is not up to date.
    not_saved: Option<String>,
    tabs: Vec<String>,
}

#[derive(Debug, Serialize)]
struct VerdictView {
    /// `adequate`, `missing`, …; `working` before that is known, `failed` where it cannot be.
    word: String,
    sentence: String,
    remarks: Vec<String>,
    /// Fits done and planned.
    progress: Option<[usize; 2]>,
    error: String,
    noise: String,
    chi2: String,
}

#[derive(Debug, Serialize)]
struct StepView {
    label: String,
    error: String,
    is_current: bool,
    /// Whether it was undone.
    is_ahead: bool,
}

#[derive(Debug, Serialize)]
struct BranchView {
    name: &'static str,
    is_current: bool,
    label: String,
    error: String,
    verdict: String,
}

#[derive(Debug, Serialize)]
struct PreviewView {
    effect: String,
    at: Option<String>,
    words: String,
    /// Parameters as fitted, one a line.
    lines: Vec<String>,
    gain: String,
    explanation: Option<String>,
}

#[derive(Debug, Serialize)]
struct MaskView {
    chosen: Mask,
    runs: Vec<String>,
    probes: Vec<String>,
    /// Slowest and fastest speed of all readings, rpm.
    speeds_rpm: [f64; 2],
    /// How well the model predicts what is left out.
    sentence: Option<String>,
}

#[derive(Debug, Serialize)]
struct PracticeView {
    /// Whether there are measurements to go back to.
    can_end: bool,
    is_revealed: bool,
    reveal: Option<Reveal>,
}

/// The whole state.
///
/// # Errors
/// If a model of the session cannot be fitted.
pub fn state(bench: &mut Bench) -> Result<StateView> {
    let version = bench.version;
    let unsaved = bench.offers.iter().map(|offer| UnsavedView {
        name: offer.name.clone(),
        sentence: offer.sentence.clone(),
        is_usable: offer.is_usable,
    });
    let unsaved = unsaved.collect();
    let Some(session) = bench.session.clone() else {
        return Ok(StateView { version, session: None, unsaved });
    };
    let step = session.current().clone();
    let analysis = bench.analysis(&step)?;
    let taken = session.branches[session.branch].taken();
    let fits: Vec<_> = taken.iter().map(|step| bench.analysis(step)).collect::<Result<_>>()?;
    let models: Vec<ComparedModel> = fits
        .iter()
        .zip(taken)
        .map(|(fit, step)| {
            let mut model = fit.fit.model.clone();
            model.prediction.label = step.label();
            model
        })
        .collect();
    let diagnosis = bench.diagnosis(&step);
    let candidates: &[CandidateAnswer] = match &diagnosis {
        Some(DiagnosisState::Found(found)) => &found.candidates,
        _ => &[],
    };
    let (kind, at) = match session.preview.as_ref().map(|p| &p.change) {
        Some(Change::Added { effect, at }) => (Some(effect.as_str()), at.as_deref()),
        _ => (None, None),
    };
    let main: Vec<&FittedAnswer> = candidates
        .iter()
        .filter(|c| kind == Some(c.effect) && at == c.at.as_deref())
        .map(|c| &c.fitted)
        .collect();
    let branch = &session.branches[session.branch];
    Ok(StateView {
        version,
        unsaved,
        session: Some(SessionView {
            machine: session.given.name.clone(),
            rotor_file: session.files.rotor.name.clone(),
            data_file: session.files.data.name.clone(),
            verdict: verdict_view(&analysis, diagnosis.as_ref()),
            steps: step_views(bench, &session)?,
            fall: markup(&steps(&models, analysis.noise_error).drawing),
            can_undo: branch.at() > 0,
            can_redo: branch.can_redo(),
            branches: branch_views(bench, &session)?,
            drawing: markup(&machine(&analysis.fit.best.rotor, candidates, &main, None).drawing),
            places: places::all(
                &session,
                &step.rotor,
                candidates,
                analysis.fit.model.comparison.relative_error,
            ),
            preview: preview(bench, &session, &analysis, candidates)?,
            looking: session.looking.as_ref().map(|l| effect_words(&l.effect, l.at.as_deref())),
            parameters: parameters::all(&session, &analysis.fit.best.rotor),
            is_moved: session.moved.is_some(),
            mask: mask_view(&session, &analysis),
            practice: session.practice.as_ref().map(|practice| PracticeView {
                can_end: bench.is_practising(),
                is_revealed: practice.is_revealed,
                reveal: session.reveal.clone(),
            }),
            further: measurements::view(bench, diagnosis.as_ref()),
            commands: commands::lines(&session),
            session_file: bench.session_file().map(|path| path.display().to_string()),
            not_saved: bench.not_saved.clone(),
            tabs: figures::tabs(&session),
        }),
    })
}

/// A drawing that needs no script.
fn markup(drawing: &Drawing) -> String {
    match drawing {
        Drawing::Markup(markup) => markup.clone(),
        Drawing::Chart(_) => String::new(),
    }
}

/// A share in percent.
fn per_cent(share: f64) -> String {
    format!("{} %", three_digits(100.0 * share))
}

fn verdict_view(analysis: &Analysis, diagnosis: Option<&DiagnosisState>) -> VerdictView {
    let comparison = &analysis.fit.model.comparison;
    let preliminary = || verdict(comparison).into_iter().next().unwrap_or_default();
    let (word, sentence, remarks, progress) = match diagnosis {
        Some(DiagnosisState::Found(found)) => {
            let remarks = diagnose::remarks(found).collect();
            (found.verdict.to_string(), found.summary.clone(), remarks, None)
        }
        Some(DiagnosisState::Failed(why)) => ("failed".into(), why.clone(), Vec::new(), None),
        Some(DiagnosisState::Running(progress)) => {
            ("working".into(), preliminary(), Vec::new(), Some(progress.now()))
        }
        None => ("working".into(), preliminary(), Vec::new(), None),
    };
    VerdictView {
        word,
        sentence,
        remarks,
        progress,
        error: per_cent(comparison.relative_error),
        noise: per_cent(analysis.noise_error),
        chi2: three_digits(comparison.chi2_per_value),
    }
}

fn step_views(bench: &mut Bench, session: &Session) -> Result<Vec<StepView>> {
    let branch = &session.branches[session.branch];
    let mut views = Vec::new();
    for (k, step) in branch.all().iter().enumerate() {
        let error = bench.analysis(step)?.fit.model.comparison.relative_error;
        views.push(StepView {
            label: step.label(),
            error: per_cent(error),
            is_current: k == branch.at(),
            is_ahead: k > branch.at(),
        });
    }
    Ok(views)
}

fn branch_views(bench: &mut Bench, session: &Session) -> Result<Vec<BranchView>> {
    let mut views = Vec::new();
    for (k, branch) in session.branches.iter().enumerate() {
        let step = branch.current();
        let error = bench.analysis(step)?.fit.model.comparison.relative_error;
        let verdict = match bench.diagnosis(step) {
            Some(DiagnosisState::Found(found)) => found.verdict.replace('_', " "),
            Some(DiagnosisState::Failed(_)) => "not diagnosed".into(),
            _ => "not known yet".into(),
        };
        let added: Vec<String> =
            branch.taken().iter().filter(|step| step.change != Change::Given).map(Step::label).collect();
        let label = if added.is_empty() { "as it was".into() } else { added.join(", ") };
        let is_current = k == session.branch;
        views.push(BranchView { name: BRANCHES[k], is_current, label, error: per_cent(error), verdict });
    }
    Ok(views)
}

/// The effect that is looked at, as its fit has it.
fn preview(
    bench: &mut Bench,
    session: &Session,
    before: &Analysis,
    candidates: &[CandidateAnswer],
) -> Result<Option<PreviewView>> {
    let Some(step) = &session.preview else { return Ok(None) };
    let Change::Added { effect, at } = &step.change else { return Ok(None) };
    let after = bench.analysis(step)?;
    let known = candidates.iter().find(|c| c.effect == effect && c.at == *at);
    let lines = match known {
        Some(candidate) if !candidate.fitted.parameters.is_empty() => findings::parameters(&candidate.fitted),
        _ => values(&after.fit.best.rotor, effect, at.as_deref()),
    };
    let error = |a: &Analysis| per_cent(a.fit.model.comparison.relative_error);
    Ok(Some(PreviewView {
        effect: effect.clone(),
        at: at.clone(),
        words: step.words(),
        lines,
        gain: format!("error {} → {}", error(before), error(&after)),
        explanation: known.map(|c| c.explanation.clone()),
    }))
}

/// Numbers of an effect of a model, one a line.
fn values(rotor: &Rotor, effect: &str, at: Option<&str>) -> Vec<String> {
    let Some(number) = rotor.effect.iter().position(|e| e.kind == effect && e.at.as_deref() == at) else {
        return Vec::new();
    };
    let own = crate::session::parameters::all(rotor).into_iter().filter(|p| p.id.effect() == Some(number));
    own.map(|p| format!("{} = {}", p.name, p.text(p.value))).collect()
}

fn mask_view(session: &Session, analysis: &Analysis) -> MaskView {
    let mut runs: Vec<String> = Vec::new();
    for reading in &session.readings {
        let name = reading.run.clone().unwrap_or_default();
        if !runs.contains(&name) {
            runs.push(name);
        }
    }
    let speeds = || session.readings.iter().map(|r| r.speed_rpm);
    let sentence = analysis.left_out.map(|left| {
        let extrapolated = match left.file_gap > analysis.noise_error {
            true => format!(
                " In the readings that it was fitted to, the model's file is {} from its fit, as errors of the drawing are \
                 extrapolated far: the prediction is no better than that.",
                per_cent(left.file_gap)
            ),
            false => String::new(),
        };
        format!(
            "The model predicts the {} readings with values left out to {}, where noise alone leaves {}; χ² per value {}.{extrapolated}",
            left.readings,
            per_cent(left.error),
            per_cent(left.noise_error),
            three_digits(left.chi2_per_value)
        )
    });
    MaskView {
        chosen: session.mask.clone(),
        runs,
        probes: session.given.probe.iter().map(|p| p.name.clone()).collect(),
        speeds_rpm: [speeds().fold(f64::INFINITY, f64::min), speeds().fold(0.0, f64::max)],
        sentence,
    }
}

/// What a request that failed says.
#[derive(Debug, Serialize)]
pub struct FailureView {
    pub error: String,
    /// Whether the file exists, so that the page can ask whether it may be written over.
    pub exists: bool,
}

impl FailureView {
    pub fn of(error: &anyhow::Error) -> Self {
        Self { error: shown(error), exists: false }
    }
}

/// A probability in words.
fn probable(probability: f64) -> String {
    percent(probability)
}
