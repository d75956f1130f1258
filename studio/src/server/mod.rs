//! The page and its requests, for this computer alone: the address holds a random token, the host that a request names is checked, and
//! the page may load nothing from elsewhere.
//!
//! | path below the token | answer |
//! |---|---|
//! | `/` | the page; its scripts and styles beside it |
//! | `/api/state` | everything that the page shows but the figures |
//! | `/api/figures?tab=` | the figures of one kind |
//! | `/api/…` | takes one change as JSON, answers with the state after it |

mod assets;
mod requests;

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::{Context as _, Result, anyhow};
use axum::Router;
use axum::extract::{DefaultBodyLimit, Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse as _, Response};
use axum::routing::{get, post};
use rotor_edge_web::connection;
use rotor_edge_web::host::{self, Hosts};
use rotor_edge_web::token::{self, TokenDigest};
use tokio::net::TcpListener;
use tokio::runtime::Builder;

use crate::workbench::Workbench;

/// The page may run its own scripts, draw, and ask here; figures set their sizes as styles of elements.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; connect-src 'self'; \
                      img-src data: blob:; form-action 'none'; base-uri 'none'; frame-ancestors 'none'";
/// Largest request: two files of measurements.
const MOST_BYTES: usize = 64 << 20;
/// Between two looks whether to end.
const LOOK: Duration = Duration::from_millis(100);

/// Serves until `stop` rises; `opened` hears the address with its token.
///
/// # Errors
/// If the port is in use.
pub fn serve(bench: &Workbench, port: u16, stop: &AtomicBool, opened: impl FnOnce(&str)) -> Result<()> {
    let token = token::random().context("no random token")?;
    let runtime = Builder::new_multi_thread().worker_threads(1).enable_all().build()?;
    let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
    let listener = runtime.block_on(TcpListener::bind(address)).map_err(|error| match error.kind() {
        std::io::ErrorKind::AddrInUse => {
            anyhow!("port {port} is in use; end the program that listens there, or give another --port")
        }
        _ => anyhow!("{address}: cannot be listened at ({error})"),
    })?;
    let address = format!("http://{}/{token}/", listener.local_addr()?);
    runtime.spawn(connection::serve(listener, routes(bench.clone(), &token)));
    opened(&address);
    while !stop.load(Ordering::Relaxed) {
        std::thread::sleep(LOOK);
    }
    runtime.shutdown_background();
    Ok(())
}

fn routes(bench: Workbench, token: &str) -> Router {
    let hosts = middleware::from_fn_with_state(Hosts::new(&[]), host::check);
    let admitted = middleware::from_fn_with_state(Arc::new(TokenDigest::of(token)), admit);
    assets::routes("/{token}")
        .route("/{token}/api/state", get(requests::state))
        .route("/{token}/api/figures", get(requests::figures))
        .route("/{token}/api/{change}", post(requests::change))
        .with_state(bench)
        .layer(DefaultBodyLimit::max(MOST_BYTES))
        .layer(admitted)
        .layer(hosts)
}

/// Lets in who knows the token, and says what browsers may do with the answer.
async fn admit(State(token): State<Arc<TokenDigest>>, request: Request, next: Next) -> Response {
    let first = request.uri().path().split('/').nth(1).unwrap_or_default();
    if !token.is_of(first) {
        let text = "This is not the address of the studio; open the one that it printed when it was started.";
        return (StatusCode::FORBIDDEN, text).into_response();
    }
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    for (name, value) in [
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::CACHE_CONTROL, "no-store"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}
