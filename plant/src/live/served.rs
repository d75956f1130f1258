//! What a server answers.

use std::convert::Infallible;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context as _, Result};
use axum::extract::{Extension, Form, FromRequest as _, Path as Words, Query, Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{Html, IntoResponse, Redirect, Response};
use flate2::read::GzDecoder;
use futures_util::{Stream, stream};
use maud::{Markup, html};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::rotor_file;
use rotor_edge_web::connection::Peer;
use rotor_edge_web::token::TokenDigest;
use rusqlite::OptionalExtension as _;
use serde::Deserialize;
use tokio::sync::watch;

use super::glance::Glance;
use super::guesses::{Guess, Guesses};
use super::{alarm, history, jobs as job_page, machine as machine_page, metrics, now_us, page, trends};
use crate::item::plain_word;
use crate::store::Store;

/// A page may do nothing but show itself, its figures beside it, listen here, and send its form here.
const POLICY: &str = "default-src 'none'; style-src 'self'; script-src 'self'; connect-src 'self'; img-src data:; \
                      frame-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'";
/// Figures stand in a page of this server; what they may do they say themselves.
const POLICY_OF_FIGURES: &str = "frame-ancestors 'self'";
/// The page of a job may come from another host: it may draw and save, and knows nothing of this server.
const POLICY_OF_REPORTS: &str = "sandbox allow-scripts allow-downloads; frame-ancestors 'none'";
/// What a page shows of the past, h, and what it can be asked for.
const HOURS: [(f64, &str); 5] =
    [(1.0, "hour"), (24.0, "day"), (168.0, "week"), (720.0, "month"), (8_766.0, "year")];
/// Shortest period that is shown if the address states none.
const USUAL_HOURS: f64 = 24.0;
/// Readings that such a period should hold; it is a longer one if necessary.
const USUAL_READINGS: u32 = 10;
/// Longest time that figures can be asked for, h: ten years.
const MOST_HOURS: f64 = 87_600.0;
/// A form that is not whole after so long is refused.
const FORM_TIME: Duration = Duration::from_secs(10);

/// What everybody who answers needs.
#[derive(Clone)]
pub struct Served {
    seen: watch::Receiver<Arc<Vec<Glance>>>,
    store: Arc<Path>,
    token: Option<TokenDigest>,
    guesses: Guesses,
}

/// Plant, bus and node in a path.
pub type MachinePath = Words<(String, String, u8)>;
type PageResult<T = Response> = std::result::Result<T, Failure>;

impl Served {
    /// With what the monitors say now, and the store for the rest.
    pub fn new(seen: watch::Receiver<Arc<Vec<Glance>>>, store: PathBuf, token: Option<&str>) -> Self {
        Self { seen, store: store.into(), token: token.map(TokenDigest::of), guesses: Guesses::default() }
    }

    /// What a look into the store gives, taken where nobody waits for it.
    async fn read<T: Send + 'static>(
        &self,
        look: impl FnOnce(&Store) -> Result<T> + Send + 'static,
    ) -> PageResult<T> {
        let path = self.store.clone();
        let looked = tokio::task::spawn_blocking(move || look(&Store::open_to_read(&path)?));
        Ok(looked.await.context("reading the store was interrupted")??)
    }

    fn glance(&self, (plant, bus, node): &(String, String, u8)) -> PageResult<Glance> {
        let all = self.seen.borrow();
        let is_it = |glance: &&Glance| {
            let newest = &glance.newest;
            plain_word(&newest.plant) == *plant && plain_word(&newest.bus) == *bus && newest.node == *node
        };
        all.iter().find(is_it).cloned().ok_or(Failure::None("No such monitor was heard."))
    }

    async fn machine(&self, words: &(String, String, u8)) -> PageResult<Markup> {
        let glance = self.glance(words)?;
        self.read(move |store| {
            let rotor = rotor(store, glance.newest.source)?;
            machine_page::live(store.reading(), &glance, rotor.as_ref(), now_us())
        })
        .await
    }

    async fn jobs(&self) -> PageResult<Markup> {
        self.read(|store| job_page::live(store.reading())).await
    }

    fn monitors(&self) -> Markup {
        page::monitors(&self.seen.borrow(), now_us())
    }

    /// What `show` shows, whenever that changes.
    fn follow<F: Future<Output = PageResult<Markup>> + Send>(
        self,
        show: impl Fn(Self) -> F + Send + Clone + 'static,
    ) -> Sse<impl Stream<Item = std::result::Result<Event, Infallible>>> {
        let next = move |(mut served, last): (Self, String)| {
            let show = show.clone();
            async move {
                loop {
                    served.seen.changed().await.ok()?;
                    served.seen.mark_unchanged();
                    // what cannot be read now may be at the next look
                    let Ok(shown) = show(served.clone()).await else { continue };
                    let shown = shown.into_string();
                    if shown != last {
                        return Some((Ok(Event::default().data(&shown)), (served, shown)));
                    }
                }
            }
        };
        Sse::new(stream::unfold((self, String::new()), next)).keep_alive(KeepAlive::default())
    }
}

