//! A browser without a window, driven by the DevTools protocol over a pipe: messages of JSON, each ended by a zero byte.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// How long an answer may take: a page that opens a scene on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// The built page, if it is there and there is a browser; else why the test is skipped.
fn page() -> Result<(&'static Path, &'static str), String> {
    let page = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../target/web"));
    if !page.join("index.html").is_file() {
        return Err("the page is not built: crates/web/build".into());
    }
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let runs = |name: &&str| Command::new(name).arg("--version").output().is_ok_and(|o| o.status.success());
    let browser = names.into_iter().find(runs).ok_or("there is no Chromium to open the page in")?;
    Ok((page, browser))
}

/// A process that ends with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A browser that shows the page.
pub(crate) struct Browser {
    to: ChildStdin,
    messages: Receiver<Value>,
    calls: u64,
    session: String,
    /// Errors and warnings that the console was reported, of the page and of its worker.
    pub(crate) console: Vec<String>,
    /// Where the page is served.
    pub(crate) address: String,
    _browser: Running,
    server: Option<Running>,
    _profile: tempfile::TempDir,
}

impl Browser {
    /// Opens the page at its `fragment` in a window of this size. None, with a word, where that cannot be.
    pub(crate) fn open(fragment: &str, size: [u32; 2]) -> Option<Self> {
        Self::with(&["--disable-gpu"], fragment, size)
    }

    /// The same in a browser with other arguments.
    pub(crate) fn with(arguments: &[&str], fragment: &str, size: [u32; 2]) -> Option<Self> {
        let (page, browser) = match page() {
            Ok(found) => found,
            Err(reason) => {
                eprintln!("skipped: {reason}");
                return None;
            }
        };
        // As the guide has it.
        let mut server = Command::new("python3")
            .args(["-u", "-m", "http.server", "--bind", "127.0.0.1", "0", "--directory"])
            .arg(page)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut said = String::new();
        BufReader::new(server.stdout.take().unwrap()).read_line(&mut said).unwrap();
        let port = said.split_whitespace().skip_while(|word| *word != "port").nth(1).unwrap();
        let address = format!("http://127.0.0.1:{port}/");
        let profile = tempfile::tempdir().unwrap();
        // The browser reads from 3 and writes to 4.
        let mut child = Command::new("sh")
            .args(["-c", "exec \"$0\" \"$@\" 3<&0 4>&1 0</dev/null 1>&2", browser])
            .args(["--headless", "--no-sandbox", "--remote-debugging-pipe", "--mute-audio"])
            .args(arguments)
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg(format!("--window-size={},{}", size[0], size[1]))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let (to, from) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        let mut opened = Self {
            to,
            messages: listen(from),
            calls: 0,
            session: String::new(),
            console: vec![],
            address: address.clone(),
            _browser: Running(child),
            server: Some(Running(server)),
            _profile: profile,
        };
        let target = opened.call("Target.createTarget", &json!({ "url": "about:blank" }));
        let attach = json!({ "targetId": target["targetId"], "flatten": true });
        opened.session = opened.call("Target.attachToTarget", &attach)["sessionId"].as_str().unwrap().into();
        let auto = json!({ "autoAttach": true, "waitForDebuggerOnStart": false, "flatten": true });
        opened.call("Target.setAutoAttach", &auto);
        for domain in ["Runtime.enable", "Page.enable", "Log.enable"] {
            opened.call(domain, &json!({}));
        }
        let metrics =
            json!({ "width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": size[0] < 700 });
        opened.call("Emulation.setDeviceMetricsOverride", &metrics);
        opened.call("Page.navigate", &json!({ "url": format!("{address}{fragment}") }));
        Some(opened)
    }

    /// Ends what serves the page.
    pub(crate) fn cut_off(&mut self) {
        self.server = None;
    }

    /// Calls a method of the protocol; its result.
    pub(crate) fn call(&mut self, method: &str, params: &Value) -> Value {
        self.calls += 1;
        let id = self.calls;
        let mut message = json!({ "id": id, "method": method, "params": params });
        if !self.session.is_empty() {
            message["sessionId"] = self.session.clone().into();
        }
        self.to.write_all(format!("{message}\0").as_bytes()).unwrap();
        let until = Instant::now() + PATIENCE;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let message = self.messages.recv_timeout(left).unwrap_or_else(|e| panic!("{method}: {e}"));
            if message["id"] == id {
                assert!(message["error"].is_null(), "{method}: {}", message["error"]);
                return message["result"].clone();
            }
            self.hear(&message);
        }
    }

    /// Keeps what the console is reported.
    fn hear(&mut self, message: &Value) {
        let params = &message["params"];
        match message["method"].as_str() {
            Some("Runtime.exceptionThrown") => self.console.push(params["exceptionDetails"].to_string()),
            Some("Runtime.consoleAPICalled") if params["type"] == "error" => {
                self.console.push(params["args"].to_string());
            }
            Some("Log.entryAdded") if params["entry"]["level"] == "error" => {
                self.console.push(params["entry"].to_string());
            }
            // Of the worker.
            Some("Target.attachedToTarget") => {
                let worker = json!({ "id": 0, "method": "Runtime.enable", "sessionId": params["sessionId"] });
                self.to.write_all(format!("{worker}\0").as_bytes()).unwrap();
            }
            _ => {}
        }
    }

    /// The value of an expression, waited for if it is a promise.
    pub(crate) fn eval(&mut self, expression: &str) -> Value {
        let params = json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
        let result = self.call("Runtime.evaluate", &params);
        assert!(result["exceptionDetails"].is_null(), "{expression}: {result}");
        result["result"]["value"].clone()
    }

    /// Waits until an expression is true.
    pub(crate) fn wait(&mut self, expression: &str) {
        let begun = Instant::now();
        while self.eval(expression) != true {
            if begun.elapsed() >= PATIENCE {
                let reported = self.eval("document.getElementById('told')?.textContent");
                panic!(
                    "{expression}: not so after {PATIENCE:?}; the page tells {reported}, the console {:?}",
                    self.console
                );
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Presses a key, or lets it go.
    pub(crate) fn key(&mut self, code: &str, down: bool) {
        let kind = if down { "rawKeyDown" } else { "keyUp" };
        self.call("Input.dispatchKeyEvent", &json!({ "type": kind, "code": code, "key": code }));
    }
}

/// Messages of a browser, read on a thread of their own.
fn listen(from: impl Read + Send + 'static) -> Receiver<Value> {
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || {
        for bytes in BufReader::new(from).split(0) {
            let Ok(bytes) = bytes else { break };
            if sender.send(serde_json::from_slice(&bytes).unwrap_or_default()).is_err() {
                break;
            }
        }
    });
    receiver
}
