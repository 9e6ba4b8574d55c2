//! A client that keeps its connection, what the system says about a process, and the table of
//! figures.
#![allow(dead_code, reason = "shared by tests")]

use std::fmt;
use std::fs;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// A request as bytes.
pub fn get(path: &str) -> Vec<u8> {
    format!("GET {path} HTTP/1.1\r\nHost: endurance\r\n\r\n").into_bytes()
}

pub fn post(path: &str, body: &str) -> Vec<u8> {
    let length = body.len();
    format!("POST {path} HTTP/1.1\r\nHost: endurance\r\nContent-Type: application/json\r\nContent-Length: {length}\r\n\r\n{body}")
        .into_bytes()
}

/// A connection that is used again.
pub struct Client(pub BufReader<TcpStream>);

/// An answer, whole.
pub struct Reply {
    pub status: u16,
    pub retry_after: bool,
    pub closes: bool,
    pub body: Vec<u8>,
}

impl Client {
    pub fn open(address: &str) -> io::Result<Self> {
        let stream = TcpStream::connect(address)?;
        stream.set_nodelay(true)?;
        Ok(Client(BufReader::with_capacity(64 * 1024, stream)))
    }

    /// Sends all of a request; a server that answers early may not take it.
    pub fn send(&mut self, request: &[u8]) -> io::Result<()> {
        self.0.get_mut().write_all(request)
    }

    pub fn receive(&mut self) -> io::Result<Reply> {
        let (mut head, mut line) = (Vec::new(), String::new());
        loop {
            line.clear();
            if self.0.read_line(&mut line)? == 0 {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            match line.trim_end() {
                "" => break,
                text => head.push(text.to_ascii_lowercase()),
            }
        }
        let value =
            |name: &str| head.iter().find_map(|line| line.strip_prefix(name)?.strip_prefix(": "));
        let status = head[0]
            .split(' ')
            .nth(1)
            .and_then(|status| status.parse().ok())
            .ok_or(io::ErrorKind::InvalidData)?;
        let mut body =
            vec![0; value("content-length").and_then(|length| length.parse().ok()).unwrap_or(0)];
        self.0.read_exact(&mut body)?;
        Ok(Reply {
            status,
            retry_after: value("retry-after").is_some(),
            closes: value("connection") == Some("close"),
            body,
        })
    }

    pub fn ask(&mut self, request: &[u8]) -> io::Result<Reply> {
        let sent = self.send(request);
        self.receive().or_else(|error| sent.and(Err(error)))
    }
}

/// Asks on a connection that is opened when there is none, and given up when the server closes it.
pub fn ask(client: &mut Option<Client>, address: &str, request: &[u8]) -> io::Result<Reply> {
    let mut open = client.take().map_or_else(|| Client::open(address), Ok)?;
    let reply = open.ask(request)?;
    if !reply.closes {
        *client = Some(open);
    }
    Ok(reply)
}

/// How long answers to a request take while the flag is down, one every few milliseconds.
pub fn latencies(address: &str, request: &[u8], stop: &AtomicBool) -> Vec<Duration> {
    let (mut client, mut times) = (None, Vec::new());
    while !stop.load(Ordering::Relaxed) {
        let started = Instant::now();
        let reply = ask(&mut client, address, request).unwrap();
        assert_eq!(reply.status, 200);
        times.push(started.elapsed());
        sleep(Duration::from_millis(3));
    }
    times
}

/// The time that so many in a hundred do not exceed.
pub fn percentile(times: &mut [Duration], percent: usize) -> Duration {
    times.sort_unstable();
    times
        .get((times.len() * percent / 100).min(times.len().saturating_sub(1)))
        .copied()
        .unwrap_or_default()
}

/// A process, as the system sees it.
#[derive(Clone, Copy)]
pub struct Process(pub u32);

impl Process {
    pub fn own() -> Self {
        Process(std::process::id())
    }

