//! What an operator relies on, each promise against the real binary. What it costs is measured elsewhere: here are no fast clocks.

mod support;

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use support::*;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, ServerName};
use tokio_rustls::rustls::{ClientConfig, ClientConnection, RootCertStore, StreamOwned};

/// A fit that takes seconds.
fn endless() -> String {
    let points: Vec<[f64; 2]> = (0..60_000).map(|i| f64::from(i) * 1e-3).map(|t| [t, (3.0 * t).sin() + (17.0 * t).cos()]).collect();
    json!({"points": points, "solve": {"kind": "tolerance", "basis": {"family": "bezier"}, "tolerance": 1e-4}}).to_string()
}

fn small() -> Value {
    examples().into_iter().find(|(path, ..)| *path == "/v1/evaluate").unwrap().2
}

fn connect(server: &Server) -> TcpStream {
    let stream = TcpStream::connect(&server.address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    stream
}

fn post(path: &str, headers: &str, body: &str) -> Vec<u8> {
    let length = body.len();
    format!("POST {path} HTTP/1.1\r\nhost: test\r\ncontent-type: application/json\r\n{headers}content-length: {length}\r\n\r\n{body}")
        .into_bytes()
}

/// Sends a request and leaves it at that.
fn begin(server: &Server, body: &str) -> TcpStream {
    let mut stream = connect(server);
    stream.write_all(&post("/v1/fit", "", body)).unwrap();
    stream
}

fn metric(server: &Server, name: &str) -> f64 {
    let text = server.get("/metrics").text();
    let lines = text.lines().filter(|line| line.starts_with(name) && !line.starts_with('#'));
    lines.filter_map(|line| line.rsplit(' ').next()?.parse::<f64>().ok()).sum()
}

fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < Duration::from_secs(20), "{what} did not come about");
        thread::sleep(Duration::from_millis(10));
    }
}

fn assert_problem(answer: &Answer, status: u16, code: &str) {
    assert_eq!((answer.status, answer.json()["code"].as_str()), (status, Some(code)), "{}", answer.text());
    assert_eq!(answer.header("content-type"), "application/problem+json");
    assert_valid(&problem_validator(&specification()), &answer.json(), code);
}

#[test]
fn a_full_service_refuses_work_and_still_answers_what_is_small() {
    let server = Server::with(&["--workers", "1", "--queue", "1"]);
    let body = endless();
    let held: Vec<TcpStream> = (0..2).map(|_| begin(&server, &body)).collect();
    wait_until("a full queue", || metric(&server, "springline_computations_running") + metric(&server, "springline_queue_depth") == 2.0);
    let refused = server.post("/v1/fit", &body);
    assert_problem(&refused, 503, "overloaded");
    assert_eq!(refused.header("retry-after"), "1");
    assert!(metric(&server, "springline_shed_total{reason=\"queue\"}") >= 1.0);
    assert_eq!(server.post_json("/v1/evaluate", &small()).status, 200);
    assert_eq!((server.get("/livez").status, server.get("/readyz").status), (200, 200));
    drop(held);
    wait_until("an empty queue", || {
        server.post_json("/v1/evaluate", &small()).status == 200 && metric(&server, "springline_computations_running") == 0.0
    });
    assert!(metric(&server, "springline_computations_cancelled_total{reason=\"client\"}") >= 1.0, "those who left were noticed");
}

#[test]
fn the_deadline_answers_and_frees_the_worker() {
    let server = Server::with(&["--workers", "1", "--queue", "0", "--deadline", "200ms"]);
    assert_problem(&server.post("/v1/fit", endless()), 504, "deadline");
    wait_until("a free worker", || metric(&server, "springline_computations_running") == 0.0);
    assert!(metric(&server, "springline_computations_cancelled_total{reason=\"deadline\"}") == 1.0);
}

/// Until the server closes; what it sent before.
fn until_closed(mut stream: TcpStream) -> (Duration, Vec<u8>) {
    let (start, mut sent) = (Instant::now(), Vec::new());
    let ended = stream.read_to_end(&mut sent);
    assert!(ended.is_ok() || ended.is_err_and(|error| error.kind() == std::io::ErrorKind::ConnectionReset), "still open");
    (start.elapsed(), sent)
}

