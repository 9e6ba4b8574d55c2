//! Every operational figure, measured from outside on the binary, with what is promised of it:
//!
//! ```text
//! cargo test --release --test endurance -- --ignored --nocapture --test-threads 1
//! ```
//!
//! One section: add its name. `ENDURANCE_REQUESTS` sets how many requests the memory is watched
//! over, a million by default; `ENDURANCE_BINARY` names another binary to measure. A promise that
//! is missed fails its section, after all its figures are printed: the machine must do nothing else
//! meanwhile.
#![cfg(target_os = "linux")]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::unreachable,
    reason = "a test ends where it fails"
)]

mod load;
mod support;

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::{scope, sleep};
use std::time::{Duration, Instant};

use load::{Bytes, Client, Process, Report, ask, get, latencies, percentile, post, shown};
use serde_json::json;
use support::{Server, binary, examples};

const MIB: u64 = 1024 * 1024;

const fn ms(milliseconds: u64) -> Duration {
    Duration::from_millis(milliseconds)
}

/// With a time of grace.
fn graceful(settings: &[&str]) -> Server {
    let mut command = binary();
    command.args(["serve", "--listen", "127.0.0.1:0", "--log", "error"]).args(settings);
    Server::run(command)
}

impl Server {
    fn process(&self) -> Process {
        Process(self.child.id())
    }
}

/// A metric by its name with labels.
fn metric(client: &mut Client, name: &str) -> f64 {
    let text = String::from_utf8(client.ask(&get("/metrics")).unwrap().body).unwrap();
    let value = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
    value.map_or(0.0, |value| value.parse().unwrap())
}

fn workers() -> usize {
    std::thread::available_parallelism().map_or(2, usize::from)
}

// ---- requests

/// Points that wander, deterministic.
fn wander(count: usize, dimension: usize) -> Vec<Vec<f64>> {
    let coordinate =
        |i: f64, d: usize| (i * 0.618 + d as f64).sin() + i / count as f64 * (3.0 + d as f64);
    (0..count).map(|i| (0..dimension).map(|d| coordinate(i as f64, d)).collect()).collect()
}

fn fit(points: &[Vec<f64>]) -> Vec<u8> {
    let solve = json!({"kind": "tolerance", "basis": {"family": "bezier"}, "tolerance": 1e-3});
    post("/v1/fit", &json!({"points": points, "solve": solve}).to_string())
}

/// As much work as a request may ask for: the points turn so sharply that nearly each needs a
/// segment.
fn largest_fit() -> Vec<u8> {
    fit(&wander(100_000, 2))
}

/// Points of a smooth curve, as a scanner gives them.
fn easy_fit(count: usize) -> Vec<u8> {
    let turn = |i: usize| 20.0 * i as f64 / count as f64;
    fit(&(0..count).map(turn).map(|t| vec![t + t.sin(), (1.3 * t).cos()]).collect::<Vec<_>>())
}

fn interpolate(count: usize) -> Vec<u8> {
    post("/v1/interpolate", &json!({"points": wander(count, 3)}).to_string())
}

/// Samples of a cubic in space, with so many derivatives.
fn evaluate(samples: usize, derivatives: usize) -> Vec<u8> {
    let curve = json!({"family": "beta-bezier", "beta": 0.7, "control_points": wander(4, 3)});
    post("/v1/evaluate", &json!({"curve": curve, "sampling": {"kind": "count", "count": samples}, "derivatives": derivatives}).to_string())
}

/// A request that the pool computes in some ten milliseconds.
fn medium() -> Vec<u8> {
    easy_fit(500)
}

// ---- 1

