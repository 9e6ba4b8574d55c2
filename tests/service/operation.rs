//! What an operator relies on, each promise against the real binary, or against the service within
//! this process where a computation must take exactly as long as the test wants. What it costs is
//! measured elsewhere: no test here knows how fast the machine is. Whatever must happen is waited
//! for, without a limit.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use crate::support::*;
use axum::body::Body;
use axum::http::{HeaderValue, Request};
use http_body_util::BodyExt;
use serde_json::{Value, json};
use springline::api::cost::Cost;
use springline::core::context::Context;
use springline::http::middleware::Middleware;
use springline::http::service::Service;
use springline::server::config::Config;
use tokio::sync::oneshot;
use tokio::task::{JoinHandle, yield_now};
use tokio::time::Instant;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, ServerName};
use tokio_rustls::rustls::{ClientConfig, ClientConnection, RootCertStore, StreamOwned};
use tower::ServiceExt;

/// A fit that takes seconds.
fn endless() -> String {
    let points: Vec<[f64; 2]> = (0..60_000)
        .map(|i| f64::from(i) * 1e-3)
        .map(|t| [t, (3.0 * t).sin() + (17.0 * t).cos()])
        .collect();
    json!({"points": points, "solve": {"kind": "tolerance", "basis": {"family": "bezier"}, "tolerance": 1e-4}}).to_string()
}

fn small() -> Value {
    examples().into_iter().find(|(path, ..)| *path == "/v1/evaluate").unwrap().2
}

fn connect(server: &Server) -> TcpStream {
    TcpStream::connect(&server.address).unwrap()
}

fn post(path: &str, headers: &str, body: &str) -> Vec<u8> {
    let length = body.len();
    format!("POST {path} HTTP/1.1\r\nhost: test\r\ncontent-type: application/json\r\n{headers}content-length: {length}\r\n\r\n{body}")
        .into_bytes()
}

/// The service without its sockets.
struct Inside {
    service: Arc<Service>,
    edge: Middleware,
}

impl Inside {
    fn with(settings: &[&str]) -> Self {
        #[derive(clap::Parser)]
        struct Cli {
            #[command(flatten)]
            config: Config,
        }
        let Cli { config } = clap::Parser::parse_from([&["test"], settings].concat());
        let service = Service::start(&config.settings()).unwrap();
        Inside { edge: springline::http::service(&service, &[]), service }
    }

    async fn ask(&self, request: Request<Body>) -> Answer {
        let (head, body) = self.edge.clone().oneshot(request).await.unwrap().into_parts();
        let text = |value: &HeaderValue| value.to_str().unwrap().to_owned();
        let headers =
            head.headers.iter().map(|(name, value)| (name.to_string(), text(value))).collect();
        Answer {
            status: head.status.as_u16(),
            headers,
            body: body.collect().await.unwrap().to_bytes().to_vec(),
        }
    }

    async fn get(&self, path: &str) -> Answer {
        self.ask(Request::get(path).body(Body::empty()).unwrap()).await
    }

    async fn post(&self, path: &str, body: &Value) -> Answer {
        let request = Request::post(path).header("content-type", "application/json");
        self.ask(request.body(body.to_string().into()).unwrap()).await
    }

    /// Occupies a worker until told to go on; returns when it does.
    async fn occupied(&self) -> (std::sync::mpsc::Sender<()>, JoinHandle<()>) {
        let ((says, started), (go_on, wait)) = (oneshot::channel(), std::sync::mpsc::channel());
        let service = self.service.clone();
        let running = tokio::spawn(async move {
            let job = move |_: &Context| {
                says.send(()).unwrap();
                let _ = wait.recv();
            };
            let _ = service.pool.run(Instant::now() + Duration::from_secs(86_400), job).await;
        });
        started.await.unwrap();
        (go_on, running)
    }

    fn metric(&self, line: &str) -> bool {
        self.service.metrics.text().lines().any(|known| known == line)
    }
}

/// A fit that no thread of a connection computes itself.
fn medium() -> Value {
    let points: Vec<[f64; 2]> = (0..60).map(|i| f64::from(i) * 0.1).map(|t| [t, t.sin()]).collect();
    json!({"points": points, "solve": {"kind": "tolerance", "basis": {"family": "bezier"}, "tolerance": 1e-2}})
}