#[test]
fn slow_clients_are_closed_each_within_its_limit() {
    let limits = ["--header-time", "300ms", "--body-time", "600ms", "--idle-time", "900ms"];
    let server = Server::with(&limits);
    let opened = |bytes: &[u8]| {
        let mut stream = connect(&server);
        stream.write_all(bytes).unwrap();
        stream
    };
    let cases = [
        ("silent", 300, opened(b"")),
        ("half a head", 300, opened(b"POST /v1/evaluate HTTP/1.1\r\nhost: te")),
        ("half a body", 600, opened(post("/v1/evaluate", "", "{     }").split_last_chunk::<4>().unwrap().0)),
        ("idle", 900, opened(b"GET /livez HTTP/1.1\r\nhost: test\r\n\r\n")),
    ];
    let start = Instant::now();
    let waiting = cases.map(|(name, limit, stream)| (name, limit, thread::spawn(move || until_closed(stream))));
    for (name, limit, waiting) in waiting {
        let (_, sent) = waiting.join().unwrap();
        let least = Duration::from_millis(limit - 50);
        assert!(start.elapsed() >= least, "{name} was closed early");
        let text = String::from_utf8_lossy(&sent).into_owned();
        match name {
            "half a body" => assert!(text.starts_with("HTTP/1.1 408") && text.contains("body_timeout"), "{name}: {text}"),
            "idle" => assert!(text.starts_with("HTTP/1.1 200"), "{name}: {text}"),
            _ => assert_eq!(text, "", "{name}"),
        }
    }
    for reason in ["head", "idle"] {
        assert!(metric(&server, &format!("springline_connections_closed_total{{reason=\"{reason}\"}}")) >= 1.0, "{reason}");
    }
}

#[test]
fn a_dripping_head_is_closed_and_a_client_that_does_not_read_too() {
    let server = Server::with(&["--header-time", "400ms", "--answer-time", "700ms"]);
    let mut dripping = connect(&server);
    let start = Instant::now();
    let dripped = b"GET /livez HTTP/1.1\r\nhost: test\r\nx-long: ".iter().cycle().take_while(|byte| {
        thread::sleep(Duration::from_millis(20));
        dripping.write_all(&[**byte]).is_ok() && start.elapsed() < Duration::from_secs(10)
    });
    dripped.count();
    assert!(start.elapsed() < Duration::from_secs(5), "the drip went on");
    let curve = json!({"family": "bezier", "control_points": [[0, 0, 1], [1, 3, 2], [4, 3, 5], [5, 0, 7]]});
    let large = json!({"curve": curve, "sampling": {"kind": "count", "count": 200_000}, "derivatives": 2}).to_string();
    let mut stream = connect(&server);
    stream.write_all(&post("/v1/evaluate", "", &large)).unwrap();
    wait_until("an end", || metric(&server, "springline_connections_closed_total{reason=\"answer\"}") == 1.0);
    assert_eq!(metric(&server, "springline_held_bytes"), 0.0, "what was not read is given back");
}

#[test]
fn connections_beyond_the_limit_are_told_so() {
    let server = Server::with(&["--connections", "2"]);
    let held = [connect(&server), connect(&server)];
    thread::sleep(Duration::from_millis(100));
    let refused = server.raw(b"GET /livez HTTP/1.1\r\nhost: test\r\n\r\n");
    assert_problem(&refused, 503, "overloaded");
    drop(held);
    wait_until("room", || {
        TcpStream::connect(&server.address).is_ok()
            && server.raw(b"GET /livez HTTP/1.1\r\nconnection: close\r\nhost: t\r\n\r\n").status == 200
    });
}

#[test]
fn bodies_and_answers_beyond_the_memory_are_refused_before_they_are_held() {
    let server = Server::with(&["--memory", "600KiB"]);
    let body = format!("{}{}", " ".repeat(700 * 1024), small());
    assert_problem(&server.post("/v1/evaluate", &body), 503, "overloaded");
    let curve = json!({"family": "bezier", "control_points": [[0, 0], [1, 3], [4, 3], [5, 0]]});
    let large = json!({"curve": curve, "sampling": {"kind": "count", "count": 40_000}});
    assert_problem(&server.post_json("/v1/evaluate", &large), 503, "overloaded");
    assert_eq!(server.post_json("/v1/evaluate", &small()).status, 200);
    assert_eq!(metric(&server, "springline_held_bytes"), 0.0);
    assert!(metric(&server, "springline_shed_total{reason=\"memory\"}") >= 2.0);
}

