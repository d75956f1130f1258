//! A page of all monitors that follows what a store holds, and numbers for Prometheus. It reads and never writes.
//!
//! | path | answer |
//! |---|---|
//! | `/` | the page, whole without its script |
//! | `/events` | the table of the page again, as a server-sent event whenever it changes |
//! | `/monitors` | every monitor's last word as JSON |
//! | `/metrics` | the same for Prometheus |

pub mod glance;
mod metrics;
mod page;

use std::convert::Infallible;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::{Context, Result};
use axum::Router;
use axum::extract::State;
use axum::http::header;
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{Html, IntoResponse};
use axum::routing::get;
use futures_util::{Stream, stream};
use jiff::Timestamp;
use tokio::net::TcpListener;
use tokio::runtime::Builder;
use tokio::sync::watch;

use crate::store::{Newest, Store};
use glance::Glance;

/// Between two looks into the store: half of what a reader may wait.
const LOOK: Duration = Duration::from_secs(1);
/// The page may do nothing but show itself and listen here.
const POLICY: &str =
    "default-src 'none'; style-src 'self'; script-src 'self'; connect-src 'self'; img-src data:";

type Seen = watch::Receiver<Arc<Vec<Glance>>>;

/// Serves until `stop` rises. `opened` hears where, once that is known.
///
/// # Errors
/// If the store cannot be read at first, or the address not be had.
pub fn serve(
    store: PathBuf,
    address: SocketAddr,
    stop: &AtomicBool,
    opened: impl FnOnce(SocketAddr),
) -> Result<()> {
    let store = Store::open(&store)?;
    let mut newest = store.newest()?;
    let (tell, seen) = watch::channel(Arc::new(at_present(&newest)));
    let runtime = Builder::new_multi_thread().worker_threads(1).enable_all().build()?;
    let listener = runtime
        .block_on(TcpListener::bind(address))
        .with_context(|| format!("{address}: cannot be listened at"))?;
    opened(listener.local_addr()?);
    let routes = Router::new()
        .route("/", get(whole_page))
        .route("/page.css", get(|| async { ([(header::CONTENT_TYPE, "text/css")], page::STYLE) }))
        .route("/page.js", get(|| async { ([(header::CONTENT_TYPE, "text/javascript")], page::SCRIPT) }))
        .route("/events", get(events))
        .route("/monitors", get(monitors))
        .route("/metrics", get(numbers))
        .with_state(seen);
    runtime.spawn(async move { axum::serve(listener, routes).await });
    while !stop.load(Ordering::Relaxed) {
        std::thread::sleep(LOOK);
        // while a store cannot be read, what was told last grows old, and everybody falls silent
        if let Ok(now) = store.newest() {
            newest = now;
        }
        tell.send_replace(Arc::new(at_present(&newest)));
    }
    // whoever still listens is not waited for
    runtime.shutdown_background();
    Ok(())
}

fn at_present(newest: &[Newest]) -> Vec<Glance> {
    glance::all(newest, Timestamp::now().as_microsecond())
}

async fn whole_page(State(seen): State<Seen>) -> impl IntoResponse {
    let page = page::whole(&seen.borrow());
    ([(header::CONTENT_SECURITY_POLICY, POLICY)], Html(page))
}

async fn events(State(seen): State<Seen>) -> Sse<impl Stream<Item = Result<Event, Infallible>>> {
    let next = |mut seen: Seen| async move {
        seen.changed().await.ok()?;
        let table = page::table(&seen.borrow_and_update()).into_string();
        Some((Ok(Event::default().data(table)), seen))
    };
    Sse::new(stream::unfold(seen, next)).keep_alive(KeepAlive::default())
}

async fn monitors(State(seen): State<Seen>) -> impl IntoResponse {
    let text = serde_json::to_string(&**seen.borrow()).unwrap_or_default();
    ([(header::CONTENT_TYPE, "application/json")], text)
}

async fn numbers(State(seen): State<Seen>) -> impl IntoResponse {
    ([(header::CONTENT_TYPE, "text/plain; version=0.0.4")], metrics::text(&seen.borrow()))
}