fn assert_problem(answer: &Answer, status: u16, code: &str) {
    assert_eq!(
        (answer.status, answer.json()["code"].as_str()),
        (status, Some(code)),
        "{}",
        answer.text()
    );
    assert_eq!(answer.header("content-type"), "application/problem+json");
    assert_valid(&problem_validator(&specification()), &answer.json(), code);
}

#[tokio::test]
async fn a_full_service_refuses_work_and_still_answers_what_is_small() {
    let inside = Inside::with(&["--workers", "1", "--queue", "1"]);
    let (go_on, _running) = inside.occupied().await;
    let request = medium();
    let waiting = inside.post("/v1/fit", &request);
    let meanwhile = async {
        while inside.service.pool.has_room(&Cost::other()) {
            yield_now().await;
        }
        let refused = inside.post("/v1/fit", &medium()).await;
        assert_problem(&refused, 503, "overloaded");
        assert_eq!(refused.header("retry-after"), "1");
        assert!(inside.metric("springline_shed_total{reason=\"queue\"} 1"));
        assert_eq!(inside.post("/v1/evaluate", &small()).await.status, 200);
        assert_eq!(
            (inside.get("/livez").await.status, inside.get("/readyz").await.status),
            (200, 200)
        );
        go_on.send(()).unwrap();
    };
    let (waited, ()) = tokio::join!(waiting, meanwhile);
    assert_eq!(waited.status, 200);
}

/// The clock stands still until nothing but time can go on.
#[tokio::test]
async fn the_deadline_answers_and_frees_the_worker() {
    let inside = Inside::with(&["--workers", "1", "--queue", "1"]);
    let (go_on, running) = inside.occupied().await;
    tokio::time::pause();
    assert_problem(&inside.post("/v1/fit", &medium()).await, 504, "deadline");
    assert!(inside.metric("springline_computations_cancelled_total{reason=\"deadline\"} 1"));
    tokio::time::resume();
    go_on.send(()).unwrap();
    running.await.unwrap();
    assert_eq!(inside.post("/v1/fit", &medium()).await.status, 200);
}

/// Of a computation that takes much longer than its time on any machine.
#[test]
fn what_runs_ends_at_its_deadline() {
    let server = Server::with(&["--workers", "1", "--deadline", "1ms"]);
    assert_problem(&server.post("/v1/fit", endless()), 504, "deadline");
    wait_until(|| server.metric("springline_computations_running") == 0.0);
    assert_eq!(server.metric("springline_computations_cancelled_total{reason=\"deadline\"}"), 1.0);
}

#[test]
fn a_client_that_leaves_ends_its_computation() {
    let server = Server::start();
    let mut stream = connect(&server);
    stream.write_all(&post("/v1/fit", "", &endless())).unwrap();
    let (running, cancelled) = (
        "springline_computations_running",
        "springline_computations_cancelled_total{reason=\"client\"}",
    );
    let done = "springline_requests_total{route=\"/v1/fit\",method=\"POST\",status=\"200\"}";
    wait_until(|| server.metric(running) == 1.0 || server.metric(done) == 1.0);
    drop(stream);
    wait_until(|| server.metric(running) == 0.0);
    assert_eq!(server.metric(cancelled) + server.metric(done), 1.0);
}

/// What the server sends until it closes.
fn until_closed(mut stream: TcpStream) -> Vec<u8> {
    let mut sent = Vec::new();
    let ended = stream.read_to_end(&mut sent);
    assert!(
        ended.is_ok()
            || ended.is_err_and(|error| error.kind() == std::io::ErrorKind::ConnectionReset),
        "still open"
    );
    sent
}

/// Whom one setting closes, with the others at a day: how exact the limits are is tested beside
/// their code.
#[test]
fn slow_clients_are_closed_each_by_its_limit() {
    let half_a_body =
        post("/v1/evaluate", "", "{     }").split_last_chunk::<4>().unwrap().0.to_vec();
    let cases: [(&str, &str, &[u8], &str); 4] = [
        ("--header-time", "head", b"", ""),
        ("--header-time", "head", b"POST /v1/evaluate HTTP/1.1\r\nhost: te", ""),
        ("--body-time", "", &half_a_body, "HTTP/1.1 408"),
        ("--idle-time", "idle", b"GET /livez HTTP/1.1\r\nhost: test\r\n\r\n", "HTTP/1.1 200"),
    ];
    for (setting, reason, sent, answered) in cases {
        let times = ["--header-time", "--body-time", "--idle-time", "--answer-time"];
        let settings =
            times.map(|name| [name, if name == setting { "200ms" } else { "1d" }]).concat();
        let server = Server::with(&settings);
        let mut stream = connect(&server);
        // Of a head that may take 200 ms not even the first half need arrive in time.
        let _ = stream.write_all(sent);
        let heard = until_closed(stream);
        let text = String::from_utf8_lossy(&heard);
        assert!(
            text.starts_with(answered) && text.is_empty() == answered.is_empty(),
            "{setting}: {text}"
        );
        assert!(setting != "--body-time" || text.contains("body_timeout"), "{text}");
        assert!(
            reason.is_empty()
                || server
                    .metric(&format!("springline_connections_closed_total{{reason=\"{reason}\"}}"))
                    >= 1.0
        );
    }
}