#[test]
fn sizes_are_settings() {
    let server = Server::with(&["--max-body", "2KiB", "--max-depth", "8", "--max-samples", "10", "--max-degree", "5"]);
    assert_problem(&server.post("/v1/evaluate", format!("{}{}", " ".repeat(2048), small())), 413, "too_large");
    assert_problem(&server.post("/v1/evaluate", "[".repeat(9)), 413, "too_large");
    let of = |points: usize, count: usize| {
        let points: Vec<[usize; 2]> = (0..points).map(|i| [i, i * i]).collect();
        json!({"curve": {"family": "bezier", "control_points": points}, "sampling": {"kind": "count", "count": count}})
    };
    assert_eq!(server.post_json("/v1/evaluate", &of(6, 10)).status, 200);
    assert_problem(&server.post_json("/v1/evaluate", &of(6, 11)), 413, "too_large");
    assert_ne!(server.post_json("/v1/evaluate", &of(7, 10)).status, 200);
}

#[test]
fn a_large_answer_is_sent_in_sheets_and_arrives_whole() {
    let server = Server::start();
    let curve = json!({"family": "bezier", "control_points": [[0, 0], [1, 3], [4, 3], [5, 0]]});
    let answer = server.ok("/v1/evaluate", &json!({"curve": curve, "sampling": {"kind": "count", "count": 50_000}}));
    assert_eq!(answer["points"].as_array().unwrap().len(), 50_000);
    assert_eq!(answer["points"][49_999], json!([5.0, 0.0]));
}

fn key_file(name: &str, text: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, text).unwrap();
    path
}

/// The status of a small request with these headers.
fn status_with(server: &Server, path: &str, headers: &str) -> u16 {
    let mut stream = connect(server);
    stream.write_all(&post(path, &format!("connection: close\r\n{headers}"), &small().to_string())).unwrap();
    Answer::parse(&until_closed(stream).1).status
}

#[test]
fn keys_open_operations_and_metrics_and_nothing_else_needs_them() {
    let path = key_file("keys", "# two\nfirst\n\nsecond\n");
    let server = Server::with(&["--api-keys", "given,other", "--api-keys-file", path.to_str().unwrap()]);
    assert_problem(&server.post_json("/v1/evaluate", &small()), 401, "unauthorized");
    assert_eq!(server.post_json("/v1/evaluate", &small()).header("www-authenticate"), "Bearer");
    assert_eq!(server.get("/metrics").status, 401);
    for open in ["/livez", "/readyz", "/docs/", "/openapi.json"] {
        assert_eq!(server.get(open).status, 200, "{open}");
    }
    let evaluate = |headers: &str| status_with(&server, "/v1/evaluate", headers);
    for good in ["authorization: Bearer given\r\n", "x-api-key: other\r\n", "x-api-key: first\r\n", "Authorization: bearer second\r\n"] {
        assert_eq!(evaluate(good), 200, "{good}");
    }
    for bad in ["authorization: Bearer givem\r\n", "x-api-key: #\r\n", "x-api-key: \r\n", "authorization: Basic given\r\n"] {
        assert_eq!(evaluate(bad), 401, "{bad}");
    }
    std::fs::write(&path, "third\n").unwrap();
    wait_until("the new key", || evaluate("x-api-key: third\r\n") == 200);
    assert_eq!(evaluate("x-api-key: first\r\n"), 401, "the old key is gone");
    std::fs::write(&path, "# none\n").unwrap();
    thread::sleep(Duration::from_millis(1500));
    assert_eq!(evaluate("x-api-key: third\r\n"), 200, "a file without keys changes nothing");
}