#[test]
#[ignore = "takes half a minute and wants the machine for itself"]
fn saturation() {
    let mut report = Report::start("Saturated by the largest requests");
    let server = Server::start();
    let (fit, interpolate) = (largest_fit(), interpolate(100_000));
    let (stop, counts) = (AtomicBool::new(false), Mutex::new(BTreeMap::<u16, usize>::new()));
    let (queued, probed) = (Mutex::new(Vec::new()), AtomicBool::new(false));
    let probes = [get("/livez"), evaluate(20, 1)];
    let (mut live, mut small) = (Vec::new(), Vec::new());
    scope(|scope| {
        for i in 0..workers() + 16 + 8 {
            let (address, stop, counts) = (&server.address, &stop, &counts);
            let request = if i % 2 == 0 { &fit } else { &interpolate };
            scope.spawn(move || {
                let mut client = None;
                while !stop.load(Ordering::Relaxed) {
                    // The end of a body that was refused may not be taken.
                    let status = ask(&mut client, address, request).map_or(0, |reply| reply.status);
                    *counts.lock().unwrap().entry(status).or_default() += 1;
                    if status != 200 {
                        sleep(ms(200));
                    }
                }
            });
        }
        sleep(ms(3_000));
        scope.spawn(|| {
            let mut client = Client::open(&server.address).unwrap();
            while !stop.load(Ordering::Relaxed) {
                let busy = metric(&mut client, "springline_computations_running")
                    + metric(&mut client, "springline_queue_depth");
                queued.lock().unwrap().push(busy);
                sleep(ms(100));
            }
        });
        let [first, second] = probes
            .each_ref()
            .map(|request| scope.spawn(|| latencies(&server.address, request, &probed)));
        sleep(ms(15_000));
        probed.store(true, Ordering::Relaxed);
        (live, small) = (first.join().unwrap(), second.join().unwrap());
        stop.store(true, Ordering::Relaxed);
    });
    let busy = queued.into_inner().unwrap();
    report.plain(
        "computations running and waiting, mean",
        format!("{:.1}", busy.iter().sum::<f64>() / busy.len() as f64),
    );
    report
        .plain("answered with 200, 503, otherwise", format!("{:?}", counts.into_inner().unwrap()));
    report.plain(
        "refused because what waited was too much",
        server.metric("springline_shed_total{reason=\"queue\"}"),
    );
    report.plain("GET /livez, median", shown(percentile(&mut live, 50)));
    report.within("GET /livez, p99", percentile(&mut live, 99), ms(20));
    report.plain("POST /v1/evaluate of 20 points, median", shown(percentile(&mut small, 50)));
    report.within("POST /v1/evaluate of 20 points, p99", percentile(&mut small, 99), ms(20));
    report.end();
}

// ---- 2

/// Answers a second, from so many clients.
fn peak(server: &Server, request: &[u8], clients: usize, time: Duration) -> f64 {
    let (count, started) = (AtomicUsize::new(0), Instant::now());
    scope(|scope| {
        for _ in 0..clients {
            scope.spawn(|| {
                let mut client = None;
                while started.elapsed() < time {
                    assert_eq!(ask(&mut client, &server.address, request).unwrap().status, 200);
                    count.fetch_add(1, Ordering::Relaxed);
                }
            });
        }
    });
    count.into_inner() as f64 / started.elapsed().as_secs_f64()
}

/// The service on the first half of the cores, this process and with it all clients on the others:
/// what a client costs is not taken from the service, which is what is measured.
fn apart(settings: &[&str]) -> Server {
    let cores = workers();
    assert!(cores >= 2, "the service and its clients need a core each");
    Process::own().pin(&format!("{}-{}", cores / 2, cores - 1));
    let mut command = Command::new("taskset");
    command.args(["-c", &format!("0-{}", cores / 2 - 1)]).arg(binary().get_program());
    command
        .args(["serve", "--listen", "127.0.0.1:0", "--log", "error"])
        .args(settings)
        .env("SPRINGLINE_GRACE", "0s");
    Server::run(command)
}

/// This process on all cores again.
fn together() {
    Process::own().pin(&format!("0-{}", cores() - 1));
}

/// All cores, also those this process is not bound to.
fn cores() -> usize {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap();
    text.lines().filter(|line| line.starts_with("processor")).count()
}

/// What became of requests, and after what time.
#[derive(Default)]
struct Replies(Vec<(Option<(u16, bool)>, Duration)>);

impl Replies {
    fn count(&self, status: u16) -> usize {
        self.times(status).len()
    }

    fn times(&self, status: u16) -> Vec<Duration> {
        self.0
            .iter()
            .filter(|(reply, _)| reply.is_some_and(|(known, _)| known == status))
            .map(|(_, time)| *time)
            .collect()
    }
}

