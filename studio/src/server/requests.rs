//! What the page asks for.

use std::path::PathBuf;

use anyhow::{Context as _, Result, anyhow, bail};
use axum::body::Bytes;
use axum::extract::{Path, Query, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse as _, Response};
use rotor_edge_desktop::measurement;
use rotor_edge_desktop::whole_file;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::report;
use crate::session::files::{InputFiles, NamedText, SlowRollInput};
use crate::session::mask::Mask;
use crate::session::parameters::{self, ParameterId};
use crate::session::{Session, stored};
use crate::view::{self, FailureView};
use crate::workbench::{Bench, Workbench};

/// What is to be opened.
#[derive(Deserialize)]
#[serde(tag = "what", rename_all = "snake_case")]
enum Opening {
    Sample,
    /// A machine with something hidden: of these files, of the session that is open, or of the sample.
    Hidden {
        seed: Option<u64>,
        files: Option<InputPaths>,
    },
    /// The session in whose machine something was hidden.
    BeforeHidden,
    Paths(InputPaths),
    /// The file of a session.
    SessionPath {
        path: PathBuf,
    },
    /// A session that was left behind unsaved.
    Recovered {
        name: String,
    },
    /// Files that were dropped or chosen: a rotor's file with measurements, or a session.
    Files {
        files: Vec<NamedText>,
    },
}

#[derive(Deserialize)]
struct InputPaths {
    rotor: PathBuf,
    data: PathBuf,
    /// A run of the data or a file; none if it is empty.
    #[serde(default)]
    slow_roll: String,
}

impl InputPaths {
    fn read(&self) -> Result<InputFiles> {
        let slow_roll = SlowRollInput::named(&self.slow_roll)?;
        Ok(InputFiles { slow_roll, ..InputFiles::read(&self.rotor, &self.data)? })
    }
}

#[derive(Deserialize)]
struct PlacedEffect {
    effect: String,
    at: Option<String>,
}

#[derive(Deserialize)]
struct Moving {
    id: ParameterId,
    /// Where on its slider, 0 to 1.
    share: f64,
    /// The figures that are looked at.
    tab: String,
}

#[derive(Deserialize)]
struct Holding {
    id: ParameterId,
    is_held: bool,
}

#[derive(Deserialize)]
struct Going {
    branch: Option<usize>,
}

#[derive(Deserialize)]
struct Dismissing {
    /// Name of a recovery file.
    name: String,
}

#[derive(Deserialize)]
struct Saving {
    what: Saved,
    path: PathBuf,
    /// Whether a file that is there may be written over.
    #[serde(default)]
    overwrite: bool,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "snake_case")]
enum Saved {
    Rotor,
    Report,
    Session,
    /// The readings that are not left out.
    Readings,
}

#[derive(Deserialize)]
pub struct TabQuery {
    tab: String,
}

/// What becomes of a slider that is moved.
#[derive(Serialize)]
struct MovedAnswer {
    /// The number with its unit.
    text: String,
    figures: view::figures::FiguresView,
}

/// `GET api/state`
pub async fn state(State(bench): State<Workbench>) -> Response {
    answered(blocking(move || view::state(&mut bench.lock())).await)
}

/// `GET api/figures?tab=`
pub async fn figures(State(bench): State<Workbench>, Query(query): Query<TabQuery>) -> Response {
    answered(blocking(move || view::figures::of_tab(&mut bench.lock(), &query.tab)).await)
}

/// `POST api/…`
pub async fn change(
    State(bench): State<Workbench>,
    Path((_, change)): Path<(String, String)>,
    body: Bytes,
) -> Response {
    match change.as_str() {
        "move" => answered(blocking(move || moved(&bench, &body)).await),
        "save" => saved(&bench, body).await,
        _ => answered(blocking(move || changed(&bench, &change, &body)).await),
    }
}

/// Work that takes a while, where nobody waits for it who asks for something else.
async fn blocking<T: Send + 'static>(work: impl FnOnce() -> Result<T> + Send + 'static) -> Result<T> {
    tokio::task::spawn_blocking(work).await.context("the request was not worked out to its end")?
}

fn answered(answer: Result<impl Serialize>) -> Response {
    match answer.and_then(|answer| Ok(serde_json::to_string(&answer)?)) {
        Ok(text) => ([(header::CONTENT_TYPE, "application/json")], text).into_response(),
        Err(error) => refused(StatusCode::UNPROCESSABLE_ENTITY, &FailureView::of(&error)),
    }
}

fn refused(status: StatusCode, failure: &FailureView) -> Response {
    let text = serde_json::to_string(failure).unwrap_or_default();
    (status, [(header::CONTENT_TYPE, "application/json")], text).into_response()
}

fn asked<T: DeserializeOwned>(body: &[u8]) -> Result<T> {
    serde_json::from_slice(body)
        .map_err(|error| anyhow!("the request cannot be read ({error}); load the page again"))
}

/// One change, and the state after it.
fn changed(bench: &Workbench, change: &str, body: &[u8]) -> Result<view::StateView> {
    match change {
        "open" => {
            let opening = asked(body)?;
            bench.change(|bench| open(bench, opening))?;
        }
        "preview" => {
            let PlacedEffect { effect, at } = asked(body)?;
            bench.look_at(&effect, at.as_deref())?;
        }
        "add" => {
            let PlacedEffect { effect, at } = asked(body)?;
            bench.change(|bench| add(bench, &effect, at.as_deref()))?;
        }
        "plan" => bench.plan()?,
        "dismiss" => {
            let Dismissing { name } = asked(body)?;
            bench.change(|bench| bench.dismiss(&name))?;
        }
        _ => bench.change(|bench| small(bench, change, body))?,
    }
    view::state(&mut bench.lock())
}