#[test]
fn other_origins_may_call_only_if_named() {
    let preflight = |server: &Server, origin: &str| {
        let head = format!(
            "OPTIONS /v1/evaluate HTTP/1.1\r\nhost: t\r\norigin: {origin}\r\naccess-control-request-method: POST\r\naccess-control-request-headers: content-type\r\nconnection: close\r\n\r\n"
        );
        server.raw(head.as_bytes())
    };
    let closed = Server::start();
    assert_eq!(preflight(&closed, "https://cad.example").header("access-control-allow-origin"), "");
    let server = Server::with(&["--cors-origins", "https://cad.example", "--api-keys", "key"]);
    let answer = preflight(&server, "https://cad.example");
    assert_eq!((answer.status, answer.header("access-control-allow-origin")), (200, "https://cad.example"));
    assert!(answer.header("access-control-allow-headers").contains("content-type"));
    assert_eq!(preflight(&server, "https://evil.example").header("access-control-allow-origin"), "");
    // A page must be able to read why it was refused.
    let refused = server
        .raw(b"POST /v1/evaluate HTTP/1.1\r\nhost: t\r\norigin: https://cad.example\r\ncontent-length: 0\r\nconnection: close\r\n\r\n");
    assert_eq!((refused.status, refused.header("access-control-allow-origin")), (401, "https://cad.example"));
    assert!(refused.header("access-control-expose-headers").contains("x-request-id"));
}

#[test]
fn tls_is_spoken_where_a_certificate_is_set() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/tls");
    let (certificate, key) = (format!("{folder}/cert.pem"), format!("{folder}/key.pem"));
    let server = Server::with(&["--tls-cert", &certificate, "--tls-key", &key, "--header-time", "500ms"]);
    let mut roots = RootCertStore::empty();
    roots.add(CertificateDer::from_pem_file(&certificate).unwrap()).unwrap();
    let provider = Arc::new(tokio_rustls::rustls::crypto::ring::default_provider());
    let client = ClientConfig::builder_with_provider(provider).with_safe_default_protocol_versions().unwrap();
    let client = Arc::new(client.with_root_certificates(roots).with_no_client_auth());
    let connection = ClientConnection::new(client, ServerName::try_from("localhost").unwrap()).unwrap();
    let mut stream = StreamOwned::new(connection, connect(&server));
    stream.write_all(&post("/v1/evaluate", "connection: close\r\n", &small().to_string())).unwrap();
    let mut text = Vec::new();
    let _ = stream.read_to_end(&mut text);
    assert_eq!(Answer::parse(&text).status, 200);
    // A client that never shakes hands is closed too.
    until_closed(connect(&server));
}