/// Offers so many requests a second, each sender its part of them; who waits for an answer sends
/// what is due meanwhile after it.
fn offer(server: &Server, request: &[u8], senders: usize, rate: f64, time: Duration) -> Replies {
    let between = Duration::from_secs_f64(senders as f64 / rate);
    let (replies, started) = (Mutex::new(Replies::default()), Instant::now());
    scope(|scope| {
        for i in 0..senders {
            let replies = &replies;
            scope.spawn(move || {
                let (mut client, mut mine) = (None, Vec::new());
                let mut due = started + between.mul_f64(i as f64 / senders as f64);
                while due < started + time && started.elapsed() < time {
                    sleep(due.saturating_duration_since(Instant::now()));
                    let sent = Instant::now();
                    let reply = ask(&mut client, &server.address, request)
                        .ok()
                        .map(|reply| (reply.status, reply.retry_after));
                    mine.push((reply, sent.elapsed()));
                    due += between;
                }
                replies.lock().unwrap().0.extend(mine);
            });
        }
    });
    replies.into_inner().unwrap()
}

#[test]
#[ignore = "takes half a minute and wants the machine for itself"]
fn overload() {
    let mut report = Report::start("Ten times as many requests as can be served");
    // With the time of half a second for what waits, so that a few hundred clients are too many.
    let server = apart(&["--deadline", "1s"]);
    let request = medium();
    let clients = 4 * workers();
    peak(&server, &request, clients, ms(2_000));
    let before = peak(&server, &request, clients, ms(4_000));
    let (cpu, own, started) = (server.process().cpu(), Process::own().cpu(), Instant::now());
    let replies = offer(&server, &request, 512, 10.0 * before, ms(10_000));
    let elapsed = started.elapsed().as_secs_f64();
    let (cpu, own) = (server.process().cpu() - cpu, Process::own().cpu() - own);
    // The machine may have become slower or faster meanwhile.
    let peak = (before + peak(&server, &request, clients, ms(4_000))) / 2.0;
    together();
    let (good, mut refused) = (replies.count(200), replies.times(503));
    let bare = replies.0.iter().filter(|(reply, _)| *reply == Some((503, false))).count();
    let broken = replies.0.iter().filter(|(reply, _)| reply.is_none()).count();
    report.plain("peak, requests a second", format!("{peak:.0}"));
    report.plain("offered, requests a second", format!("{:.0}", replies.0.len() as f64 / elapsed));
    report.plain("cores used by the service", format!("{:.2}", cpu.as_secs_f64() / elapsed));
    report.plain("cores used by the load itself", format!("{:.2}", own.as_secs_f64() / elapsed));
    report.share("goodput, of the peak", 100.0 * good as f64 / elapsed / peak, 90.0..=1e3);
    report.within("answers, p99, deadline 1 s", percentile(&mut replies.times(200), 99), ms(1_000));
    report.plain("refused with 503", refused.len());
    report.plain("503, median", shown(percentile(&mut refused, 50)));
    report.within("503, p99", percentile(&mut refused, 99), ms(20));
    report.exactly("503 without Retry-After", bare, 0);
    report.exactly("requests without an answer", broken, 0);
    report.exactly(
        "statuses other than 200 and 503",
        replies.0.len() - good - refused.len() - broken,
        0,
    );
    report.end();
}

#[test]
#[ignore = "takes half a minute and wants the machine for itself"]
fn many_clients() {
    let mut report =
        Report::start("256 clients that ask for 10,000 samples each, one core, defaults");
    let server = apart(&["--workers", "1"]);
    server.process().pin("0");
    let request = evaluate(10_000, 0);
    let (stop, mut live, mut small) = (AtomicBool::new(false), Vec::new(), Vec::new());
    let mut replies = Replies::default();
    scope(|scope| {
        let probes = [get("/livez"), evaluate(20, 1)];
        let [first, second] = probes.map(|request| {
            let (address, stop) = (&server.address, &stop);
            scope.spawn(move || latencies(address, &request, stop))
        });
        replies = offer(&server, &request, 256, 1e6, ms(10_000));
        stop.store(true, Ordering::Relaxed);
        (live, small) = (first.join().unwrap(), second.join().unwrap());
    });
    together();
    report.plain("answered", replies.count(200));
    report.exactly("not answered with 200", replies.0.len() - replies.count(200), 0);
    report.within("p99", percentile(&mut replies.times(200), 99), ms(2_000));
    report.within("GET /livez meanwhile, p99", percentile(&mut live, 99), ms(20));
    report.within(
        "POST /v1/evaluate of 20 points meanwhile, p99",
        percentile(&mut small, 99),
        ms(20),
    );
    report.below("memory at the peak", server.process().peak(), Bytes(512 * MIB));
    report.end();
}