/// The machine that a monitor watches, if it was stated.
fn rotor(store: &Store, source: i64) -> Result<Option<Rotor>> {
    let sql = "SELECT rotor FROM machine WHERE source = ?";
    let text: Option<String> = store.reading().query_row(sql, [source], |row| row.get(0)).optional()?;
    Ok(text.map(|text| rotor_file::parse("rotor.toml", &text)).transpose()?)
}

/// Why there is no answer.
pub enum Failure {
    None(&'static str),
    Refused(StatusCode, &'static str),
    /// It could not be read or kept.
    Failed(anyhow::Error),
}

impl<E: Into<anyhow::Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::Failed(error.into())
    }
}

impl IntoResponse for Failure {
    fn into_response(self) -> Response {
        let (status, text) = match self {
            Self::None(text) => (StatusCode::NOT_FOUND, text.into()),
            Self::Refused(status, text) => (status, text.into()),
            Self::Failed(error) => (StatusCode::INTERNAL_SERVER_ERROR, format!("{error:#}")),
        };
        (status, text).into_response()
    }
}

fn shown(title: &str, events: &str, live: &Markup, beside: &Markup) -> Response {
    let page = page::whole(title, events, live, beside);
    ([(header::CONTENT_SECURITY_POLICY, POLICY)], Html(page)).into_response()
}

/// `/`
pub async fn monitors(State(served): State<Served>) -> Response {
    shown("Machines", "/events", &served.monitors(), &html! {})
}

/// `/events`
pub async fn monitors_events(State(served): State<Served>) -> impl IntoResponse {
    served.follow(|served| async move { Ok(served.monitors()) })
}

/// `/jobs`
pub async fn jobs(State(served): State<Served>) -> PageResult {
    Ok(shown("Jobs", "/jobs/events", &served.jobs().await?, &html! {}))
}

/// `/jobs/events`
pub async fn jobs_events(State(served): State<Served>) -> impl IntoResponse {
    served.follow(|served| async move { served.jobs().await })
}

/// What can be asked of figures.
#[derive(Deserialize)]
pub struct Asked {
    hours: Option<f64>,
}

impl Asked {
    /// The stated period, or the shortest one that holds enough readings.
    async fn hours(&self, served: &Served, source: i64) -> PageResult<f64> {
        if let Some(hours) = self.hours.filter(|hours| (0.0..=MOST_HOURS).contains(hours)) {
            return Ok(hours);
        }
        let earliest_us =
            served.read(move |store| history::nth_newest_us(store.reading(), source, USUAL_READINGS)).await?;
        let needed = earliest_us.map_or(USUAL_HOURS, |us| (now_us() - us) as f64 / 3_600e6);
        let listed = HOURS.map(|(hours, _)| hours);
        let holds_enough = |hours: &f64| *hours >= needed.max(USUAL_HOURS);
        Ok(listed.into_iter().find(holds_enough).unwrap_or(listed[listed.len() - 1]))
    }
}

/// `/machine/PLANT/BUS/NODE`
pub async fn machine(
    State(served): State<Served>,
    Words(words): MachinePath,
    Query(asked): Query<Asked>,
) -> PageResult {
    let glance = served.glance(&words)?;
    let newest = &glance.newest;
    let at = page::path(&newest.plant, &newest.bus, newest.node);
    let hours = asked.hours(&served, newest.source).await?;
    let beside = html! {
        @if served.token.is_some() { (machine_page::form(&glance)) }
        nav class="hours" {
            "The last "
            @for (of, name) in HOURS {
                @if of == hours { b { (name) } } @else { a href={ (at) "?hours=" (of) } { (name) } }
                " "
            }
        }
        iframe id="figures" title="Trends and orbits" src={ (at) "/figures?hours=" (hours) } {}
    };
    let title = format!("{}: {}, {}, node {}", page::named(&glance), newest.plant, newest.bus, newest.node);
    Ok(shown(&title, &format!("{at}/events"), &served.machine(&words).await?, &beside))
}

