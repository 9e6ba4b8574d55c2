//! The real binary as a test server, its answers, and tools for JSON.
#![allow(dead_code, reason = "each test binary uses a part")]

pub mod mutate;

use std::io::{BufRead, BufReader, PipeReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::Mutex;

use serde_json::{Map, Value};
use springline::api::operations::{Entry, Example, TABLE};
use ureq::http::{HeaderValue, Response};

/// A running service on a port of its own; killed on drop.
pub struct Server {
    pub child: Child,
    pub greeting: String,
    pub address: String,
    agent: ureq::Agent,
    _stdout: BufReader<ChildStdout>,
}

/// What came back.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    pub status: u16,
    pub headers: Vec<(String, String)>,
    pub body: Vec<u8>,
}

/// The binary, or the one that `ENDURANCE_BINARY` names: from an image, say.
pub fn binary() -> Command {
    let given = std::env::var_os("ENDURANCE_BINARY");
    Command::new(given.unwrap_or_else(|| env!("CARGO_BIN_EXE_springline").into()))
}

impl Server {
    pub fn start() -> Self {
        Self::with(&[])
    }

    /// With settings as flags; stops without grace, logs only what is wrong with it.
    pub fn with(settings: &[&str]) -> Self {
        let mut command = binary();
        command.args(["serve", "--listen", "127.0.0.1:0"]).args(settings);
        command.env("SPRINGLINE_GRACE", "0s").env("SPRINGLINE_LOG", "error");
        Self::run(command)
    }

    pub fn run(mut command: Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        let mut greeting = String::new();
        stdout.read_line(&mut greeting).unwrap();
        let address =
            greeting.trim().rsplit_once("://").expect("the greeting names an address").1.to_owned();
        let agent = ureq::Agent::config_builder()
            .http_status_as_error(false)
            .max_redirects(0)
            .build()
            .into();
        Server { child, greeting, address, agent, _stdout: stdout }
    }

    pub fn url(&self, path: &str) -> String {
        format!("http://{}{path}", self.address)
    }

    pub fn get(&self, path: &str) -> Answer {
        Answer::of(self.agent.get(self.url(path)).call())
    }

    /// Posts bytes as JSON.
    pub fn post(&self, path: &str, body: impl AsRef<[u8]>) -> Answer {
        self.post_as(path, Some("application/json"), body)
    }

    pub fn post_json(&self, path: &str, body: &Value) -> Answer {
        self.post(path, body.to_string())
    }

    pub fn post_as(&self, path: &str, media_type: Option<&str>, body: impl AsRef<[u8]>) -> Answer {
        let request = self.agent.post(self.url(path));
        let request = media_type
            .into_iter()
            .fold(request, |request, value| request.header("content-type", value));
        Answer::of(request.send(body.as_ref()))
    }

    pub fn method(&self, method: &str, path: &str) -> Answer {
        self.raw(
            format!("{method} {path} HTTP/1.1\r\nHost: test\r\nConnection: close\r\n\r\n")
                .as_bytes(),
        )
    }

    /// Sends bytes as they are; reads until the server closes.
    pub fn raw(&self, request: &[u8]) -> Answer {
        let mut stream = TcpStream::connect(&self.address).unwrap();
        // The server may answer and close before it has read everything.
        let _ = stream.write_all(request);
        let mut text = Vec::new();
        let _ = stream.read_to_end(&mut text);
        Answer::parse(&text)
    }

    /// The answer to a request that must succeed.
    pub fn ok(&self, path: &str, body: &Value) -> Value {
        let answer = self.post_json(path, body);
        assert_eq!(answer.status, 200, "{path} {body}\n{}", answer.text());
        answer.json()
    }
}

impl Server {
    /// Sends a signal, by its short name.
    pub fn signal(&self, name: &str) {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args(["-s", name, &id]).status().unwrap().success());
    }

    /// Waits for the process to end.
    pub fn wait(&mut self) -> ExitStatus {
        self.child.wait().unwrap()
    }

    /// A metric by its name with labels. Asks again where the service closes the connection, as it
    /// may be set to do before a slow machine has asked.
    pub fn metric(&self, name: &str) -> f64 {
        let request = b"GET /metrics HTTP/1.1\r\nhost: test\r\nconnection: close\r\n\r\n";
        let text = loop {
            let mut stream = TcpStream::connect(&self.address).unwrap();
            let mut text = String::new();
            let heard = stream.write_all(request).and_then(|()| stream.read_to_string(&mut text));
            if heard.is_ok() && text.contains("# EOF") {
                break text;
            }
        };
        let value = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
        value.map_or(0.0, |value| value.parse().unwrap())
    }
}