// ---- 3

/// Until no computation runs.
fn until_free(client: &mut Client) -> Duration {
    let started = Instant::now();
    while metric(client, "springline_computations_running") > 0.0 && started.elapsed() < ms(60_000)
    {
        sleep(ms(5));
    }
    started.elapsed()
}

#[test]
#[ignore = "takes a minute and wants the machine for itself"]
fn freed_cores() {
    let mut report = Report::start("Cores freed when nobody waits for the answer");
    for (name, request) in [
        ("fit", largest_fit()),
        ("interpolate", interpolate(100_000)),
        ("evaluate", evaluate(200_000, 4)),
    ] {
        let server = Server::with(&["--deadline", "300ms"]);
        let mut watch = Client::open(&server.address).unwrap();
        let mut client = Client::open(&server.address).unwrap();
        client.send(&request).unwrap();
        let sent = Instant::now();
        let reply = client.receive().unwrap();
        if reply.status != 504 {
            report
                .plain(&format!("largest {name}: done before the deadline"), shown(sent.elapsed()));
        } else {
            report.within(
                &format!("largest {name}, deadline 300 ms: 504 after"),
                sent.elapsed(),
                ms(400),
            );
            report.within(
                &format!("largest {name}: cores free after the 504"),
                until_free(&mut watch),
                ms(100),
            );
            let cpu = server.process().cpu();
            sleep(ms(500));
            report.within(
                &format!("largest {name}: work in the half second after that"),
                server.process().cpu() - cpu,
                ms(30),
            );
        }

        let server = Server::start();
        let mut watch = Client::open(&server.address).unwrap();
        let mut client = Client::open(&server.address).unwrap();
        client.send(&request).unwrap();
        while metric(&mut watch, "springline_computations_running") == 0.0 {
            sleep(ms(1));
        }
        sleep(ms(100));
        drop(client);
        report.within(
            &format!("largest {name}: cores free after the client left"),
            until_free(&mut watch),
            ms(100),
        );
    }
    report.end();
}

// ---- 4

/// A client that keeps the service waiting.
struct Slow {
    name: &'static str,
    sends: Vec<u8>,
    drips: bool,
    limit: Duration,
}

/// When each of many such connections is closed, from its beginning.
fn closed_after(address: &str, slow: &Slow, count: usize) -> Vec<Option<Duration>> {
    let open = || {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.write_all(&slow.sends).unwrap();
        stream.set_nonblocking(true).unwrap();
        Some((stream, Instant::now()))
    };
    let (mut streams, mut times) = (Vec::new(), Vec::new());
    let started = Instant::now();
    let (mut next_drip, mut buffer) = (started + ms(1_000), [0; 4096]);
    while streams.len() < count
        || (started.elapsed() < slow.limit + ms(12_000) && streams.iter().any(Option::is_some))
    {
        let more = (count - streams.len()).min(50);
        streams.extend((0..more).map(|_| open()));
        times.resize(streams.len(), None);
        let drip = slow.drips && Instant::now() >= next_drip;
        if drip {
            next_drip += ms(1_000);
        }
        for (place, time) in streams.iter_mut().zip(&mut times) {
            let Some((stream, opened)) = place else { continue };
            let written = if drip { stream.write_all(b"a") } else { Ok(()) };
            let is_open = written.is_ok()
                && match stream.read(&mut buffer) {
                    Ok(read) => read > 0,
                    Err(error) => error.kind() == io::ErrorKind::WouldBlock,
                };
            if !is_open {
                *time = Some(opened.elapsed());
                *place = None;
            }
        }
        sleep(ms(if more > 0 { 5 } else { 40 }));
    }
    times
}

