//! The service over loopback against the floor: server CPU for each request, and latencies, as
//! ratios within one run.
//!
//! Each server has the first core to itself while it is driven, and the clients the second
//! (`taskset`); the service logs as by default.

use std::collections::HashMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use axum::Router;
use axum::body::Bytes;
use axum::http::{HeaderMap, header};
use axum::response::{IntoResponse, Response};
use axum::routing::{MethodRouter, post};
use serde::{Serialize, Serializer};
use serde_json::{Value, json};
use springline::api::chunks::Buffer;
use springline::api::json::from_bytes;
use springline::api::memory;
use springline::api::operations::{self, Operation, Output, Visitor};
use springline::api::output::{Format, RAW};
use springline::core::context::Context;

/// As in the service.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

const ROUNDS: usize = 7;
/// How long each server is driven in each round.
const SLICE: Duration = Duration::from_millis(600);
/// Clients at once while CPU is measured.
const CLIENTS: usize = 8;

fn main() {
    match std::env::args().nth(1).as_deref() {
        Some("floor") => floor(),
        Some("batch") => {
            move_to_the_second_core();
            batch();
        }
        Some("compression") => {
            move_to_the_second_core();
            compression();
        }
        filter => {
            move_to_the_second_core();
            compare(filter.unwrap_or(""));
            if filter.is_none() {
                compression();
                batch();
            }
        }
    }
}

// ---- the floor

/// A ready answer, how long it is as JSON, and its bytes in the raw format.
struct Ready {
    answer: Tree,
    length: usize,
    raw: Bytes,
}

/// An answer as a struct of lists of numbers, which is written as fast as a struct declared for it.
enum Tree {
    Numbers(Vec<f64>),
    Plane(Vec<[f64; 2]>),
    Space(Vec<[f64; 3]>),
    List(Vec<Tree>),
    Object(Vec<(String, Tree)>),
    Other(Value),
}

impl From<Value> for Tree {
    fn from(value: Value) -> Self {
        match value {
            Value::Object(fields) => {
                Tree::Object(fields.into_iter().map(|(name, value)| (name, value.into())).collect())
            }
            Value::Array(items) => {
                let whole = Value::Array(items.clone());
                if let Ok(numbers) = serde_json::from_value(whole.clone()) {
                    return Tree::Numbers(numbers);
                }
                if let Ok(points) = serde_json::from_value(whole.clone()) {
                    return Tree::Plane(points);
                }
                if let Ok(points) = serde_json::from_value(whole) {
                    return Tree::Space(points);
                }
                Tree::List(items.into_iter().map(Tree::from).collect())
            }
            other => Tree::Other(other),
        }
    }
}

impl Serialize for Tree {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Tree::Numbers(numbers) => numbers.serialize(serializer),
            Tree::Plane(points) => points.serialize(serializer),
            Tree::Space(points) => points.serialize(serializer),
            Tree::List(items) => items.serialize(serializer),
            Tree::Object(fields) => {
                serializer.collect_map(fields.iter().map(|(name, value)| (name, value)))
            }
            Tree::Other(value) => value.serialize(serializer),
        }
    }
}

/// The answers that each request got the first time.
type Known = Arc<Mutex<HashMap<Bytes, Arc<Ready>>>>;

fn made<O: Operation>(body: &Bytes) -> Ready {
    let context = Context::default();
    let written = |format: Format| {
        let request = from_bytes(&context, body).expect("the requests are good");
        let answer = O::compute(&context, request).expect("the requests are good");
        let mut buffer = Buffer::new(&context, &memory::unlimited());
        answer.write(format, &mut buffer).expect("the answers are finite");
        buffer.finish().concat()
    };
    let text = written(Format::default());
    let answer = serde_json::from_slice::<Value>(&text).expect("answers are JSON").into();
    Ready {
        answer,
        length: text.len(),
        raw: written(Format { raw: true, ..Format::default() }).into(),
    }
}

/// Reads the request, and writes the answer that the first such request got: as JSON into a buffer
/// of the right size, or a copy of the raw one.
async fn ready<O: Operation>(known: Known, headers: HeaderMap, body: Bytes) -> Response {
    let request: O::Request =
        from_bytes(&Context::default(), &body).expect("the requests are good");
    let ready = known
        .lock()
        .unwrap()
        .entry(body.clone())
        .or_insert_with(|| Arc::new(made::<O>(&body)))
        .clone();
    std::hint::black_box(&request);
    if headers.contains_key(header::ACCEPT) {
        return ([(header::CONTENT_TYPE, RAW)], ready.raw.to_vec()).into_response();
    }
    let mut text = Vec::with_capacity(ready.length);
    serde_json::to_writer(&mut text, &ready.answer).expect("answers can be written");
    ([(header::CONTENT_TYPE, "application/json")], text).into_response()
}