/// Waits for what must come about: without a limit, as a machine may be slow.
pub fn wait_until(mut holds: impl FnMut() -> bool) {
    while !holds() {
        std::thread::yield_now();
    }
}

/// What a process writes to its log.
pub struct Log(Mutex<(BufReader<PipeReader>, Vec<String>)>);

impl Log {
    /// Collects the standard error of a command.
    pub fn of(command: &mut Command) -> Self {
        let (reader, writer) = std::io::pipe().unwrap();
        command.stderr(writer);
        Log(Mutex::new((BufReader::new(reader), Vec::new())))
    }

    /// The first line with this text, when it comes. The command must be dropped by then, or its
    /// end of the log stays open.
    pub fn wait_for(&self, text: &str) -> String {
        let mut log = self.0.lock().unwrap();
        let (reader, lines) = &mut *log;
        let known = lines.iter().find(|line| line.contains(text)).cloned();
        known.unwrap_or_else(|| {
            loop {
                let mut line = String::new();
                assert!(reader.read_line(&mut line).unwrap() > 0, "no {text} in {lines:#?}");
                lines.push(line.clone());
                if line.contains(text) {
                    return line;
                }
            }
        })
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Answer {
    fn of(result: Result<Response<ureq::Body>, ureq::Error>) -> Self {
        let mut response = result.unwrap();
        let text = |value: &HeaderValue| value.to_str().unwrap_or("").to_owned();
        let headers = response
            .headers()
            .iter()
            .map(|(name, value)| (name.to_string(), text(value)))
            .collect();
        let body = response.body_mut().with_config().limit(1 << 30).read_to_vec().unwrap();
        Answer { status: response.status().as_u16(), headers, body }
    }

    pub fn parse(text: &[u8]) -> Self {
        let end = text
            .windows(4)
            .position(|four| four == b"\r\n\r\n")
            .unwrap_or_else(|| panic!("no answer: {text:?}"));
        let head = String::from_utf8_lossy(&text[..end]).into_owned();
        let mut lines = head.lines();
        let status = lines
            .next()
            .and_then(|line| line.split(' ').nth(1))
            .and_then(|code| code.parse().ok())
            .unwrap();
        let header = |line: &str| {
            line.split_once(": ").map(|(name, value)| (name.to_ascii_lowercase(), value.to_owned()))
        };
        Answer {
            status,
            headers: lines.filter_map(header).collect(),
            body: text[end + 4..].to_vec(),
        }
    }

    pub fn header(&self, name: &str) -> &str {
        self.headers.iter().find(|(known, _)| known == name).map_or("", |(_, value)| value)
    }

    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    /// The body as JSON; a picture as a JSON string, so that tables of operations can hold both.
    pub fn json(&self) -> Value {
        if self.header("content-type") == media_type("/v1/render") {
            return Value::String(self.text());
        }
        serde_json::from_slice(&self.body)
            .unwrap_or_else(|error| panic!("{error}: {}", self.text()))
    }

    /// Place and code of each item of `errors`.
    pub fn faults(&self) -> Vec<(String, String)> {
        let problem = self.json();
        let text = |value: &Value| value.as_str().unwrap().to_owned();
        let items = problem["errors"].as_array().cloned().unwrap_or_default();
        items.iter().map(|item| (text(&item["pointer"]), text(&item["code"]))).collect()
    }

    /// The pointer of the only item of `errors`.
    pub fn pointer(&self) -> String {
        let problem = self.json();
        let errors = problem["errors"].as_array().cloned().unwrap_or_default();
        assert_eq!(errors.len(), 1, "{problem}");
        errors[0]["pointer"].as_str().unwrap().to_owned()
    }
}

/// Every example of every operation: path, name, body.
pub fn examples() -> Vec<(&'static str, &'static str, Value)> {
    let of = |entry: &'static Entry| {
        let parsed = |example: &'static Example| {
            (entry.path, example.name, serde_json::from_str(example.body).unwrap())
        };
        entry.examples.iter().map(parsed)
    };
    TABLE.iter().flat_map(of).collect()
}