#[test]
#[ignore = "opens thousands of connections and takes a minute"]
fn slow_clients() {
    let mut report = Report::start("1,000 slow clients of each kind");
    let limits =
        ["--header-time", "2s", "--body-time", "2s", "--idle-time", "3s", "--answer-time", "3s"];
    let server = Server::with(&[&limits[..], &["--memory", "1GiB", "--queue", "100"]].concat());
    let body = b"POST /v1/evaluate HTTP/1.1\r\nHost: a\r\nContent-Type: application/json\r\nContent-Length: 100\r\n\r\n{";
    let head = b"GET /livez HTTP/1.1\r\nHost: a\r\nX-Slow: ";
    let kind = |name, sends: &[u8], drips, limit| Slow {
        name,
        sends: sends.to_vec(),
        drips,
        limit: ms(limit),
    };
    let kinds = [
        kind("silent", b"", false, 2_000),
        kind("half a head", head, false, 2_000),
        kind("a head, one byte a second", head, true, 2_000),
        kind("half a body", body, false, 2_000),
        kind("a body, one byte a second", body, true, 2_000),
        kind("idle after one request", &get("/livez"), false, 3_000),
    ];
    for slow in &kinds {
        let stop = AtomicBool::new(false);
        let mut live = Vec::new();
        scope(|scope| {
            let probe = scope.spawn(|| latencies(&server.address, &get("/livez"), &stop));
            let times = closed_after(&server.address, slow, 1_000);
            stop.store(true, Ordering::Relaxed);
            live = probe.join().unwrap();
            let left = times.iter().filter(|time| time.is_none()).count();
            let early = times.iter().flatten().filter(|time| **time < slow.limit - ms(100)).count();
            let last = times.into_iter().flatten().max().unwrap_or_default();
            report.exactly(&format!("{}: never closed", slow.name), left, 0);
            report.exactly(&format!("{}: closed early", slow.name), early, 0);
            report.within(
                &format!("{}: the last closed after", slow.name),
                last,
                slow.limit + ms(1_000),
            );
        });
        report.within(
            &format!("{}: GET /livez meanwhile, p99", slow.name),
            percentile(&mut live, 99),
            ms(50),
        );
        sleep(ms(1_500));
        report.exactly(
            &format!("{}: connections left in the service", slow.name),
            server.metric("springline_connections"),
            1.0,
        );
    }
    report.plain("memory at the peak", server.process().peak());
    let counted = |route, method| {
        format!("springline_requests_total{{route=\"{route}\",method=\"{method}\",status=\"200\"}}")
    };
    let unread = [
        ("50 that read no answer", evaluate(25_000, 2), counted("/v1/evaluate", "POST")),
        (
            "50 that ask on and read no answer",
            get("/openapi.json").repeat(200),
            counted("/openapi.json", "GET"),
        ),
    ];
    for (name, sends, counter) in unread {
        let mut streams = Vec::new();
        for _ in 0..50 {
            let mut stream = TcpStream::connect(&server.address).unwrap();
            stream.set_write_timeout(Some(ms(200))).unwrap();
            let _ = stream.write_all(&sends);
            streams.push(stream);
        }
        // The answers come one after the other; the time of the last begins when no more come.
        let mut watch = Client::open(&server.address).unwrap();
        let (mut answers, mut started) = (0.0, Instant::now());
        while metric(&mut watch, "springline_connections") > 1.0 && started.elapsed() < ms(20_000) {
            let now = metric(&mut watch, &counter);
            if now > answers {
                (answers, started) = (now, Instant::now());
            }
            sleep(ms(50));
        }
        let left = metric(&mut watch, "springline_connections") - 1.0;
        report.exactly(&format!("{name}: never closed"), left, 0.0);
        report.within(&format!("{name}: the last closed after"), started.elapsed(), ms(4_000));
        report.plain(
            &format!("{name}: closed for that"),
            server.metric("springline_connections_closed_total{reason=\"answer\"}"),
        );
        drop(streams);
    }
    report.plain("memory at the peak", server.process().peak());
    report.plain("memory held for answers in the end", server.metric("springline_held_bytes"));
    report.end();
}

// ---- 5

/// Reads an answer slowly; its status.
fn read_slowly(address: &str, request: &[u8]) -> io::Result<u16> {
    let mut stream = TcpStream::connect(address)?;
    stream.set_read_timeout(Some(ms(120_000)))?;
    // A server that answers early may not take all of it.
    let _ = stream.write_all(request);
    let mut buffer = vec![0; 256 * 1024];
    let mut status = 0;
    loop {
        match stream.read(&mut buffer)? {
            0 => return Ok(status),
            read if status == 0 => {
                status = String::from_utf8_lossy(&buffer[..read])
                    .split(' ')
                    .nth(1)
                    .and_then(|code| code.parse().ok())
                    .unwrap_or(0);
                if status == 503 {
                    stream.shutdown(Shutdown::Both)?;
                    return Ok(status);
                }
            }
            _ => {}
        }
        sleep(ms(5));
    }
}