struct Routes;

impl Visitor for Routes {
    type Made = (&'static str, MethodRouter);

    fn visit<O: Operation>(&self) -> Self::Made {
        let known = Known::default();
        (
            O::PATH,
            post(move |headers: HeaderMap, body: Bytes| ready::<O>(known.clone(), headers, body)),
        )
    }
}

fn floor() {
    let routes = operations::each(&Routes).into_iter();
    let router = routes.fold(Router::new(), |router, (path, route)| router.route(path, route));
    let router = router.layer(axum::extract::DefaultBodyLimit::disable());
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
        println!("http://{}", listener.local_addr().unwrap());
        axum::serve(listener, router).await.unwrap();
    });
}

// ---- the driver

struct Server {
    child: Child,
    address: String,
}

impl Server {
    /// On the first core; what it logs is thrown away.
    fn start(program: &std::path::Path, arguments: &[&str]) -> Self {
        let mut command = Command::new("taskset");
        command.args(["-c", "0"]).arg(program).args(arguments).stderr(Stdio::null());
        let mut child = command
            .stdout(Stdio::piped())
            .spawn()
            .expect("cargo build --release first, in the root of the repository");
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let address = line.trim().rsplit_once("http://").expect("an address").1.to_owned();
        Server { child, address }
    }

    /// Seconds of CPU so far: fields 14 and 15 of `/proc/PID/stat`, in ticks of 10 ms.
    fn cpu(&self) -> f64 {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.child.id())).unwrap();
        let fields: Vec<&str> = stat.rsplit_once(')').unwrap().1.split_whitespace().collect();
        (fields[11].parse::<f64>().unwrap() + fields[12].parse::<f64>().unwrap()) / 100.0
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

struct Client {
    stream: TcpStream,
    buffer: Vec<u8>,
}

impl Client {
    fn open(server: &Server) -> Self {
        let stream = TcpStream::connect(&server.address).unwrap();
        stream.set_nodelay(true).unwrap();
        Client { stream, buffer: vec![0; 1 << 20] }
    }

    /// Sends a request and reads its whole answer; its length.
    fn ask(&mut self, request: &[u8]) -> usize {
        self.stream.write_all(request).unwrap();
        let (mut filled, mut whole) = (0, None);
        loop {
            let count = self.stream.read(&mut self.buffer[filled..]).unwrap();
            assert!(count > 0, "closed");
            filled += count;
            if whole.is_none() {
                let head = self.buffer[..filled].windows(4).position(|four| four == b"\r\n\r\n");
                whole = head.map(|end| (end + 4, length(&self.buffer[..end])));
                if let Some((body, length)) = whole {
                    assert!(
                        self.buffer.starts_with(b"HTTP/1.1 200"),
                        "{}",
                        String::from_utf8_lossy(&self.buffer[..filled.min(2_000)])
                    );
                    let needed = body + length;
                    if needed > self.buffer.len() {
                        self.buffer.resize(needed, 0);
                    }
                }
            }
            match whole {
                Some((body, length)) if filled == body + length => return length,
                _ => {}
            }
        }
    }
}

fn length(head: &[u8]) -> usize {
    let head = String::from_utf8_lossy(head).to_ascii_lowercase();
    head.lines()
        .find_map(|line| line.strip_prefix("content-length: ")?.parse().ok())
        .expect("a length")
}

struct Case {
    name: String,
    request: Vec<u8>,
}

fn case(name: &str, path: &str, body: &Value) -> Case {
    case_with(name, path, body, "")
}

/// A case with headers of its own.
fn case_with(name: &str, path: &str, body: &Value, headers: &str) -> Case {
    let body = body.to_string();
    let length = body.len();
    let head = format!(
        "POST {path} HTTP/1.1\r\nhost: bench\r\ncontent-type: application/json\r\n{headers}content-length: {length}\r\n\r\n"
    );
    Case { name: name.into(), request: [head.into_bytes(), body.into_bytes()].concat() }
}