/// The specification as JSON.
pub fn specification() -> Value {
    serde_json::from_str(&springline::http::openapi().to_pretty_json().unwrap()).unwrap()
}

/// A validator of one schema of the specification, the others beside it.
pub fn validator(api: &Value, schema: &Value) -> jsonschema::Validator {
    let mut root = schema.as_object().unwrap().clone();
    root.insert("$schema".into(), "https://json-schema.org/draft/2020-12/schema".into());
    root.insert("components".into(), api["components"].clone());
    jsonschema::draft202012::new(&Value::Object(root)).unwrap()
}

pub fn request_validator(api: &Value, path: &str) -> jsonschema::Validator {
    validator(
        api,
        &api["paths"][path]["post"]["requestBody"]["content"]["application/json"]["schema"],
    )
}

/// What an operation answers with when it succeeds.
pub fn media_type(path: &str) -> &'static str {
    match path {
        "/v1/render" => "image/svg+xml",
        "/metrics" => "application/openmetrics-text",
        "/v1/batch" => "application/x-ndjson",
        "/favicon.svg" => "image/svg+xml",
        "/favicon.ico" => "image/x-icon",
        _ => "application/json",
    }
}

pub fn answer_validator(api: &Value, path: &str) -> jsonschema::Validator {
    validator(
        api,
        &api["paths"][path]["post"]["responses"]["200"]["content"][media_type(path)]["schema"],
    )
}

pub fn problem_validator(api: &Value) -> jsonschema::Validator {
    validator(api, &serde_json::json!({"$ref": "#/components/schemas/Problem"}))
}

pub fn assert_valid(validator: &jsonschema::Validator, value: &Value, what: &str) {
    let errors: Vec<String> = validator
        .iter_errors(value)
        .map(|error| format!("{}: {error}", error.instance_path()))
        .collect();
    assert!(errors.is_empty(), "{what}: {errors:#?}\n{value}");
}

/// Every place in a value with what is there, outermost first, as JSON Pointers.
pub fn places(value: &Value) -> Vec<(String, Value)> {
    let mut found = vec![(String::new(), value.clone())];
    match value {
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(i, item)| nest(&mut found, &i.to_string(), item))
        }
        Value::Object(fields) => {
            fields.iter().for_each(|(key, field)| nest(&mut found, key, field))
        }
        _ => {}
    }
    found
}

fn nest(found: &mut Vec<(String, Value)>, step: &str, value: &Value) {
    found.extend(
        places(value).into_iter().map(|(pointer, value)| (format!("/{step}{pointer}"), value)),
    );
}

/// The pointers of every object in a value.
pub fn objects(value: &Value) -> Vec<(String, Map<String, Value>)> {
    let object = |(pointer, value): (String, Value)| Some((pointer, value.as_object()?.clone()));
    places(value).into_iter().filter_map(object).collect()
}

/// A copy with the value at a pointer replaced.
pub fn with(value: &Value, pointer: &str, replacement: Value) -> Value {
    let mut copy = value.clone();
    *copy.pointer_mut(pointer).unwrap_or_else(|| panic!("no {pointer} in {value}")) = replacement;
    copy
}

/// A copy with a key added to, or replaced in, the object at a pointer.
pub fn with_key(value: &Value, pointer: &str, key: &str, added: Value) -> Value {
    let mut copy = value.clone();
    copy.pointer_mut(pointer).unwrap().as_object_mut().unwrap().insert(key.into(), added);
    copy
}

/// A copy with a key of the object at a pointer removed.
pub fn without_key(value: &Value, pointer: &str, key: &str) -> Value {
    let mut copy = value.clone();
    copy.pointer_mut(pointer).unwrap().as_object_mut().unwrap().remove(key).unwrap();
    copy
}

/// Whether a value has `null` anywhere.
pub fn has_null(value: &Value) -> bool {
    places(value).iter().any(|(_, value)| value.is_null())
}

/// The numbers of a value, in order.
pub fn numbers(value: &Value) -> Vec<f64> {
    places(value).iter().filter_map(|(_, value)| value.as_f64()).collect()
}

/// Items of a list are alike: the first two stand for all.
pub fn near_the_start_of_lists(place: &str) -> bool {
    place.split('/').all(|step| {
        step.parse::<usize>().is_ok_and(|index| index < 2) || step.parse::<usize>().is_err()
    })
}
