//! Requests to a studio without a browser.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::program::Studio;

/// Longest that a diagnosis may take.
const PATIENCE: Duration = Duration::from_secs(120);

/// Status line, heads and text of an answer.
pub struct Answer {
    pub status: u16,
    pub head: String,
    pub text: String,
}

impl Answer {
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.text).unwrap_or_else(|_| panic!("{}: {}", self.status, self.text))
    }
}

/// One request, its host stated.
pub fn request(server: &str, method: &str, path: &str, host: &str, body: &str) -> Answer {
    let mut stream = TcpStream::connect(server).unwrap();
    let length = body.len();
    write!(
        stream,
        "{method} {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\nContent-Length: {length}\r\n\r\n{body}"
    )
    .unwrap();
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    let (head, text) = text.split_once("\r\n\r\n").unwrap();
    let status = head.split(' ').nth(1).unwrap().parse().unwrap();
    Answer { status, head: head.to_lowercase(), text: text.into() }
}

impl Studio {
    /// Where it listens, and the path of the page.
    pub fn parts(&self) -> (&str, &str) {
        let rest = self.address.strip_prefix("http://").unwrap();
        rest.split_at(rest.find('/').unwrap())
    }

    pub fn ask(&self, change: &str, body: &Value) -> Answer {
        let (server, path) = self.parts();
        request(server, "POST", &format!("{path}api/{change}"), server, &body.to_string())
    }

    /// A change that is made; the session after it.
    pub fn changed(&self, change: &str, body: &Value) -> Value {
        let answer = self.ask(change, body);
        assert_eq!(answer.status, 200, "{change}: {}", answer.text);
        answer.json()["session"].clone()
    }

    /// The sentence by which a change is refused.
    pub fn refusal(&self, change: &str, body: &Value) -> String {
        let answer = self.ask(change, body);
        assert!(answer.status >= 400, "{change}: {}", answer.text);
        answer.json()["error"].as_str().unwrap().to_string()
    }

    /// Everything that the page shows.
    pub fn state(&self) -> Value {
        let (server, path) = self.parts();
        request(server, "GET", &format!("{path}api/state"), server, "").json()
    }

    /// The session as soon as its model is diagnosed.
    pub fn diagnosed(&self) -> Value {
        let begun = Instant::now();
        loop {
            let state = self.state();
            if state["session"]["verdict"]["word"] != "working" {
                return state["session"].clone();
            }
            assert!(begun.elapsed() < PATIENCE, "no diagnosis: {state}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

/// The sample, opened in a studio.
pub fn sample() -> Value {
    json!({ "what": "sample" })
}