fn cases() -> Vec<Case> {
    let cubic = json!({"family": "beta-bezier", "beta": 1, "control_points": [[0, 0, 1], [1, 3, 2], [4, 3, 0], [5, 0, 2]]});
    let wave = |count: u32| -> Vec<[f64; 2]> {
        (0..count)
            .map(|i| f64::from(i) * 0.1)
            .map(|t| [t + 0.03 * (7.0 * t).sin(), (1.3 * t).sin()])
            .collect()
    };
    let mut cases = Vec::new();
    let sampled =
        |count: u32| json!({"curve": cubic, "sampling": {"kind": "count", "count": count}});
    for count in [10, 100, 1_000, 10_000, 100_000] {
        cases.push(case(&format!("evaluate, {count} samples"), "/v1/evaluate", &sampled(count)));
    }
    cases.push(case(
        "evaluate, 10000 samples, precision=6",
        "/v1/evaluate?precision=6",
        &sampled(10_000),
    ));
    for count in [1_000, 10_000, 100_000] {
        let accept = format!("accept: {RAW}\r\n");
        cases.push(case_with(
            &format!("evaluate, {count} samples, raw"),
            "/v1/evaluate",
            &sampled(count),
            &accept,
        ));
    }
    cases.push(case(
        "subdivide at 3 parameters",
        "/v1/subdivide",
        &json!({"curve": cubic, "at": {"kind": "parameters", "values": [0.25, 0.5, 0.75]}}),
    ));
    cases.push(case("to-bspline", "/v1/to-bspline", &json!({"curve": cubic})));
    for count in [10, 1_000] {
        let body = json!({"points": wave(count)});
        cases.push(case(&format!("interpolate {count} points"), "/v1/interpolate", &body));
    }
    let solve = json!({"kind": "control-points", "basis": {"family": "bezier"}, "order": 15});
    cases.push(case(
        "fit 1,000 points, 16 control points",
        "/v1/fit",
        &json!({"points": wave(1_000), "solve": solve}),
    ));
    cases
}

/// CPU in microseconds for each request, with several clients for a while.
fn cpu(server: &Server, request: &[u8]) -> f64 {
    let before = server.cpu();
    let count = drive(server, request, CLIENTS);
    (server.cpu() - before) / count as f64 * 1e6
}

/// How many requests so many clients get answered in a slice of time.
fn drive(server: &Server, request: &[u8], clients: usize) -> usize {
    std::thread::scope(|scope| {
        let drive = || {
            let (mut client, end, mut count) = (Client::open(server), Instant::now() + SLICE, 0);
            while Instant::now() < end {
                client.ask(request);
                count += 1;
            }
            count
        };
        let clients: Vec<_> = (0..clients).map(|_| scope.spawn(drive)).collect();
        clients.into_iter().map(|client| client.join().unwrap()).sum()
    })
}

/// Median latency in microseconds of one client.
fn latency(server: &Server, request: &[u8]) -> f64 {
    let (mut client, end) = (Client::open(server), Instant::now() + SLICE / 3);
    let mut times = Vec::new();
    while Instant::now() < end || times.len() < 5 {
        let start = Instant::now();
        client.ask(request);
        times.push(start.elapsed().as_secs_f64() * 1e6);
    }
    median(times)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The release binary, with its defaults.
fn ours() -> Server {
    ours_with(&[])
}

fn ours_with(settings: &[&str]) -> Server {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../target/release/springline");
    let path = std::env::var("SPRINGLINE_BINARY").unwrap_or(path.into());
    let log = std::env::var("SPRINGLINE_BENCH_LOG").unwrap_or("info".into());
    Server::start(path.as_ref(), &[&["--listen", "127.0.0.1:0", "--log", &log], settings].concat())
}

/// Leaves the first core to the servers.
fn move_to_the_second_core() {
    let moved = Command::new("taskset")
        .args(["-cp", "1", &std::process::id().to_string()])
        .stdout(Stdio::null())
        .status();
    assert!(
        moved.is_ok_and(|status| status.success()),
        "this benchmark needs two cores and taskset, of util-linux"
    );
}

/// What compression costs the server, of the same answer as it is: with the defaults and where it
/// is set.
fn compression() {
    const AS_IT_IS: &str = "accept-encoding: identity\r\n";
    const BROWSER: &str = "accept-encoding: gzip, deflate, br, zstd\r\n";
    const GZIP: &str = "accept-encoding: gzip, deflate\r\n";
    let servers = [ours(), ours_with(&["--compression", "on"])];
    // Which server, and what it is asked.
    let ways = [
        (0, "default, identity", AS_IT_IS),
        (0, "default, as browsers ask", BROWSER),
        (1, "on, identity", AS_IT_IS),
        (1, "on, as browsers ask", BROWSER),
        (1, "on, gzip", GZIP),
    ];
    let cubic = json!({"family": "beta-bezier", "beta": 1, "control_points": [[0, 0, 1], [1, 3, 2], [4, 3, 0], [5, 0, 2]]});
    println!("\n{:<50}{:>10}{:>10}{:>8}", "evaluate", "answer", "CPU us", "ratio");
    for (name, count, accept) in [
        ("1,000 samples", 1_000, ""),
        ("10,000 samples", 10_000, ""),
        ("10,000 samples, raw", 10_000, RAW),
    ] {
        let body = json!({"curve": cubic, "sampling": {"kind": "count", "count": count}});
        let accept =
            if accept.is_empty() { String::new() } else { format!("accept: {accept}\r\n") };
        let cases = ways.map(|(server, way, coding)| {
            (server, way, case_with("", "/v1/evaluate", &body, &format!("{coding}{accept}")))
        });
        let mut figures = [const { Vec::new() }; 5];
        for _ in 0..ROUNDS {
            for ((server, _, case), figures) in cases.iter().zip(&mut figures) {
                figures.push(cpu(&servers[*server], &case.request));
            }
        }
        let first = median(figures[0].clone());
        for ((server, way, case), figures) in cases.iter().zip(figures) {
            let (answer, cpu) =
                (Client::open(&servers[*server]).ask(&case.request), median(figures));
            println!("{:<50}{answer:>10}{cpu:>10.1}{:>8.2}", format!("{name}: {way}"), cpu / first);
        }
    }
}

/// Curves a second in a batch, and in single requests of 32 clients; both server and clients share
/// this machine.
fn batch() {
    const LINES: usize = 50_000;
    const SINGLE: usize = 32;
    let server = ours();
    let sampled = json!({"curve": {"family": "beta-bezier", "beta": 1, "control_points": [[0, 0], [1, 3], [4, 3], [5, 0]]},
        "sampling": {"kind": "count", "count": 10}});
    let case = case("", "/v1/evaluate", &sampled);
    let line = json!({"op": "evaluate", "body": sampled}).to_string() + "\n";
    let (mut in_batch, mut alone) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        in_batch.push(LINES as f64 / whole_batch(&server, &line.repeat(LINES)));
        let start = Instant::now();
        alone.push(drive(&server, &case.request, SINGLE) as f64 / start.elapsed().as_secs_f64());
    }
    let (in_batch, alone) = (median(in_batch), median(alone));
    println!(
        "\ncurves a second, 10 samples each: {in_batch:.0} in a batch, {alone:.0} alone by {SINGLE} clients, {:.1} times",
        in_batch / alone
    );
}