/// … `/events`
pub async fn machine_events(
    State(served): State<Served>,
    Words(words): MachinePath,
) -> PageResult<impl IntoResponse> {
    served.glance(&words)?;
    let words = Arc::new(words);
    Ok(served.follow(move |served| {
        let words = words.clone();
        async move { served.machine(&words).await }
    }))
}

/// … `/figures`
pub async fn figures(
    State(served): State<Served>,
    Words(words): MachinePath,
    Query(asked): Query<Asked>,
) -> PageResult {
    let source = served.glance(&words)?.newest.source;
    let hours = asked.hours(&served, source).await?;
    let page = served
        .read(move |store| {
            let rotor = rotor(store, source)?;
            trends::figures(store.reading(), source, rotor.as_ref(), hours, now_us())
        })
        .await?;
    Ok(([(header::CONTENT_SECURITY_POLICY, POLICY_OF_FIGURES)], Html(page)).into_response())
}

/// … `/report/COMMAND`
pub async fn report(
    State(served): State<Served>,
    Words((plant, bus, node, command)): Words<(String, String, u8, String)>,
) -> PageResult {
    let source = served.glance(&(plant, bus, node))?.newest.source;
    let page = served
        .read(move |store| {
            let sql = "SELECT page FROM report WHERE source = ? AND command = ?";
            let page: Option<Vec<u8>> =
                store.reading().query_row(sql, (source, command), |row| row.get(0)).optional()?;
            let Some(page) = page else { return Ok(None) };
            let mut text = String::new();
            GzDecoder::new(page.as_slice()).read_to_string(&mut text)?;
            Ok(Some(text))
        })
        .await?;
    let page = page.ok_or(Failure::None("No job made such a page of it."))?;
    Ok(([(header::CONTENT_SECURITY_POLICY, POLICY_OF_REPORTS)], Html(page)).into_response())
}

#[derive(Deserialize)]
pub struct AcknowledgeForm {
    state: String,
    since_us: i64,
    who: String,
    token: String,
}

/// … `/acknowledge`
pub async fn acknowledge(
    State(served): State<Served>,
    Words(words): MachinePath,
    Extension(Peer(client)): Extension<Peer>,
    request: Request,
) -> PageResult<Redirect> {
    let Some(token) = served.token else {
        let text = "This server only reads: it was started without --token.";
        return Err(Failure::Refused(StatusCode::FORBIDDEN, text));
    };
    let Ok(form) = tokio::time::timeout(FORM_TIME, Form::from_request(request, &())).await else {
        return Err(Failure::Refused(StatusCode::REQUEST_TIMEOUT, "The form did not come in time."));
    };
    let Ok(Form(seen)): std::result::Result<Form<AcknowledgeForm>, _> = form else {
        return Err(Failure::Refused(StatusCode::BAD_REQUEST, "The form of a machine's page is expected."));
    };
    match served.guesses.judge(client, || token.is_of(&seen.token)).await {
        Guess::Right => {}
        Guess::Wrong => return Err(Failure::Refused(StatusCode::FORBIDDEN, "Another token is expected.")),
        Guess::Refused => {
            let text = "Too many tokens at once: try one after the other.";
            return Err(Failure::Refused(StatusCode::TOO_MANY_REQUESTS, text));
        }
    }
    let Some(who) = alarm::name(&seen.who).map(String::from) else {
        let text = "A name is expected, of one line and at most 80 characters.";
        return Err(Failure::Refused(StatusCode::BAD_REQUEST, text));
    };
    let glance = served.glance(&words)?;
    let key = (glance.newest.source, seen.state, seen.since_us);
    if glance.alarm().as_ref() != Some(&key) {
        let text = "It is in another state meanwhile: look again.";
        return Err(Failure::Refused(StatusCode::CONFLICT, text));
    }
    let path = served.store.clone();
    let kept = move || alarm::acknowledge(Store::open(&path)?.connection(), &key, &who, now_us());
    tokio::task::spawn_blocking(kept).await.context("the acknowledgement was not stored")??;
    let newest = &glance.newest;
    Ok(Redirect::to(&page::path(&newest.plant, &newest.bus, newest.node)))
}

/// `/monitors`
pub async fn as_json(State(served): State<Served>) -> impl IntoResponse {
    let text = serde_json::to_string(&**served.seen.borrow()).unwrap_or_default();
    ([(header::CONTENT_TYPE, HeaderValue::from_static("application/json"))], text)
}

/// `/metrics`
pub async fn numbers(State(served): State<Served>) -> impl IntoResponse {
    ([(header::CONTENT_TYPE, "text/plain; version=0.0.4")], metrics::text(&served.seen.borrow()))
}
