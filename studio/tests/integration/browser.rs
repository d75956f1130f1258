//! A headless Chromium that is told over a pipe what to do with the page of a running studio (the DevTools protocol).

use std::fs::{File, OpenOptions};
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use rotor_edge_tests::chromium;
use serde_json::{Value, json};
use tempfile::TempDir;

/// Longest that one thing on the page may take.
const PATIENCE: Duration = Duration::from_secs(60);
/// Between two looks at the page.
const LOOK: Duration = Duration::from_millis(20);
/// A browser with one page open.
pub struct Browser {
    child: Child,
    requests: File,
    answers: Receiver<Value>,
    session: String,
    number: u64,
    /// What the page logged, and what it could not load.
    pub complaints: Vec<String>,
    _folder: TempDir,
}

impl Browser {
    /// A browser in a window of this size; none if there is none to be had.
    pub fn open(address: &str, [width, height]: [u32; 2]) -> Option<Self> {
        let path = chromium::find("the studio in a browser")?;
        let folder = tempfile::tempdir().unwrap();
        let pipe = |name: &str| folder.path().join(name);
        assert!(Command::new("mkfifo").args([pipe("in"), pipe("out")]).status().unwrap().success());
        let profile = format!("--user-data-dir={}", pipe("profile").display());
        // a pipe of its own for each direction, at the numbers that the browser reads and writes
        let child = Command::new("bash")
            .args(["-c", "exec 3<\"$0\" 4>\"$1\"; shift; exec \"$@\""])
            .args([pipe("in"), pipe("out")])
            .arg(path)
            .args(chromium::FLAGS)
            .arg("--remote-debugging-pipe")
            .args([profile, format!("--window-size={width},{height}"), "about:blank".into()])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let requests = OpenOptions::new().write(true).open(pipe("in")).unwrap();
        let answers = listen(&pipe("out"));
        let mut browser = Self {
            child,
            requests,
            answers,
            session: String::new(),
            number: 0,
            complaints: Vec::new(),
            _folder: folder,
        };
        let targets = browser.call("Target.getTargets", json!({}));
        let page = targets["targetInfos"].as_array().unwrap().iter().find(|t| t["type"] == "page").unwrap();
        let id = page["targetId"].clone();
        let attached = browser.call("Target.attachToTarget", json!({ "targetId": id, "flatten": true }));
        browser.session = attached["sessionId"].as_str().unwrap().into();
        for domain in ["Page.enable", "Runtime.enable", "Log.enable"] {
            browser.call(domain, json!({}));
        }
        let size = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        browser.call("Emulation.setDeviceMetricsOverride", size);
        browser.go(address);
        Some(browser)
    }

    /// Opens an address, and waits until the page is ready.
    pub fn go(&mut self, address: &str) {
        self.call("Page.navigate", json!({ "url": address }));
        self.wait("document.documentElement.dataset.ready === 'true'");
    }

    fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.number += 1;
        let mut request = json!({ "id": self.number, "method": method, "params": parameters });
        if !self.session.is_empty() {
            request["sessionId"] = json!(self.session);
        }
        let mut bytes = serde_json::to_vec(&request).unwrap();
        bytes.push(0);
        self.requests.write_all(&bytes).unwrap();
        loop {
            let answer =
                self.answers.recv_timeout(PATIENCE).unwrap_or_else(|_| panic!("no answer to {method}"));
            if answer["id"] == self.number {
                assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
                return answer["result"].clone();
            }
            self.hear(&answer);
        }
    }

    /// What the browser says by itself.
    fn hear(&mut self, event: &Value) {
        let parameters = &event["params"];
        match event["method"].as_str() {
            Some("Runtime.exceptionThrown") => {
                self.complaints.push(parameters["exceptionDetails"].to_string());
            }
            // a refusal is an answer that the page shows
            Some("Log.entryAdded")
                if parameters["entry"]["level"] == "error" && parameters["entry"]["source"] != "network" =>
            {
                self.complaints.push(parameters["entry"].to_string());
            }
            _ => {}
        }
    }

    /// The value of an expression on the page.
    pub fn value(&mut self, expression: &str) -> Value {
        let request = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let answer = self.call("Runtime.evaluate", request);
        assert!(answer["exceptionDetails"].is_null(), "{expression}: {}", answer["exceptionDetails"]);
        answer["result"]["value"].clone()
    }

    pub fn text(&mut self, selector: &str) -> String {
        let found = self.value(&format!("document.querySelector({selector:?})?.textContent ?? null"));
        found.as_str().unwrap_or_else(|| panic!("there is no {selector}")).to_string()
    }

    /// Waits until an expression holds.
    pub fn wait(&mut self, expression: &str) {
        let begun = Instant::now();
        // what is looked for may be on a page that is still to come
        let holds =
            format!("(() => {{ try {{ return Boolean({expression}); }} catch {{ return false; }} }})()");
        while self.value(&holds) != json!(true) {
            if begun.elapsed() > PATIENCE {
                let page = self.value("document.body.innerText");
                panic!("never: {expression}\n{page}\n{:?}", self.complaints);
            }
            std::thread::sleep(LOOK);
        }
    }

    /// Waits until the verdict is this word.
    pub fn wait_for_verdict(&mut self, word: &str) {
        self.wait(&format!("document.getElementById('word').textContent === {word:?}"));
    }

    /// Clicks where an element is, as a person does.
    pub fn click(&mut self, selector: &str) {
        let find = format!(
            "(() => {{ const node = document.querySelector({selector:?}); if (!node || node.disabled) return null; \
             node.scrollIntoView({{ block: 'center' }}); const box = node.getBoundingClientRect(); \
             return [box.x + box.width / 2, box.y + box.height / 2, box.width * box.height]; }})()"
        );
        self.wait(&format!("({find}) !== null && ({find})[2] > 0"));
        let at = self.value(&find);
        for kind in ["mousePressed", "mouseReleased"] {
            let event = json!({ "type": kind, "x": at[0], "y": at[1], "button": "left", "clickCount": 1 });
            self.call("Input.dispatchMouseEvent", event);
        }
    }

    /// Writes into a field, in place of what is there.
    pub fn write(&mut self, selector: &str, text: &str) {
        self.click(selector);
        self.value(&format!("document.querySelector({selector:?}).select()"));
        self.call("Input.insertText", json!({ "text": text }));
    }

    /// Presses a key by its DevTools name.
    pub fn press(&mut self, key: &str, code: u32) {
        // without its character a key presses no button
        let text = if key == "Enter" { "\r" } else { "" };
        for kind in ["keyDown", "keyUp"] {
            let event =
                json!({ "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code, "text": text });
            self.call("Input.dispatchKeyEvent", event);
        }
    }

    /// Shows the page dark or light.
    pub fn prefer(&mut self, scheme: &str) {
        let features = json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] });
        self.call("Emulation.setEmulatedMedia", features);
    }

    pub fn resize(&mut self, [width, height]: [u32; 2]) {
        let size = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", size);
    }

    /// Leaves a picture of the page where `ROTOR_EDGE_REPORT_DIR` says.
    pub fn keep(&mut self, name: &str) {
        let Some(folder) = std::env::var_os("ROTOR_EDGE_REPORT_DIR").map(PathBuf::from) else { return };
        std::fs::create_dir_all(&folder).unwrap();
        // figures that were asked for are drawn in the next moments
        std::thread::sleep(Duration::from_millis(400));
        let picture = self.call("Page.captureScreenshot", json!({ "format": "png" }));
        let decode = Command::new("base64").arg("-d").stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
        let mut decode = decode.unwrap();
        let data = picture["data"].as_str().unwrap().to_string();
        let mut input = decode.stdin.take().unwrap();
        let write = std::thread::spawn(move || input.write_all(data.as_bytes()).unwrap());
        let output = decode.wait_with_output().unwrap();
        write.join().unwrap();
        std::fs::write(folder.join(format!("{name}.png")), output.stdout).unwrap();
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // it may be gone already
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Everything that the browser writes, message by message.
fn listen(pipe: &Path) -> Receiver<Value> {
    let mut reader = BufReader::new(File::open(pipe).unwrap());
    let (tell, told) = channel();
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        while reader.read_until(0, &mut bytes).is_ok_and(|length| length > 0) {
            bytes.pop();
            let Ok(message) = serde_json::from_slice(&bytes) else { break };
            if tell.send(message).is_err() {
                break;
            }
            bytes.clear();
        }
    });
    told
}