/// A request as large as a body may be, of points with so many characters.
fn widest(path: &str, point: &str, rest: &str) -> Vec<u8> {
    let room = 32 * MIB as usize - 64 - rest.len();
    let points = vec![point; room / (point.len() + 1)].join(",");
    post(path, &format!("{{\"points\": [{points}]{rest}}}"))
}

#[test]
#[ignore = "takes minutes and a GiB of memory"]
fn memory() {
    let mut report = Report::start("Memory with the default settings");
    let server = Server::start();
    sleep(ms(500));
    report.below("after the start", server.process().memory(), Bytes(30 * MIB));
    drop(server);

    let long = |count: usize| {
        let digits = "0".repeat(32 * MIB as usize / count / 3 - 40);
        let point = |p: Vec<f64>| {
            format!(
                "[{}]",
                p.iter().map(|x| format!("{x:.15}{digits}")).collect::<Vec<_>>().join(",")
            )
        };
        let points: Vec<String> = wander(count, 3).into_iter().map(point).collect();
        points.join(",")
    };
    let longest = post("/v1/interpolate", &format!("{{\"points\": [{}]}}", long(100_000)));
    let loads: [(&str, Vec<u8>, usize); 5] = [
        ("200,000 samples with 4 derivatives in space", evaluate(200_000, 4), 10),
        ("interpolating 100,000 points from 32 MiB", longest, 6),
        ("fitting 100,000 points", largest_fit(), 6),
        ("32 MiB of points, too many", widest("/v1/interpolate", "[0,0]", ""), 6),
        ("32 MiB of empty lists", widest("/v1/interpolate", "[]", ""), 6),
    ];
    for (name, request, seconds) in &loads {
        let server = Server::start();
        let (started, counts) = (Instant::now(), Mutex::new(BTreeMap::<u16, usize>::new()));
        let held = Mutex::new(0.0_f64);
        scope(|scope| {
            for _ in 0..workers() + 16 + 6 {
                scope.spawn(|| {
                    while started.elapsed() < Duration::from_secs(*seconds as u64) {
                        let status = read_slowly(&server.address, request).unwrap_or(0);
                        *counts.lock().unwrap().entry(status).or_default() += 1;
                        if status == 503 {
                            sleep(ms(100));
                        }
                    }
                });
            }
            scope.spawn(|| {
                while started.elapsed() < Duration::from_secs(*seconds as u64) {
                    let now = server.metric("springline_held_bytes");
                    let mut held = held.lock().unwrap();
                    *held = held.max(now);
                    sleep(ms(50));
                }
            });
        });
        report.plain(&format!("{name}: statuses"), format!("{:?}", counts.into_inner().unwrap()));
        report.plain(
            &format!("{name}: counted by the budget"),
            Bytes(held.into_inner().unwrap() as u64),
        );
        report.below(&format!("{name}: peak"), server.process().peak(), Bytes(512 * MIB));
        sleep(ms(1_000));
        report.plain(&format!("{name}: a second later"), server.process().memory());
    }
    report.end();
}

#[test]
#[ignore = "a million requests"]
fn memory_over_time() {
    let all: usize =
        std::env::var("ENDURANCE_REQUESTS").map_or(1_000_000, |given| given.parse().unwrap());
    let mut report = Report::start(&format!("Memory over {all} small requests"));
    let server = Server::start();
    let requests: Vec<Vec<u8>> =
        examples().iter().map(|(path, _, body)| post(path, &body.to_string())).collect();
    let run = |count: usize| {
        let left = AtomicUsize::new(count);
        let started = Instant::now();
        scope(|scope| {
            for thread in 0..2 * workers() {
                let (left, requests, address) = (&left, &requests, &server.address);
                scope.spawn(move || {
                    let (mut client, mut i) = (None, thread);
                    while left
                        .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| {
                            left.checked_sub(1)
                        })
                        .is_ok()
                    {
                        // Mostly the first operation, which is the cheapest; every eighth request
                        // any other.
                        let request = if i % 8 == 0 {
                            &requests[i / 8 % requests.len()]
                        } else {
                            &requests[0]
                        };
                        assert_eq!(ask(&mut client, address, request).unwrap().status, 200);
                        i += 1;
                    }
                });
            }
        });
        (server.process().memory(), count as f64 / started.elapsed().as_secs_f64())
    };
    let (early, _) = run(all / 10);
    let (late, rate) = run(all - all / 10);
    report.plain("requests a second", format!("{rate:.0}"));
    report.plain("after a tenth", early);
    report.plain("after all", late);
    report.share("growth", 100.0 * (late.0 as f64 / early.0 as f64 - 1.0), -100.0..=10.0);
    report.end();
}