#[test]
fn metrics_count_by_route_and_status_and_can_live_elsewhere() {
    let server = Server::start();
    server.post_json("/v1/evaluate", &small());
    server.post("/v1/evaluate", "{");
    server.get("/nothing");
    let text = server.get("/metrics").text();
    for line in [
        r#"springline_requests_total{route="/v1/evaluate",method="POST",status="200"} 1"#,
        r#"springline_requests_total{route="/v1/evaluate",method="POST",status="400"} 1"#,
        r#"springline_requests_total{route="none",method="GET",status="404"} 1"#,
        r#"springline_request_duration_seconds_count{route="/v1/evaluate"} 2"#,
        "springline_requests_in_flight 1",
        "springline_panics_total 0",
        "springline_connections ",
        "springline_queue_depth 0",
        "springline_build_info{version=",
        "# EOF",
    ] {
        assert!(text.contains(line), "no {line} in {text}");
    }
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let server = Server::with(&["--metrics-listen", &port.to_string(), "--api-keys", "key"]);
    assert_eq!(status_with(&server, "/v1/evaluate", "x-api-key: key\r\n"), 200);
    let elsewhere = |path: &str| ureq::get(format!("http://{port}{path}")).call().unwrap().body_mut().read_to_string().unwrap();
    assert!(elsewhere("/metrics").contains(r#"route="/v1/evaluate""#));
    assert!(elsewhere("/livez").contains("ok"));
}

#[test]
fn a_request_has_an_id_that_is_logged_with_its_trace() {
    let mut command = binary();
    command.args(["--listen", "127.0.0.1:0", "--grace", "0s"]);
    let log = Log::of(&mut command);
    let server = Server::run(command);
    let ask = |headers: &str| {
        let head = format!("GET /v1/nothing HTTP/1.1\r\nhost: t\r\n{headers}connection: close\r\n\r\n");
        server.raw(head.as_bytes()).header("x-request-id").to_owned()
    };
    assert_eq!(ask("x-request-id: mine-1\r\n"), "mine-1");
    assert!(ask("").len() >= 32 && ask("") != ask(""));
    assert!(!ask("x-request-id: not fit to be logged\r\n").contains("fit"));
    assert!(ask(&format!("x-request-id: {}\r\n", "x".repeat(129))).len() < 100);
    ask("x-request-id: mine-2\r\ntraceparent: 00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01\r\n");
    let line = log.wait_for("mine-2");
    let line: Value = serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: {line}"));
    assert_eq!(line["trace_id"], "4bf92f3577b34da6a3ce929d0e0e4736");
    assert_eq!((&line["status"], &line["path"], &line["level"]), (&json!(404), &json!("/v1/nothing"), &json!("INFO")));
}

#[test]
fn spans_are_sent_to_the_collector() {
    let collector = TcpListener::bind("127.0.0.1:0").unwrap();
    let endpoint = format!("http://{}", collector.local_addr().unwrap());
    let mut server = Server::with(&["--otlp-endpoint", &endpoint]);
    let received = thread::spawn(move || {
        let (mut stream, _) = collector.accept().unwrap();
        stream.set_read_timeout(Some(Duration::from_millis(1000))).unwrap();
        let mut text = Vec::new();
        let _ = stream.read_to_end(&mut text);
        let _ = stream.write_all(b"HTTP/1.1 200 OK\r\ncontent-length: 0\r\n\r\n");
        text
    });
    status_with(&server, "/v1/evaluate", "traceparent: 00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01\r\n");
    server.signal("TERM");
    let text = received.join().unwrap();
    let has = |part: &[u8]| text.windows(part.len()).any(|window| window == part);
    assert!(has(b"POST /v1/traces ") && has(b"POST /v1/evaluate"), "{}", String::from_utf8_lossy(&text));
    let trace: Vec<u8> = (0..16).map(|i| u8::from_str_radix(&"4bf92f3577b34da6a3ce929d0e0e4736"[2 * i..2 * i + 2], 16).unwrap()).collect();
    assert!(has(&trace), "the trace goes on");
    assert!(server.wait(Duration::from_secs(10)).success());
}

#[test]
fn a_stopping_service_says_so_serves_on_and_finishes_what_runs() {
    let mut server = Server::with(&["--grace", "1s", "--drain", "30s", "--deadline", "60s"]);
    let points: Vec<[f64; 2]> = (0..20_000).map(|i| f64::from(i) * 1e-3).map(|t| [t, (3.0 * t).sin()]).collect();
    let body = json!({"points": points, "solve": {"kind": "tolerance", "basis": {"family": "bezier"}, "tolerance": 1e-3}}).to_string();
    let running = begin(&server, &body);
    let idle = connect(&server);
    let mut half = connect(&server);
    half.write_all(b"GET /livez HT").unwrap();
    wait_until("a running fit", || metric(&server, "springline_requests_in_flight") >= 2.0);
    server.signal("TERM");
    wait_until("not ready", || server.raw(b"GET /readyz HTTP/1.1\r\nhost: t\r\nconnection: close\r\n\r\n").status == 503);
    let answer = server.raw(&post("/v1/evaluate", "", &small().to_string()));
    assert_eq!((answer.status, answer.header("connection")), (200, "close"), "still served, and told to go");
    let (_, answer) = until_closed(running);
    assert_eq!(Answer::parse(&answer).status, 200, "what ran was finished");
    assert_eq!(server.wait(Duration::from_secs(10)).code(), Some(0));
    drop((idle, half));
}

#[test]
fn a_second_signal_stops_at_once() {
    let mut server = Server::with(&["--grace", "60s"]);
    server.signal("TERM");
    wait_until("not ready", || server.get("/readyz").status == 503);
    server.signal("TERM");
    assert_eq!(server.wait(Duration::from_secs(5)).code(), Some(0));
}

#[test]
fn healthcheck_asks_the_service() {
    let server = Server::start();
    let check = |args: &[&str]| binary().arg("healthcheck").args(args).output().unwrap().status.code();
    assert_eq!(check(&["--listen", &server.address]), Some(0));
    let address = server.address.clone();
    drop(server);
    assert_eq!(check(&["--listen", &address]), Some(1));
}

#[test]
fn who_starts_the_service_need_not_read_what_it_prints() {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let mut child = binary().args(["--listen", &address]).stdout(writer).spawn().unwrap();
    wait_until("the service", || TcpStream::connect(&address).is_ok());
    assert!(binary().args(["healthcheck", "--listen", &address]).status().unwrap().success());
    child.kill().unwrap();
    child.wait().unwrap();
}