#[test]
fn a_client_that_does_not_read_is_closed_and_holds_nothing() {
    let server = Server::with(&["--answer-time", "200ms"]);
    let curve =
        json!({"family": "bezier", "control_points": [[0, 0, 1], [1, 3, 2], [4, 3, 5], [5, 0, 7]]});
    let large =
        json!({"curve": curve, "sampling": {"kind": "count", "count": 200_000}, "derivatives": 2})
            .to_string();
    let mut stream = connect(&server);
    stream.write_all(&post("/v1/evaluate", "", &large)).unwrap();
    wait_until(|| server.metric("springline_connections_closed_total{reason=\"answer\"}") == 1.0);
    assert_eq!(server.metric("springline_held_bytes"), 0.0, "what was not read is given back");
}

#[test]
fn connections_beyond_the_limit_are_told_so() {
    let server = Server::with(&["--connections", "2"]);
    // Who is answered has been taken.
    let held = [(); 2].map(|()| {
        let mut stream = connect(&server);
        stream.write_all(b"GET /livez HTTP/1.1\r\nhost: test\r\n\r\n").unwrap();
        stream.read_exact(&mut [0; 12]).unwrap();
        stream
    });
    let ask = || server.raw(b"GET /livez HTTP/1.1\r\nhost: test\r\nconnection: close\r\n\r\n");
    assert_problem(&ask(), 503, "overloaded");
    drop(held);
    wait_until(|| ask().status == 200);
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
    assert_eq!(server.metric("springline_held_bytes"), 0.0);
    assert!(server.metric("springline_shed_total{reason=\"memory\"}") >= 2.0);
}

#[test]
fn sizes_are_settings() {
    let server = Server::with(&[
        "--max-body",
        "2KiB",
        "--max-depth",
        "8",
        "--max-samples",
        "10",
        "--max-degree",
        "5",
    ]);
    assert_problem(
        &server.post("/v1/evaluate", format!("{}{}", " ".repeat(2048), small())),
        413,
        "too_large",
    );
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
    let answer = server.ok(
        "/v1/evaluate",
        &json!({"curve": curve, "sampling": {"kind": "count", "count": 50_000}}),
    );
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
    stream
        .write_all(&post(path, &format!("connection: close\r\n{headers}"), &small().to_string()))
        .unwrap();
    Answer::parse(&until_closed(stream)).status
}