/// Changes that cost nothing but a fit of the model that is there after them.
fn small(bench: &mut Bench, change: &str, body: &[u8]) -> Result<()> {
    match change {
        "fit" => {
            let fitted = bench.current()?.fit.best.rotor.clone();
            let before = bench.opened()?.clone();
            bench.opened_mut()?.fit(&fitted)?;
            return settled(bench, before);
        }
        "leave_out" => {
            let mask: Mask = asked(body)?;
            let before = bench.opened()?.clone();
            bench.opened_mut()?.leave_out(mask)?;
            return settled(bench, before);
        }
        _ => {}
    }
    let session = bench.opened_mut()?;
    match change {
        "forget" => session.forget_preview(),
        "undo" => session.undo(),
        "redo" => session.redo(),
        "put_back" => session.put_back(),
        "hold" => {
            let Holding { id, is_held } = asked(body)?;
            session.held.retain(|held| *held != id);
            if is_held {
                session.held.push(id);
            }
        }
        "branch" => match asked::<Going>(body)?.branch {
            Some(branch) => session.go_to(branch)?,
            None => session.fork(),
        },
        "reveal" => session.uncover()?,
        _ => bail!("there is no change \"{change}\"; load the page again"),
    }
    Ok(())
}

/// The current model must fit: where it cannot, the session is as it was.
fn settled(bench: &mut Bench, before: Session) -> Result<()> {
    if let Err(error) = bench.current() {
        bench.session = Some(before);
        return Err(error);
    }
    Ok(())
}

/// As the command: a model that its own data refuse is none.
fn add(bench: &mut Bench, effect: &str, at: Option<&str>) -> Result<()> {
    let before = bench.opened()?.clone();
    bench.opened_mut()?.add(effect, at)?;
    settled(bench, before)
}

fn open(bench: &mut Bench, opening: Opening) -> Result<()> {
    let session = match opening {
        Opening::Sample => Session::open(InputFiles::sample())?,
        Opening::Hidden { seed, files } => {
            let seed = seed.map_or_else(random_seed, Ok)?;
            let files = match (files, &bench.session) {
                (Some(paths), _) => paths.read()?,
                (None, Some(session)) => session.files.clone(),
                (None, None) => InputFiles::sample(),
            };
            return bench.practise(Session::hidden(&files, seed)?);
        }
        Opening::BeforeHidden => return bench.end_practice(),
        Opening::Paths(paths) => Session::open(paths.read()?)?,
        Opening::SessionPath { path } => return bench.open_session(&path),
        Opening::Recovered { name } => return bench.recover(&name),
        Opening::Files { files } => match files.as_slice() {
            [NamedText { name, text }] if name.ends_with(".json") => stored::parse(name, text)?,
            _ => Session::open(InputFiles::dropped(files)?)?,
        },
    };
    bench.begin(session)
}

/// One that a person can write down.
fn random_seed() -> Result<u64> {
    let mut bytes = [0; 4];
    getrandom::fill(&mut bytes).map_err(|e| anyhow!("no random numbers ({e})"))?;
    Ok(u64::from(u32::from_le_bytes(bytes)) % 1_000_000)
}

/// Moves a number: the model is evaluated with it, and nothing is fitted.
fn moved(bench: &Workbench, body: &[u8]) -> Result<MovedAnswer> {
    let Moving { id, share, tab } = asked(body)?;
    let mut bench = bench.lock();
    let fitted = bench.current()?.fit.best.rotor.clone();
    let parameter = parameters::all(&fitted).into_iter().find(|p| p.id == id);
    let parameter = parameter.context("the model has no such parameter; load the page again")?;
    let value = parameter.at(share);
    let before = bench.opened()?.moved.clone();
    bench.opened_mut()?.move_to(&fitted, &id, value)?;
    match view::figures::again(&mut bench, &tab) {
        Ok(figures) => Ok(MovedAnswer { text: parameter.text(value), figures }),
        Err(error) => {
            bench.opened_mut()?.moved = before;
            Err(error)
        }
    }
}

async fn saved(bench: &Workbench, body: Bytes) -> Response {
    let bench = bench.clone();
    let saving: Saving = match asked(&body) {
        Ok(saving) => saving,
        Err(error) => return refused(StatusCode::BAD_REQUEST, &FailureView::of(&error)),
    };
    let path = saving.path.clone();
    let allowed = bench.lock().may_write(&path, saving.overwrite);
    if let Err(error) = allowed {
        let failure = FailureView { exists: true, ..FailureView::of(&error) };
        return refused(StatusCode::CONFLICT, &failure);
    }
    answered(blocking(move || save(&bench, &saving)).await)
}

fn save(bench: &Workbench, saving: &Saving) -> Result<view::StateView> {
    let path = &saving.path;
    if path.as_os_str().is_empty() {
        bail!("expected the name of a file to write to");
    }
    let mut bench = bench.lock();
    match saving.what {
        Saved::Rotor => whole_file::write(path, bench.opened()?.current().file.as_bytes())?,
        Saved::Session => bench.keep_session_in(path)?,
        Saved::Report => report::write(&mut bench, path)?,
        Saved::Readings => whole_file::write(path, &kept_readings(bench.opened()?)?)?,
    }
    bench.version += 1;
    view::state(&mut bench)
}

/// The readings that are not left out, as a file.
fn kept_readings(session: &Session) -> Result<Vec<u8>> {
    let model = session.model()?;
    let names: Vec<&str> = model.rotor.probe.iter().map(|p| p.name.as_str()).collect();
    let mut file = Vec::new();
    measurement::write_exactly(&mut file, &names, &model.readings)?;
    Ok(file)
}
