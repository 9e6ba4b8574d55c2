//! The service over loopback against the floor: server CPU for each request, and latencies, as ratios within one run.

use std::any::Any;
use std::collections::HashMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use axum::Router;
use axum::body::Bytes;
use axum::http::header;
use axum::response::IntoResponse;
use axum::routing::post;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use springline::core::error::Error;
use springline::http::json::from_bytes;
use springline::http::{evaluate, fit, interpolate, subdivide, to_bspline};

const ROUNDS: usize = 7;
/// How long each server is driven in each round.
const SLICE: Duration = Duration::from_millis(600);
/// Clients at once while CPU is measured.
const CLIENTS: usize = 8;

fn main() {
    match std::env::args().nth(1).as_deref() {
        Some("floor") => floor(),
        Some(other) => eprintln!("{other}: there is only `floor`, which serves"),
        None => compare(),
    }
}

// ---- the floor

type Ready = Mutex<HashMap<Bytes, (Arc<dyn Any + Send + Sync>, usize)>>;

/// Reads the request, and writes the answer that the first such request got.
async fn ready<Request, Answer>(known: Arc<Ready>, body: Bytes, operation: fn(Request) -> Result<Answer, Error>) -> impl IntoResponse
where
    Request: DeserializeOwned,
    Answer: Serialize + Send + Sync + 'static,
{
    let request: Request = from_bytes(&body).expect("the requests are good");
    let found = known.lock().unwrap().get(&body).cloned();
    let (answer, length) = found.unwrap_or_else(|| {
        let answer = operation(from_bytes(&body).expect("the requests are good")).expect("the requests are good");
        let length = serde_json::to_vec(&answer).expect("answers can be written").len();
        let ready = (Arc::new(answer) as Arc<dyn Any + Send + Sync>, length);
        known.lock().unwrap().insert(body, ready.clone());
        ready
    });
    std::hint::black_box(&request);
    let mut text = Vec::with_capacity(length);
    serde_json::to_writer(&mut text, answer.downcast_ref::<Answer>().expect("one kind of answer for a path"))
        .expect("answers can be written");
    ([(header::CONTENT_TYPE, "application/json")], text)
}

fn floor() {
    let known: Arc<Ready> = Arc::default();
    macro_rules! route {
        ($module:ident) => {{
            let known = known.clone();
            post(move |body: Bytes| ready(known.clone(), body, $module::operation))
        }};
    }
    let router = Router::new()
        .route("/v1/evaluate", route!(evaluate))
        .route("/v1/subdivide", route!(subdivide))
        .route("/v1/to-bspline", route!(to_bspline))
        .route("/v1/interpolate", route!(interpolate))
        .route("/v1/fit", route!(fit))
        .layer(axum::extract::DefaultBodyLimit::disable());
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
    fn start(mut command: Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).spawn().expect("cargo build --release first, in the root of the repository");
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
                    assert!(self.buffer.starts_with(b"HTTP/1.1 200"), "{}", String::from_utf8_lossy(&self.buffer[..filled.min(2_000)]));
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
    head.lines().find_map(|line| line.strip_prefix("content-length: ")?.parse().ok()).expect("a length")
}

struct Case {
    name: String,
    request: Vec<u8>,
}

fn case(name: &str, path: &str, body: &Value) -> Case {
    let body = body.to_string();
    let head = format!("POST {path} HTTP/1.1\r\nhost: bench\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\r\n", body.len());
    Case { name: name.into(), request: [head.into_bytes(), body.into_bytes()].concat() }
}

fn cases() -> Vec<Case> {
    let cubic = json!({"family": "beta-bezier", "beta": 1, "control_points": [[0, 0, 1], [1, 3, 2], [4, 3, 0], [5, 0, 2]]});
    let wave = |count: u32| -> Vec<[f64; 2]> {
        (0..count).map(|i| f64::from(i) * 0.1).map(|t| [t + 0.03 * (7.0 * t).sin(), (1.3 * t).sin()]).collect()
    };
    let mut cases = Vec::new();
    for count in [10, 100, 1_000, 10_000] {
        let body = json!({"curve": cubic, "sampling": {"kind": "count", "count": count}});
        cases.push(case(&format!("evaluate, {count} samples"), "/v1/evaluate", &body));
    }
    cases.push(case(
        "subdivide at 3 parameters",
        "/v1/subdivide",
        &json!({"curve": cubic, "at": {"kind": "parameters", "values": [0.25, 0.5, 0.75]}}),
    ));
    cases.push(case("to-bspline", "/v1/to-bspline", &json!({"curve": cubic})));
    for count in [10, 1_000] {
        let body = json!({"points": wave(count), "report": "summary"});
        cases.push(case(&format!("interpolate {count} points"), "/v1/interpolate", &body));
    }
    let solve = json!({"kind": "control-points", "basis": {"family": "bezier"}, "order": 15});
    cases.push(case("fit 1,000 points, 16 control points", "/v1/fit", &json!({"points": wave(1_000), "solve": solve})));
    cases
}

/// CPU in microseconds for each request, with several clients for a while.
fn cpu(server: &Server, request: &[u8]) -> f64 {
    let before = server.cpu();
    let count: usize = std::thread::scope(|scope| {
        let drive = || {
            let (mut client, end, mut count) = (Client::open(server), Instant::now() + SLICE, 0);
            while Instant::now() < end {
                client.ask(request);
                count += 1;
            }
            count
        };
        let clients: Vec<_> = (0..CLIENTS).map(|_| scope.spawn(drive)).collect();
        clients.into_iter().map(|client| client.join().unwrap()).sum()
    });
    (server.cpu() - before) / count as f64 * 1e6
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

fn compare() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../target/release/springline");
    let mut ours = Command::new(std::env::var("SPRINGLINE_BINARY").unwrap_or(path.into()));
    ours.args(["--listen", "127.0.0.1:0", "--log", "warn"]);
    let mut floor = Command::new(std::env::current_exe().unwrap());
    floor.arg("floor");
    let servers = [Server::start(floor), Server::start(ours)];
    println!(
        "{:<38}{:>9}{:>9} | {:>9}{:>9}{:>8} | {:>9}{:>9}{:>8}",
        "", "request", "answer", "CPU us", "floor", "ratio", "p50 us", "floor", "ratio"
    );
    for case in cases() {
        let answer = Client::open(&servers[1]).ask(&case.request);
        let mut figures = [const { (Vec::new(), Vec::new()) }; 2];
        for _ in 0..ROUNDS {
            for (server, figures) in servers.iter().zip(&mut figures) {
                figures.0.push(cpu(server, &case.request));
                figures.1.push(latency(server, &case.request));
            }
        }
        let [(floor_cpu, floor_p50), (cpu, p50)] = figures.map(|(cpu, p50)| (median(cpu), median(p50)));
        println!(
            "{:<38}{:>9}{answer:>9} | {cpu:>9.1}{floor_cpu:>9.1}{:>8.2} | {p50:>9.0}{floor_p50:>9.0}{:>8.2}",
            case.name,
            case.request.len(),
            cpu / floor_cpu,
            p50 / floor_p50
        );
    }
}
