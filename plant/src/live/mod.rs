//! Pages that follow what a store holds, and numbers for Prometheus. They read; only who has the token of the server may say
//! that an alarm was seen.
//!
//! | path | answer |
//! |---|---|
//! | `/` | all monitors, the worst first |
//! | `/machine/PLANT/BUS/NODE` | one of them; names as [`plain_word`](crate::item::plain_word) writes them |
//! | … `/figures?hours=24` | its trends and orbits |
//! | … `/report/COMMAND` | the newest page that a job made of it |
//! | … `/acknowledge` | takes who has seen its alarm |
//! | `/jobs` | what was asked of the fleet |
//! | … `/events` | what is live of a page again, as a server-sent event whenever it changes |
//! | `/monitors` | every monitor's last word as JSON |
//! | `/metrics` | the same for Prometheus |

pub mod alarm;
pub mod glance;
mod guesses;
mod history;
mod jobs;
mod known;
mod machine;
mod metrics;
mod moment;
mod page;
mod recent;
mod served;
mod trends;

use std::collections::HashMap;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::{Context, Result};
use axum::Router;
use axum::http::header;
use axum::middleware;
use axum::routing::{get, post};
use jiff::Timestamp;
use tokio::net::TcpListener;
use tokio::runtime::Builder;
use tokio::sync::watch;

use rotor_edge_web::connection;
use rotor_edge_web::host::{self, Hosts};

use crate::store::{Newest, Store};
use alarm::{Acknowledged, Key};
use glance::Glance;
use known::KnownMachines;
use served::Served;

/// Between two looks into the store: a quarter of what a reader may wait.
const LOOK: Duration = Duration::from_millis(500);
/// Threads that read the store for pages, so that many readers leave the machine to others.
const READERS: usize = 4;

/// Who may ask, and what for.
#[derive(Debug, Clone, Copy)]
pub struct Admission<'a> {
    /// Who knows it may acknowledge alarms; without one nobody may.
    pub token: Option<&'a str>,
    /// Names of the server beside `localhost` and addresses.
    pub hosts: &'a [String],
}

/// Serves until `stop` rises. `opened` hears where, once that is known.
///
/// # Errors
/// If the store cannot be read at first, or the address not be had.
pub fn serve(
    path: PathBuf,
    address: SocketAddr,
    admission: Admission<'_>,
    stop: &AtomicBool,
    opened: impl FnOnce(SocketAddr),
) -> Result<()> {
    let store = Store::open_to_read(&path)?;
    let mut told = StoreSnapshot::read(&store)?;
    let mut known = KnownMachines::default();
    known.look(&store, &told.newest, now_us())?;
    let (tell, seen) = watch::channel(Arc::new(told.at_present(&known)));
    let runtime =
        Builder::new_multi_thread().worker_threads(1).max_blocking_threads(READERS).enable_all().build()?;
    let listener = runtime
        .block_on(TcpListener::bind(address))
        .with_context(|| format!("{address}: cannot be opened for listening"))?;
    opened(listener.local_addr()?);
    let hosts = middleware::from_fn_with_state(Hosts::new(admission.hosts), host::check);
    let routes = routes(Served::new(seen, path, admission.token)).layer(hosts);
    runtime.spawn(connection::serve(listener, routes));
    while !stop.load(Ordering::Relaxed) {
        std::thread::sleep(LOOK);
        // while a store cannot be read, what was told last grows old, and everybody falls silent
        if let Ok(now) = StoreSnapshot::read(&store) {
            told = now;
        }
        // what is known of the machines may be as old as it is
        let _ = known.look(&store, &told.newest, now_us());
        tell.send_replace(Arc::new(told.at_present(&known)));
    }
    // whoever still listens is not waited for
    runtime.shutdown_background();
    Ok(())
}

fn routes(served: Served) -> Router {
    let style = || async { ([(header::CONTENT_TYPE, "text/css")], page::STYLE) };
    let script = || async { ([(header::CONTENT_TYPE, "text/javascript")], page::SCRIPT) };
    const MACHINE: &str = "/machine/{plant}/{bus}/{node}";
    let of_machine = |rest: &str| format!("{MACHINE}/{rest}");
    Router::new()
        .route("/", get(served::monitors))
        .route("/events", get(served::monitors_events))
        .route("/jobs", get(served::jobs))
        .route("/jobs/events", get(served::jobs_events))
        .route(MACHINE, get(served::machine))
        .route(&of_machine("events"), get(served::machine_events))
        .route(&of_machine("figures"), get(served::figures))
        .route(&of_machine("report/{command}"), get(served::report))
        .route(&of_machine("acknowledge"), post(served::acknowledge))
        .route("/monitors", get(served::as_json))
        .route("/metrics", get(served::numbers))
        .route("/page.css", get(style))
        .route("/page.js", get(script))
        .with_state(served)
}

/// What a store said last.
struct StoreSnapshot {
    newest: Vec<Newest>,
    acknowledged: HashMap<Key, Acknowledged>,
}

impl StoreSnapshot {
    fn read(store: &Store) -> Result<Self> {
        Ok(Self { newest: store.newest()?, acknowledged: alarm::acknowledged(store.reading())? })
    }

    fn at_present(&self, known: &KnownMachines) -> Vec<Glance> {
        glance::all(&self.newest, &self.acknowledged, known.all(), now_us())
    }
}

fn now_us() -> i64 {
    Timestamp::now().as_microsecond()
}