/// Seconds from the first byte sent to the last received.
fn whole_batch(server: &Server, lines: &str) -> f64 {
    let mut stream = TcpStream::connect(&server.address).unwrap();
    let head = format!(
        "POST /v1/batch HTTP/1.1\r\nhost: bench\r\nconnection: close\r\ncontent-type: application/x-ndjson\r\ncontent-length: {}\r\n\r\n",
        lines.len()
    );
    let start = Instant::now();
    std::thread::scope(|scope| {
        let mut sending = stream.try_clone().unwrap();
        scope.spawn(move || {
            sending.write_all(head.as_bytes()).unwrap();
            sending.write_all(lines.as_bytes()).unwrap();
        });
        let (mut buffer, mut answered) = (vec![0; 1 << 20], 0);
        loop {
            let count = stream.read(&mut buffer).unwrap();
            if count == 0 {
                break;
            }
            let count_of =
                |byte: u8| buffer[..count].iter().filter(|b| **b == byte).count() as isize;
            // Lines of HTTP end in both, lines of the batch in one.
            answered += count_of(b'\n') - count_of(b'\r');
        }
        assert_eq!(answered as usize, lines.len() / (lines.find('\n').unwrap() + 1), "answers");
    });
    start.elapsed().as_secs_f64()
}

fn compare(filter: &str) {
    let servers = [Server::start(&std::env::current_exe().unwrap(), &["floor"]), ours()];
    println!(
        "{:<38}{:>9}{:>9} | {:>9}{:>9}{:>8} | {:>9}{:>9}{:>8}",
        "", "request", "answer", "CPU us", "floor", "ratio", "p50 us", "floor", "ratio"
    );
    for case in cases().into_iter().filter(|case| case.name.contains(filter)) {
        let answer = Client::open(&servers[1]).ask(&case.request);
        let mut figures = [const { (Vec::new(), Vec::new()) }; 2];
        for _ in 0..ROUNDS {
            for (server, figures) in servers.iter().zip(&mut figures) {
                figures.0.push(cpu(server, &case.request));
                figures.1.push(latency(server, &case.request));
            }
        }
        let [(floor_cpu, floor_p50), (cpu, p50)] =
            figures.map(|(cpu, p50)| (median(cpu), median(p50)));
        println!(
            "{:<38}{:>9}{answer:>9} | {cpu:>9.1}{floor_cpu:>9.1}{:>8.2} | {p50:>9.0}{floor_p50:>9.0}{:>8.2}",
            case.name,
            case.request.len(),
            cpu / floor_cpu,
            p50 / floor_p50
        );
    }
}