#[test]
fn keys_open_operations_and_metrics_and_nothing_else_needs_them() {
    let path = key_file("keys", "# two\nfirst\n\nsecond\n");
    let mut command = binary();
    command.args([
        "--listen",
        "127.0.0.1:0",
        "--log",
        "error",
        "--api-keys",
        "given,other",
        "--api-keys-file",
        path.to_str().unwrap(),
    ]);
    let log = Log::of(&mut command);
    let server = Server::run(command);
    assert_problem(&server.post_json("/v1/evaluate", &small()), 401, "unauthorized");
    assert_eq!(server.post_json("/v1/evaluate", &small()).header("www-authenticate"), "Bearer");
    assert_eq!(server.get("/metrics").status, 401);
    for open in ["/livez", "/readyz", "/docs/", "/openapi.json"] {
        assert_eq!(server.get(open).status, 200, "{open}");
    }
    let evaluate = |headers: &str| status_with(&server, "/v1/evaluate", headers);
    for good in [
        "authorization: Bearer given\r\n",
        "x-api-key: other\r\n",
        "x-api-key: first\r\n",
        "Authorization: bearer second\r\n",
    ] {
        assert_eq!(evaluate(good), 200, "{good}");
    }
    for bad in [
        "authorization: Bearer givem\r\n",
        "x-api-key: #\r\n",
        "x-api-key: \r\n",
        "authorization: Basic given\r\n",
    ] {
        assert_eq!(evaluate(bad), 401, "{bad}");
    }
    std::fs::write(&path, "third\n").unwrap();
    wait_until(|| evaluate("x-api-key: third\r\n") == 200);
    assert_eq!(evaluate("x-api-key: first\r\n"), 401, "the old key is gone");
    std::fs::write(&path, "# none\n").unwrap();
    log.wait_for("the API keys stay as they were");
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
    assert_eq!(
        (answer.status, answer.header("access-control-allow-origin")),
        (200, "https://cad.example")
    );
    assert!(answer.header("access-control-allow-headers").contains("content-type"));
    assert_eq!(
        preflight(&server, "https://evil.example").header("access-control-allow-origin"),
        ""
    );
    // A page must be able to read why it was refused.
    let refused = server
        .raw(b"POST /v1/evaluate HTTP/1.1\r\nhost: t\r\norigin: https://cad.example\r\ncontent-length: 0\r\nconnection: close\r\n\r\n");
    assert_eq!(
        (refused.status, refused.header("access-control-allow-origin")),
        (401, "https://cad.example")
    );
    assert!(refused.header("access-control-expose-headers").contains("x-request-id"));
}

#[test]
fn tls_is_spoken_where_a_certificate_is_set() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/tls");
    let (certificate, key) = (format!("{folder}/cert.pem"), format!("{folder}/key.pem"));
    let settings = ["--tls-cert", &certificate, "--tls-key", &key];
    let server = Server::with(&settings);
    let mut roots = RootCertStore::empty();
    roots.add(CertificateDer::from_pem_file(&certificate).unwrap()).unwrap();
    let provider = Arc::new(tokio_rustls::rustls::crypto::ring::default_provider());
    let client = ClientConfig::builder_with_provider(provider)
        .with_safe_default_protocol_versions()
        .unwrap();
    let client = Arc::new(client.with_root_certificates(roots).with_no_client_auth());
    let connection =
        ClientConnection::new(client, ServerName::try_from("localhost").unwrap()).unwrap();
    let mut stream = StreamOwned::new(connection, connect(&server));
    stream.write_all(&post("/v1/evaluate", "connection: close\r\n", &small().to_string())).unwrap();
    let mut text = Vec::new();
    let _ = stream.read_to_end(&mut text);
    assert_eq!(Answer::parse(&text).status, 200);
    // A client that never shakes hands is closed too.
    until_closed(connect(&Server::with(&[&settings[..], &["--header-time", "200ms"]].concat())));
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
    let elsewhere = |path: &str| {
        ureq::get(format!("http://{port}{path}"))
            .call()
            .unwrap()
            .body_mut()
            .read_to_string()
            .unwrap()
    };
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
        let head =
            format!("GET /v1/nothing HTTP/1.1\r\nhost: t\r\n{headers}connection: close\r\n\r\n");
        server.raw(head.as_bytes()).header("x-request-id").to_owned()
    };
    assert_eq!(ask("x-request-id: mine-1\r\n"), "mine-1");
    assert!(ask("").len() >= 32 && ask("") != ask(""));
    assert!(!ask("x-request-id: not fit to be logged\r\n").contains("fit"));
    assert!(ask(&format!("x-request-id: {}\r\n", "x".repeat(129))).len() < 100);
    ask(
        "x-request-id: mine-2\r\ntraceparent: 00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01\r\n",
    );
    let line = log.wait_for("mine-2");
    let line: Value = serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: {line}"));
    assert_eq!(line["trace_id"], "4bf92f3577b34da6a3ce929d0e0e4736");
    assert_eq!(
        (&line["status"], &line["path"], &line["level"]),
        (&json!(404), &json!("/v1/nothing"), &json!("INFO"))
    );
}