// ---- 6

#[test]
#[ignore = "wants the machine for itself"]
fn start() {
    let mut report = Report::start("From start to ready, 20 times");
    let mut times = Vec::new();
    for _ in 0..20 {
        let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
        let started = Instant::now();
        let mut command = binary();
        command.args(["serve", "--listen", &address, "--log", "error"]).stdout(Stdio::null());
        let mut child = command.spawn().unwrap();
        loop {
            let reply = Client::open(&address).and_then(|mut client| client.ask(&get("/readyz")));
            if reply.is_ok_and(|reply| reply.status == 200) {
                break;
            }
            sleep(ms(1));
        }
        times.push(started.elapsed());
        child.kill().unwrap();
        child.wait().unwrap();
    }
    report.within("median", percentile(&mut times, 50), ms(100));
    report.plain("slowest", shown(percentile(&mut times, 100)));
    report.end();
}

// ---- 7

/// What became of the requests sent while the service stopped.
#[derive(Default)]
struct Stopped {
    answered: usize,
    lost: usize,
    /// Sent when the listener closed or after.
    late: usize,
    exit: Option<i32>,
    time: Duration,
}

/// Load at a rate, a signal, and what became of each request. `fresh` connections are used once.
fn stop_under_load(request: &[u8], rate: f64, fresh: bool) -> Stopped {
    const SENDERS: usize = 16;
    let mut server = graceful(&["--grace", "300ms", "--drain", "10s"]);
    let (address, process) = (server.address.clone(), server.process());
    let (sent, last_open, done) =
        (Mutex::new(Vec::new()), Mutex::new(Instant::now()), AtomicBool::new(false));
    let between = Duration::from_secs_f64(SENDERS as f64 / rate);
    let mut stopped = Stopped::default();
    scope(|scope| {
        for i in 0..SENDERS {
            let (address, sent, done) = (&address, &sent, &done);
            scope.spawn(move || {
                let (mut client, mut mine): (Option<Client>, Vec<_>) = (None, Vec::new());
                let mut due = Instant::now() + between.mul_f64(i as f64 / SENDERS as f64);
                while !done.load(Ordering::Relaxed) {
                    sleep(due.saturating_duration_since(Instant::now()));
                    due += between;
                    let Ok(mut open) = client.take().map_or_else(|| Client::open(address), Ok)
                    else {
                        break;
                    };
                    if open.send(request).is_err() {
                        continue;
                    }
                    let at = Instant::now();
                    let reply = open.receive();
                    if !fresh && reply.as_ref().is_ok_and(|reply| !reply.closes) {
                        client = Some(open);
                    }
                    mine.push((at, reply.is_ok()));
                }
                sent.lock().unwrap().extend(mine);
            });
        }
        scope.spawn(|| {
            while TcpStream::connect(&address).is_ok() {
                *last_open.lock().unwrap() = Instant::now();
                sleep(ms(1));
            }
        });
        sleep(ms(700));
        process.signal("TERM");
        let started = Instant::now();
        stopped.exit = server.child.wait().unwrap().code();
        stopped.time = started.elapsed();
        done.store(true, Ordering::Relaxed);
    });
    let last_open = *last_open.lock().unwrap();
    for (at, is_answered) in sent.into_inner().unwrap() {
        match (is_answered, at < last_open) {
            (true, _) => stopped.answered += 1,
            (false, true) => stopped.lost += 1,
            (false, false) => stopped.late += 1,
        }
    }
    stopped
}

