//! The `Host` that a request names: a page of another site, whose name was pointed at this machine, must not read the server.

use std::net::IpAddr;
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::{StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse as _, Response};

/// Names, beside `localhost` and addresses, by which the server may be asked.
#[derive(Debug, Clone, Default)]
pub struct Hosts(Arc<[String]>);

impl Hosts {
    pub fn new(names: &[String]) -> Self {
        Self(names.iter().map(|name| name.to_ascii_lowercase()).collect())
    }

    /// Whether a request with this `Host` is for this server. An address is: only a name can be pointed elsewhere.
    fn knows(&self, host: &str) -> bool {
        let host = without_port(host).to_ascii_lowercase();
        let address = host.strip_prefix('[').and_then(|h| h.strip_suffix(']')).unwrap_or(&host);
        address.parse::<IpAddr>().is_ok() || host == "localhost" || self.0.contains(&host)
    }
}

fn without_port(host: &str) -> &str {
    match host.rsplit_once(':') {
        Some((name, port)) if !name.is_empty() && port.bytes().all(|b| b.is_ascii_digit()) => name,
        _ => host,
    }
}

/// Refuses a request that names another host.
pub async fn check(State(hosts): State<Hosts>, request: Request, next: Next) -> Response {
    let mut all = request.headers().get_all(header::HOST).iter();
    // of two names, another program between may have looked at the other one
    let named = all.next().filter(|_| all.next().is_none()).and_then(|host| host.to_str().ok());
    // the target of a request to a proxy names a host as well
    let target = request.uri().host();
    let is_known = named.is_some_and(|host| hosts.knows(host)) && target.is_none_or(|host| hosts.knows(host));
    if is_known {
        return next.run(request).await;
    }
    let text = "The request names another host. Open the server by its address, or by a name that it was started with.";
    (StatusCode::MISDIRECTED_REQUEST, text).into_response()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn host_is_an_address_localhost_or_a_stated_name() {
        let hosts = Hosts::new(&["Plant-Server".into()]);
        for known in [
            "127.0.0.1:8370",
            "127.0.0.1",
            "[::1]:8370",
            "[fe80::1]",
            "LocalHost:1",
            "plant-server",
            "10.0.0.7:80",
        ] {
            assert!(hosts.knows(known), "{known}");
        }
        for foreign in [
            "evil.example",
            "evil.example:8370",
            "localhost.evil.example",
            "",
            ":80",
            "127.0.0.1.evil.example",
            "x:y",
        ] {
            assert!(!hosts.knows(foreign), "{foreign}");
        }
    }
}