#[test]
fn spans_are_sent_to_the_collector() {
    let collector = TcpListener::bind("127.0.0.1:0").unwrap();
    let endpoint = format!("http://{}", collector.local_addr().unwrap());
    let mut server = Server::with(&["--otlp-endpoint", &endpoint]);
    let received = thread::spawn(move || {
        let (stream, _) = collector.accept().unwrap();
        let mut reader = BufReader::new(stream);
        let mut head = String::new();
        while !head.ends_with("\r\n\r\n") {
            assert!(reader.read_line(&mut head).unwrap() > 0, "{head}");
        }
        let length = head
            .to_ascii_lowercase()
            .split("content-length: ")
            .nth(1)
            .unwrap()
            .split("\r\n")
            .next()
            .unwrap()
            .parse()
            .unwrap();
        let mut body = vec![0; length];
        reader.read_exact(&mut body).unwrap();
        reader.get_mut().write_all(b"HTTP/1.1 200 OK\r\ncontent-length: 0\r\n\r\n").unwrap();
        [head.into_bytes(), body].concat()
    });
    status_with(
        &server,
        "/v1/evaluate",
        "traceparent: 00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01\r\n",
    );
    server.signal("TERM");
    let text = received.join().unwrap();
    let has = |part: &[u8]| text.windows(part.len()).any(|window| window == part);
    assert!(
        has(b"POST /v1/traces ") && has(b"POST /v1/evaluate"),
        "{}",
        String::from_utf8_lossy(&text)
    );
    let trace: Vec<u8> = (0..16)
        .map(|i| {
            u8::from_str_radix(&"4bf92f3577b34da6a3ce929d0e0e4736"[2 * i..2 * i + 2], 16).unwrap()
        })
        .collect();
    assert!(has(&trace), "the trace goes on");
    assert!(server.wait().success());
}

/// A connection of its own, which need not be told to go.
fn status_of(server: &Server, path: &str) -> u16 {
    server
        .raw(format!("GET {path} HTTP/1.1\r\nhost: t\r\nconnection: close\r\n\r\n").as_bytes())
        .status
}

#[test]
fn a_stopping_service_says_so_serves_on_and_finishes_what_runs() {
    let server = Server::with(&["--grace", "1d"]);
    server.signal("TERM");
    wait_until(|| status_of(&server, "/readyz") == 503);
    let answer = server.raw(&post("/v1/evaluate", "", &small().to_string()));
    assert_eq!(
        (answer.status, answer.header("connection")),
        (200, "close"),
        "still served, and told to go"
    );

    let mut server = Server::with(&["--grace", "0s", "--drain", "1d", "--body-time", "1d"]);
    let (whole, (mut running, idle, mut half)) = (
        post("/v1/evaluate", "", &small().to_string()),
        (connect(&server), connect(&server), connect(&server)),
    );
    let (first, rest) = whole.split_at(whole.len() - 10);
    running.write_all(first).unwrap();
    half.write_all(b"GET /livez HT").unwrap();
    // The metrics are asked for by one, too.
    wait_until(|| server.metric("springline_requests_in_flight") == 2.0);
    server.signal("TERM");
    assert_eq!((until_closed(idle), until_closed(half)), (Vec::new(), Vec::new()));
    wait_until(|| TcpStream::connect(&server.address).is_err());
    running.write_all(rest).unwrap();
    assert_eq!(Answer::parse(&until_closed(running)).status, 200, "what ran was finished");
    assert_eq!(server.wait().code(), Some(0));
}

#[test]
fn a_second_signal_stops_at_once() {
    let mut server = Server::with(&["--grace", "1d"]);
    server.signal("TERM");
    wait_until(|| status_of(&server, "/readyz") == 503);
    server.signal("TERM");
    assert_eq!(server.wait().code(), Some(0));
}

#[test]
fn healthcheck_asks_the_service() {
    let server = Server::start();
    let check =
        |args: &[&str]| binary().arg("healthcheck").args(args).output().unwrap().status.code();
    assert_eq!(check(&["--listen", &server.address]), Some(0));
    let address = server.address.clone();
    drop(server);
    assert_eq!(check(&["--listen", &address]), Some(1));
}

#[test]
fn who_starts_the_service_need_not_read_what_it_prints() {
    let alive = |address: &str| {
        binary().args(["healthcheck", "--listen", address]).status().unwrap().success()
    };
    // Another process may take a free port before the service does, which then ends.
    let started = || {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
        let mut child = binary().args(["--listen", &address]).stdout(writer).spawn().unwrap();
        while child.try_wait().unwrap().is_none() {
            if alive(&address) {
                return Some(child);
            }
        }
        None
    };
    let mut child = std::iter::repeat_with(started).flatten().next().unwrap();
    child.kill().unwrap();
    child.wait().unwrap();
}