#[test]
#[ignore = "starts and stops the service many times"]
fn stop() {
    let mut report = Report::start("Stopping");
    let small = evaluate(20, 1);
    // Connections used once leave ports behind that the system keeps for a while: not too many a
    // second.
    let kinds = [
        ("pooled", medium(), false, 1e9),
        ("small", small.clone(), false, 1e9),
        ("small, a connection each", small, true, 500.0),
    ];
    for (name, request, fresh, most) in kinds {
        let rate = (0.8 * peak(&Server::start(), &request, 2 * workers(), ms(2_000))).min(most);
        report.plain(&format!("20 signals, {name}: requests a second"), format!("{rate:.0}"));
        let mut all = Stopped::default();
        let mut failed = 0;
        for _ in 0..20 {
            let one = stop_under_load(&request, rate, fresh);
            all.answered += one.answered;
            all.lost += one.lost;
            all.late += one.late;
            failed += usize::from(one.exit != Some(0));
            all.time = all.time.max(one.time);
        }
        report.plain(&format!("20 signals, {name}: answered"), all.answered);
        report.exactly(&format!("20 signals, {name}: sent in time and lost"), all.lost, 0);
        report.plain(&format!("20 signals, {name}: sent too late"), all.late);
        report.exactly(&format!("20 signals, {name}: exit codes other than 0"), failed, 0);
        report.within(
            &format!("20 signals, {name}: slowest exit, grace 300 ms"),
            all.time,
            ms(1_300),
        );
    }

    let mut server = graceful(&["--grace", "500ms"]);
    let mut idle: Vec<Client> =
        (0..1_000).map(|_| Client::open(&server.address).unwrap()).collect();
    idle.iter_mut().for_each(|client| assert_eq!(client.ask(&get("/livez")).unwrap().status, 200));
    let mut half: Vec<Client> = (0..100).map(|_| Client::open(&server.address).unwrap()).collect();
    half.iter_mut().for_each(|client| client.send(b"POST /v1/fit HTTP/1.1\r\nHo").unwrap());
    server.process().signal("TERM");
    let started = Instant::now();
    let code = server.child.wait().unwrap().code();
    report.within(
        "1,000 idle, 100 half open, grace 500 ms: exit after",
        started.elapsed(),
        ms(1_500),
    );
    report.exactly("1,000 idle, 100 half open: exit code", code.unwrap_or(-1), 0);
    drop((idle, half));

    let mut server = graceful(&["--grace", "60s"]);
    let mut client = Client::open(&server.address).unwrap();
    client.send(&largest_fit()).unwrap();
    sleep(ms(200));
    server.process().signal("TERM");
    sleep(ms(200));
    server.process().signal("TERM");
    let started = Instant::now();
    let code = server.child.wait().unwrap().code();
    report.within("a second signal, a computation running: exit after", started.elapsed(), ms(100));
    report.plain("a second signal: exit code", format!("{code:?}"));
    report.end();
}

// ---- 8

/// The hash of every answer.
fn answers(settings: &[&str], requests: &[Vec<u8>]) -> Vec<u64> {
    let server = Server::with(settings);
    let (next, hashes) = (AtomicUsize::new(0), Mutex::new(vec![0; requests.len()]));
    scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| {
                let mut client = None;
                while let Some((i, request)) = Some(next.fetch_add(1, Ordering::Relaxed))
                    .and_then(|i| Some((i, requests.get(i)?)))
                {
                    let reply = ask(&mut client, &server.address, request).unwrap();
                    let mut hasher = DefaultHasher::new();
                    (reply.status, reply.body).hash(&mut hasher);
                    hashes.lock().unwrap()[i] = hasher.finish();
                }
            });
        }
    });
    hashes.into_inner().unwrap()
}

#[test]
#[ignore = "takes half a minute"]
fn determinism() {
    let mut report = Report::start("The same request, the same bytes");
    let varied =
        (0..700).flat_map(|i| [easy_fit(60 + i), interpolate(20 + i), evaluate(10 + 5 * i, i % 5)]);
    let known = examples().into_iter().map(|(path, _, body)| post(path, &body.to_string()));
    let requests: Vec<Vec<u8>> = known.chain(varied).collect();
    let first = answers(&["--queue", "100"], &requests);
    report.plain("requests", requests.len());
    for settings in [
        ["--queue", "100", "--workers", "0"],
        ["--queue", "100", "--workers", "1"],
        ["--queue", "100", "--workers", "7"],
    ] {
        let again = answers(&settings, &requests);
        let others = first.iter().zip(&again).filter(|(first, again)| first != again).count();
        report.exactly(
            &format!("other answers after a restart with {} {}", settings[2], settings[3]),
            others,
            0,
        );
    }
    report.end();
}
