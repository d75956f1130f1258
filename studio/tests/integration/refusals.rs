//! What is wrong is said in one sentence, and nothing is lost.

use std::net::TcpListener;

use rotor_edge::sample;
use serde_json::json;
use tempfile::TempDir;

use crate::client::{self, request};
use crate::program::{Studio, refused};

/// A folder with the sample's files, and measurements of another machine.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("rotor.toml", sample::ROTOR);
    write("data.csv", sample::RUNUP_DAY_126);
    write("other.csv", &sample::RUNUP_DAY_126.replace("15X", "99X"));
    folder
}

#[test]
fn address_without_its_token_or_host_is_refused() {
    let folder = folder();
    let studio = Studio::start::<&str>(folder.path(), &[]);
    let (server, path) = studio.parts();
    let page = request(server, "GET", path, server, "");
    assert_eq!(page.status, 200);
    for part in ["content-security-policy: default-src 'none'", "referrer-policy: no-referrer"] {
        assert!(page.head.contains(part), "{}", page.head);
    }
    assert!(server.starts_with("127.0.0.1:"), "{server}");
    let other = format!("/{}/", "0".repeat(32));
    for path in ["/", other.as_str(), "/api/state", &format!("{other}api/state")] {
        let answer = request(server, "GET", path, server, "");
        assert_eq!(answer.status, 403, "{path}");
        assert!(!answer.text.contains("studio.js"));
    }
    assert_eq!(request(server, "GET", path, "evil.example", "").status, 421);
    assert_eq!(request(server, "POST", &format!("{path}api/undo"), "evil.example", "{}").status, 421);
}

#[test]
fn files_that_do_not_belong_together_are_refused_by_name() {
    let folder = folder();
    let said = refused(folder.path(), &["rotor.toml", "other.csv"]);
    assert!(said.contains("other.csv") && said.trim_end().lines().count() == 1, "{said}");
    let said = refused(folder.path(), &["data.csv", "rotor.toml"]);
    assert!(said.contains("data.csv"), "{said}");
    let said = refused(folder.path(), &["none.toml", "data.csv"]);
    assert!(said.contains("none.toml: cannot be read"), "{said}");
}

#[test]
fn failed_change_leaves_the_session_as_it_was() {
    let folder = folder();
    let studio = Studio::start(folder.path(), &["rotor.toml", "data.csv"]);
    let before = studio.diagnosed();
    let file = |name: &str, text: &str| json!({ "name": name, "text": text });
    let other = sample::RUNUP_DAY_126.replace("15X", "99X");
    let mixed =
        json!({ "what": "files", "files": [file("r.toml", sample::ROTOR), file("other.csv", &other)] });
    assert!(studio.refusal("open", &mixed).contains("other.csv"));
    let alone = json!({ "what": "files", "files": [file("r.toml", sample::ROTOR)] });
    assert!(studio.refusal("open", &alone).contains("expected one file of measurements"));
    let effect = json!({ "effect": "seal", "at": "disk 9" });
    assert!(studio.refusal("preview", &effect).contains("cannot sit at \"disk 9\""));
    assert!(studio.refusal("add", &json!({ "effect": "gremlin", "at": null })).contains("no effect"));
    assert!(studio.refusal("nonsense", &json!({})).contains("load the page again"));
    assert!(studio.refusal("leave_out", &json!({ "speeds_rpm": [0.0, 1e6] })).contains("left out"));
    assert!(studio.refusal("branch", &json!({ "branch": 7 })).contains("no such branch"));
    assert!(studio.refusal("reveal", &json!({})).contains("nothing is hidden"));
    let after = studio.diagnosed();
    assert_eq!((&after["steps"], &after["verdict"]), (&before["steps"], &before["verdict"]));
}

#[test]
fn file_that_exists_is_written_over_only_when_told() {
    let folder = folder();
    let studio = Studio::start(folder.path(), &["rotor.toml", "data.csv"]);
    let save = |path: &str, overwrite: bool| {
        studio.ask("save", &json!({ "what": "rotor", "path": path, "overwrite": overwrite }))
    };
    let answer = save("rotor.toml", false);
    assert_eq!((answer.status, answer.json()["exists"].as_bool()), (409, Some(true)));
    assert!(answer.text.contains("the session was read from this file"));
    assert_eq!(save("better.toml", false).status, 200);
    let answer = save("better.toml", false);
    assert!(answer.status == 409 && answer.text.contains("exists already"));
    assert_eq!(save("better.toml", true).status, 200);
    assert!(save("none/better.toml", false).text.contains("there is no folder"));
    assert_eq!(std::fs::read_to_string(folder.path().join("rotor.toml")).unwrap(), sample::ROTOR);
}

#[test]
fn port_in_use_is_named() {
    let folder = folder();
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let said = refused(folder.path(), &["--port", &port]);
    assert!(said.contains(&format!("port {port} is in use")), "{said}");
}

#[test]
fn second_studio_on_one_file_is_sent_to_the_first() {
    let folder = folder();
    let first = Studio::start(folder.path(), &["rotor.toml", "data.csv"]);
    let said = refused(folder.path(), &["rotor.toml", "data.csv"]);
    assert!(said.contains("another studio has this file open"), "{said}");
    first.changed("save", &json!({ "what": "session", "path": "session.json" }));
    first.changed("open", &client::sample());
    let again = Studio::start(folder.path(), &["--session", "session.json"]);
    assert_eq!(again.diagnosed()["verdict"]["word"], "missing");
}