    fn status(self, name: &str) -> u64 {
        let text = fs::read_to_string(format!("/proc/{}/status", self.0)).unwrap();
        let line =
            text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':')).unwrap();
        line.trim().trim_end_matches(" kB").parse::<u64>().unwrap() * 1024
    }

    /// Resident memory.
    pub fn memory(self) -> Bytes {
        Bytes(self.status("VmRSS"))
    }

    /// The most it was since [`Process::forget_peak`].
    pub fn peak(self) -> Bytes {
        Bytes(self.status("VmHWM"))
    }

    pub fn forget_peak(self) {
        fs::write(format!("/proc/{}/clear_refs", self.0), "5").unwrap();
    }

    /// Time spent on any core.
    pub fn cpu(self) -> Duration {
        let text = fs::read_to_string(format!("/proc/{}/stat", self.0)).unwrap();
        let fields: Vec<&str> = text.rsplit(')').next().unwrap().split_whitespace().collect();
        let ticks = fields[11].parse::<u64>().unwrap() + fields[12].parse::<u64>().unwrap();
        Duration::from_millis(10 * ticks)
    }

    /// Binds all its threads to these cores: `0-3`.
    pub fn pin(self, cores: &str) {
        let id = self.0.to_string();
        assert!(
            Command::new("taskset")
                .args(["-a", "-p", "-c", cores, &id])
                .stdout(Stdio::null())
                .status()
                .unwrap()
                .success()
        );
    }

    pub fn signal(self, name: &str) {
        assert!(
            Command::new("kill")
                .args([&format!("-{name}"), &self.0.to_string()])
                .status()
                .unwrap()
                .success()
        );
    }
}

/// Printed as MiB.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
pub struct Bytes(pub u64);

impl fmt::Display for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.1} MiB", self.0 as f64 / 1_048_576.0)
    }
}

/// The figures of a section; asserts at its end, so that all are printed.
pub struct Report {
    broken: Vec<String>,
}

impl Report {
    pub fn start(section: &str) -> Self {
        println!("\n{section:<64} {:>16} {:>16}", "measured", "promised");
        Report { broken: Vec::new() }
    }

    /// A figure without a promise.
    pub fn plain(&self, name: &str, measured: impl fmt::Display) {
        println!("  {name:<62} {:>16}", measured.to_string());
    }

    fn row(&mut self, name: &str, measured: &str, promised: &str, is_kept: bool) {
        let mark = if is_kept { "kept" } else { "MISSED" };
        println!("  {name:<62} {measured:>16} {promised:>16}  {mark}");
        if !is_kept {
            self.broken.push(format!("{name}: {measured}, promised {promised}"));
        }
    }

    /// A number that is promised.
    pub fn exactly<T: PartialEq + fmt::Display>(&mut self, name: &str, measured: T, promised: T) {
        self.row(name, &measured.to_string(), &promised.to_string(), measured == promised);
    }

    /// A time below a bound.
    pub fn within(&mut self, name: &str, measured: Duration, promised: Duration) {
        self.row(name, &shown(measured), &format!("< {}", shown(promised)), measured < promised);
    }

    /// Memory below a bound.
    pub fn below(&mut self, name: &str, measured: Bytes, promised: Bytes) {
        self.row(name, &measured.to_string(), &format!("< {promised}"), measured < promised);
    }

    /// A share in percent, at least or at most the promise.
    pub fn share(&mut self, name: &str, measured: f64, promised: std::ops::RangeInclusive<f64>) {
        let bound = format!("{:.0} to {:.0} %", promised.start(), promised.end());
        self.row(name, &format!("{measured:.1} %"), &bound, promised.contains(&measured));
    }

    pub fn end(self) {
        assert!(self.broken.is_empty(), "promises broken: {:#?}", self.broken);
    }
}

/// A time as people write it.
pub fn shown(time: Duration) -> String {
    if time < Duration::from_secs(1) {
        format!("{:.2} ms", 1e3 * time.as_secs_f64())
    } else {
        format!("{:.2} s", time.as_secs_f64())
    }
}
