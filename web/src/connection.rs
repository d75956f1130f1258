//! Connections to the server: how many at once, and how long a client may take to ask.

use std::io;
use std::net::IpAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::http::Request;
use hyper::server::conn::http1;
use hyper::service::{Service as _, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio_io_timeout::TimeoutStream;

/// Connections at once; each takes a descriptor, of which a process has often no more than 1,024.
pub const MOST_CONNECTIONS: usize = 256;
/// A client that has not sent the head of its next request after so long is closed; so is one that keeps a connection idle.
pub const HEAD_TIME: Duration = Duration::from_secs(10);
/// A client that takes nothing of an answer for so long is closed.
pub const READ_TIME: Duration = Duration::from_secs(10);
/// Before the next client is let in when one could not be.
const CROWDED_PAUSE: Duration = Duration::from_millis(50);
/// What a client is told while there are too many.
const BUSY: &[u8] = b"HTTP/1.1 503 Service Unavailable\r\nConnection: close\r\nContent-Type: text/plain\r\n\
                      Content-Length: 57\r\n\r\nThere are too many connections; try again in ten seconds.";

/// Where a request came from.
#[derive(Debug, Clone, Copy)]
pub struct Peer(pub IpAddr);

/// Serves every client until the runtime ends.
pub async fn serve(listener: TcpListener, routes: Router) {
    let open = Arc::new(Semaphore::new(MOST_CONNECTIONS));
    loop {
        let Ok((stream, address)) = listener.accept().await else {
            tokio::time::sleep(CROWDED_PAUSE).await;
            continue;
        };
        let Ok(permit) = open.clone().try_acquire_owned() else {
            turn_away(&stream);
            continue;
        };
        let routes = routes.clone();
        tokio::spawn(async move {
            // a client that breaks off is no failure of the server
            let _ = answer(stream, Peer(address.ip()), routes).await;
            drop(permit);
        });
    }
}

/// Says what fits into the socket's buffer, and waits for nobody.
fn turn_away(stream: &TcpStream) {
    let _: io::Result<usize> = stream.try_write(BUSY);
}

async fn answer(stream: TcpStream, peer: Peer, routes: Router) -> hyper::Result<()> {
    let routes = TowerToHyperService::new(routes);
    let service = service_fn(move |mut request: Request<hyper::body::Incoming>| {
        request.extensions_mut().insert(peer);
        routes.call(request.map(Body::new))
    });
    let mut stream = TimeoutStream::new(stream);
    stream.set_write_timeout(Some(READ_TIME));
    http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD_TIME)
        .serve_connection(TokioIo::new(Box::pin(stream)), service)
        .await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refusal_of_a_connection_states_its_own_length() {
        let text = std::str::from_utf8(BUSY).unwrap();
        let (head, body) = text.split_once("\r\n\r\n").unwrap();
        assert!(head.contains(&format!("Content-Length: {}", body.len())), "{}", body.len());
    }
}
