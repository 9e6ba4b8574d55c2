//! Every endpoint, asked with the very headers that usual clients send: whatever coding they ask
//! for, they read the same bytes.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;

use crate::support::*;
use serde_json::json;

const RAW: &str = "application/vnd.springline.f64";
const NDJSON: &str = "application/x-ndjson";

/// A program: what it sends of its own accord, recorded from it, and the coding it gets where
/// answers are compressed.
struct Program {
    name: &'static str,
    headers: &'static [&'static str],
    coding: &'static str,
}

const PROGRAMS: &[Program] = &[
    Program { name: "curl 7.88", headers: &["User-Agent: curl/7.88.1", "Accept: */*"], coding: "" },
    Program {
        name: "curl --compressed",
        headers: &[
            "User-Agent: curl/7.88.1",
            "Accept: */*",
            "Accept-Encoding: deflate, gzip, br, zstd",
        ],
        coding: "zstd",
    },
    Program {
        name: "fetch of Node 20 (undici)",
        headers: &[
            "connection: keep-alive",
            "accept: */*",
            "accept-language: *",
            "sec-fetch-mode: cors",
            "user-agent: node",
            "accept-encoding: gzip, deflate",
        ],
        coding: "gzip",
    },
    Program {
        name: "requests 2.34",
        headers: &[
            "User-Agent: python-requests/2.34.2",
            "Accept-Encoding: gzip, deflate, br",
            "Accept: */*",
            "Connection: keep-alive",
        ],
        coding: "gzip",
    },
    Program {
        name: "httpx 0.28 with zstandard",
        headers: &[
            "Accept: */*",
            "Accept-Encoding: gzip, deflate, br, zstd",
            "Connection: keep-alive",
            "User-Agent: python-httpx/0.28.1",
        ],
        coding: "zstd",
    },
    Program {
        name: "aiohttp 3.14",
        headers: &[
            "Accept: */*",
            "Accept-Encoding: gzip, deflate, br",
            "User-Agent: Python/3.11 aiohttp/3.14.5",
        ],
        coding: "gzip",
    },
    Program {
        name: "urllib 3.11",
        headers: &["Accept-Encoding: identity", "User-Agent: Python-urllib/3.11"],
        coding: "",
    },
    Program {
        name: "fetch of Chromium 148",
        headers: &[
            "Connection: keep-alive",
            "sec-ch-ua-platform: \"Linux\"",
            "User-Agent: Mozilla/5.0 (X11; Linux x86_64) AppleWebKit/537.36 (KHTML, like Gecko) HeadlessChrome/148.0.0.0 Safari/537.36",
            "sec-ch-ua: \"Not/A)Brand\";v=\"99\", \"Chromium\";v=\"148\"",
            "sec-ch-ua-mobile: ?0",
            "Accept: */*",
            "Origin: http://127.0.0.1:9099",
            "Sec-Fetch-Site: cross-site",
            "Sec-Fetch-Mode: cors",
            "Sec-Fetch-Dest: empty",
            "Referer: http://127.0.0.1:9099/",
            "Accept-Encoding: gzip, deflate, br, zstd",
            "Accept-Language: en-US,en;q=0.9",
        ],
        coding: "zstd",
    },
    Program {
        name: "address bar of Chromium 148",
        headers: &[
            "Connection: keep-alive",
            "sec-ch-ua: \"Not/A)Brand\";v=\"99\", \"Chromium\";v=\"148\"",
            "sec-ch-ua-mobile: ?0",
            "sec-ch-ua-platform: \"Linux\"",
            "Upgrade-Insecure-Requests: 1",
            "User-Agent: Mozilla/5.0 (X11; Linux x86_64) AppleWebKit/537.36 (KHTML, like Gecko) HeadlessChrome/148.0.0.0 Safari/537.36",
            "Accept: text/html,application/xhtml+xml,application/xml;q=0.9,image/avif,image/webp,image/apng,*/*;q=0.8,\
             application/signed-exchange;v=b3;q=0.7",
            "Sec-Fetch-Site: none",
            "Sec-Fetch-Mode: navigate",
            "Sec-Fetch-User: ?1",
            "Sec-Fetch-Dest: document",
            "Accept-Encoding: gzip, deflate, br, zstd",
            "Accept-Language: en-US,en;q=0.9",
        ],
        coding: "zstd",
    },
];

/// One request, and what is answered.
struct Ask {
    method: &'static str,
    path: String,
    media_type: &'static str,
    accept: Option<&'static str>,
    body: Vec<u8>,
    status: u16,
}

impl Ask {
    fn get(path: &str, status: u16) -> Self {
        Ask {
            method: "GET",
            path: path.into(),
            media_type: "",
            accept: None,
            body: Vec::new(),
            status,
        }
    }

    fn post(path: &str, media_type: &'static str, body: impl Into<Vec<u8>>, status: u16) -> Self {
        Ask {
            method: "POST",
            path: path.into(),
            media_type,
            accept: None,
            body: body.into(),
            status,
        }
    }

    fn name(&self) -> String {
        format!("{} {} {}", self.method, self.path, self.accept.unwrap_or(self.media_type))
    }

    /// Whether its answer is one that is compressed where it is long enough.
    fn is_compressible(&self) -> bool {
        self.status == 200 && self.path.starts_with("/v1/") && self.accept != Some(RAW)
    }
}

fn samples(count: usize) -> Vec<u8> {
    let curve = json!({"family": "beta-bezier", "beta": 1, "control_points": [[0, 0], [1, 3], [4, 3], [5, 0]]});
    json!({"curve": curve, "sampling": {"kind": "count", "count": count}}).to_string().into()
}

/// A batch with an answer of every operation, problems between them, and one long answer.
fn batch() -> String {
    let mut lines: Vec<String> = vec!["{".into(), r#"{"op": "evaluate", "body": {}}"#.into()];
    for (path, name, body) in examples() {
        lines.push(
            json!({"id": name, "op": path.trim_start_matches("/v1/"), "body": body}).to_string(),
        );
    }
    lines.push(format!(
        r#"{{"op": "evaluate", "body": {}}}"#,
        String::from_utf8(samples(20_000)).unwrap()
    ));
    lines.join("\n") + "\n"
}

/// Every endpoint, and every kind of refusal.
fn asks() -> Vec<Ask> {
    let json = "application/json";
    let examples =
        examples().into_iter().map(|(path, _, body)| Ask::post(path, json, body.to_string(), 200));
    let raw =
        |count| Ask { accept: Some(RAW), ..Ask::post("/v1/evaluate", json, samples(count), 200) };
    let more = [
        Ask::post("/v1/evaluate", json, samples(1_000), 200),
        Ask::post("/v1/evaluate?precision=6&layout=flat", json, samples(30_000), 200),
        raw(10),
        raw(30_000),
        Ask::post("/v1/batch", NDJSON, batch(), 200),
        Ask::post("/v1/batch", NDJSON, "", 200),
        Ask::post("/v1/batch", json, "{}", 415),
        Ask::post("/v1/evaluate", "text/plain", "{}", 415),
        Ask::post("/v1/evaluate", json, "{", 400),
        Ask::post("/v1/evaluate", json, "{}", 400),
        Ask::post("/v1/interpolate", json, r#"{"points": [[0, 0], [2, 3], [2, 3], [5, 1]]}"#, 422),
        Ask::post("/v1/nothing", json, "{}", 404),
        Ask::get("/v1/evaluate", 405),
        Ask::get("/nothing", 404),
        Ask::get("/openapi.json", 200),
        Ask::get("/docs/", 200),
        Ask::get("/docs/swagger-ui-bundle.js", 200),
        Ask::get("/docs/nothing", 404),
        Ask::get("/livez", 200),
        Ask::get("/readyz", 200),
        Ask::get("/metrics", 200),
    ];
    examples.chain(more).collect()
}

/// One connection, kept open: an answer that is longer or shorter than it says would spoil the
/// next.
struct Connection {
    stream: BufReader<TcpStream>,
    address: String,
}

impl Connection {
    fn open(server: &Server) -> Self {
        Connection {
            stream: BufReader::new(TcpStream::connect(&server.address).unwrap()),
            address: server.address.clone(),
        }
    }

    fn ask(&mut self, method: &str, ask: &Ask, headers: &[&str]) -> Answer {
        let mut head =
            format!("{method} {} HTTP/1.1\r\nHost: {}\r\n", ask.path, self.address).into_bytes();
        let own = |line: &&&str| {
            ask.accept.is_none() || !line.to_ascii_lowercase().starts_with("accept:")
        };
        let sent = headers.iter().filter(own).map(|line| line.as_bytes().to_vec());
        let accept = ask.accept.map(|accept| format!("Accept: {accept}").into_bytes());
        let body = (ask.method == "POST").then(|| {
            format!("Content-Type: {}\r\nContent-Length: {}", ask.media_type, ask.body.len())
                .into_bytes()
        });
        for line in sent.chain(accept).chain(body) {
            head.extend([line.as_slice(), b"\r\n"].concat());
        }
        let stream = self.stream.get_mut();
        stream.write_all(&[&head, b"\r\n".as_slice(), &ask.body].concat()).unwrap();
        let answer = self.read(method == "HEAD");
        if answer.header("connection") == "close" {
            self.stream = BufReader::new(TcpStream::connect(&self.address).unwrap());
        }
        answer
    }

    fn read(&mut self, is_head: bool) -> Answer {
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            assert!(self.stream.read_until(b'\n', &mut head).unwrap() > 0, "closed after {head:?}");
        }
        let mut answer = Answer::parse(&head);
        answer.body =
            match (is_head, answer.header("transfer-encoding"), answer.header("content-length")) {
                (true, ..) => Vec::new(),
                (_, "chunked", "") => self.chunks(),
                (_, "", length) => self.exactly(length.parse().unwrap()),
                both => panic!("two lengths: {both:?}"),
            };
        answer
    }

    fn exactly(&mut self, length: usize) -> Vec<u8> {
        let mut body = vec![0; length];
        self.stream.read_exact(&mut body).unwrap();
        body
    }

    fn chunks(&mut self) -> Vec<u8> {
        let mut body = Vec::new();
        loop {
            let mut size = String::new();
            self.stream.read_line(&mut size).unwrap();
            let size = usize::from_str_radix(size.trim(), 16)
                .unwrap_or_else(|_| panic!("no chunk: {size:?}"));
            body.extend(self.exactly(size));
            assert_eq!(self.exactly(2), b"\r\n");
            if size == 0 {
                return body;
            }
        }
    }
}

/// The body as it was before it was coded: one gzip member or zstd frame, as many clients read no
/// more.
fn decoded(answer: &Answer) -> Vec<u8> {
    let (mut rest, mut text) = (answer.body.as_slice(), Vec::new());
    match answer.header("content-encoding") {
        "" => return answer.body.clone(),
        "gzip" => _ = flate2::bufread::GzDecoder::new(&mut rest).read_to_end(&mut text).unwrap(),
        "zstd" => {
            let mut decoder =
                zstd::stream::read::Decoder::with_buffer(&mut rest).unwrap().single_frame();
            decoder.read_to_end(&mut text).unwrap();
        }
        other => panic!("nobody asked for {other}"),
    }
    assert!(rest.is_empty(), "{} bytes after the end", rest.len());
    text
}

/// Two metrics differ in what they count.
fn comparable(ask: &Ask, body: &[u8]) -> Vec<u8> {
    if ask.path != "/metrics" {
        return body.to_vec();
    }
    let text = String::from_utf8(body.to_vec()).unwrap();
    assert!(text.ends_with("# EOF\n"), "{text}");
    text.lines().filter(|line| line.starts_with("# HELP")).collect::<String>().into_bytes()
}

fn check_headers(ask: &Ask, answer: &Answer, compression: &str, what: &str) {
    assert_eq!(answer.status, ask.status, "{what}: {}", answer.text());
    assert_eq!(answer.header("etag"), "", "{what}");
    let is_operation = ask.status == 200 && ask.path.starts_with("/v1/");
    let has_page = matches!(ask.status, 404 | 405) || ask.path == "/";
    let vary = match (is_operation, compression) {
        (false, _) => {
            if has_page {
                "accept"
            } else {
                ""
            }
        }
        (_, "on") => "accept, accept-encoding",
        _ => "accept",
    };
    assert_eq!(answer.header("vary"), vary, "{what}");
    let codings = answer.headers.iter().filter(|(name, _)| name == "content-encoding").count();
    assert!(codings <= 1, "{what}");
}

#[test]
fn every_program_reads_the_same_from_every_endpoint() {
    let servers = ["off", "on"]
        .map(|compression| (compression, Server::with(&["--compression", compression])));
    let asks = asks();
    let mut bare = Connection::open(&servers[0].1);
    let plain: Vec<Vec<u8>> = asks.iter().map(|ask| bare.ask(ask.method, ask, &[]).body).collect();
    for (compression, server) in &servers {
        for program in PROGRAMS {
            let mut connection = Connection::open(server);
            for (ask, plain) in asks.iter().zip(&plain) {
                let what = format!("{}, compression {compression}, {}", program.name, ask.name());
                let answer = connection.ask(ask.method, ask, program.headers);
                check_headers(ask, &answer, compression, &what);
                let is_long = plain.len() >= 1_024 || ask.path == "/v1/batch";
                let coding = if *compression == "on" && ask.is_compressible() && is_long {
                    program.coding
                } else {
                    ""
                };
                assert_eq!(answer.header("content-encoding"), coding, "{what}");
                assert!(
                    coding.is_empty()
                        || plain.len() < 10_000
                        || 2 * answer.body.len() < plain.len(),
                    "{what}"
                );
                let text = comparable(ask, &decoded(&answer));
                // Where there is nothing, who reads pages gets one.
                if matches!(ask.status, 404 | 405) && program.name.starts_with("address bar") {
                    assert!(text.starts_with(b"<!DOCTYPE html>"), "{what}");
                    continue;
                }
                assert!(
                    text == comparable(ask, plain),
                    "{what}: {}",
                    String::from_utf8_lossy(&text)
                );
            }
        }
        let metrics = server.get("/metrics").text();
        assert!(metrics.contains("springline_panics_total 0\n"), "{metrics}");
    }
}

#[test]
fn every_list_of_codings_has_a_defined_answer() {
    let servers = ["off", "on"]
        .map(|compression| (compression, Server::with(&["--compression", compression])));
    let ask = Ask::post("/v1/evaluate", "application/json", samples(2_000), 200);
    let plain = Connection::open(&servers[0].1).ask("POST", &ask, &[]).body;
    // What is sent, and what comes where compression is on.
    let lists: &[(&[&str], &str)] = &[
        (&["Accept-Encoding: gzip;q=0"], ""),
        (&["Accept-Encoding: identity;q=0"], ""),
        (&["Accept-Encoding: *;q=0"], ""),
        (&["Accept-Encoding: gzip;q=0, identity;q=0, *;q=0"], ""),
        (&["Accept-Encoding: *"], "gzip"),
        (&["Accept-Encoding:"], ""),
        (&["Accept-Encoding: ,;,q=1;;"], ""),
        (&["Accept-Encoding: GZIP"], "gzip"),
        (&["ACCEPT-ENCODING: x-gzip"], "gzip"),
        (&["Accept-Encoding: br"], ""),
        (&["Accept-Encoding: compress, snappy, dcb, aes128gcm"], ""),
        (&["Accept-Encoding: gzip;q=0.2, zstd;q=0.1"], "gzip"),
        (&["Accept-Encoding: gzip;q=0.2, zstd;q=0.1, identity;q=0.5"], ""),
        (&["Accept-Encoding: gzip", "Accept-Encoding: zstd"], "zstd"),
        (&["Accept-Encoding: zstd\u{fc}"], ""),
    ];
    for (compression, server) in &servers {
        let mut connection = Connection::open(server);
        for (sent, coding) in lists {
            let answer = connection.ask("POST", &ask, sent);
            check_headers(&ask, &answer, compression, &format!("{sent:?}"));
            assert_eq!(
                answer.header("content-encoding"),
                if *compression == "on" { coding } else { "" },
                "{sent:?}"
            );
            assert!(decoded(&answer) == plain, "{sent:?}");
        }
    }
}

#[test]
fn head_says_what_get_would() {
    let server = Server::with(&["--compression", "on"]);
    let mut connection = Connection::open(&server);
    for ask in asks().iter().filter(|ask| ask.method == "GET") {
        for program in PROGRAMS {
            let (get, head) = (
                connection.ask("GET", ask, program.headers),
                connection.ask("HEAD", ask, program.headers),
            );
            assert_eq!(head.status, get.status, "{}", ask.path);
            assert_eq!(head.header("content-type"), get.header("content-type"), "{}", ask.path);
            let length = head.header("content-length");
            // What is refused names the method, what is counted grows.
            let differs = get.status == 405 || ask.path == "/metrics";
            assert!(
                length.is_empty() || differs || length == get.header("content-length"),
                "{}: {length}",
                ask.path
            );
        }
    }
}

/// Lines are answered as they come, packed or not.
#[test]
fn lines_arrive_packed_while_the_batch_is_sent() {
    let server = Server::with(&["--compression", "on"]);
    for coding in ["gzip", "zstd"] {
        let mut stream = TcpStream::connect(&server.address).unwrap();
        let head = format!(
            "POST /v1/batch HTTP/1.1\r\nHost: t\r\nContent-Type: {NDJSON}\r\nAccept-Encoding: {coding}\r\n"
        );
        stream.write_all(format!("{head}Transfer-Encoding: chunked\r\n\r\n").as_bytes()).unwrap();
        let mut connection = Connection {
            stream: BufReader::new(stream.try_clone().unwrap()),
            address: server.address.clone(),
        };
        let mut packed = Vec::new();
        for i in 1..=3 {
            let line = format!(
                "{{\"op\": \"evaluate\", \"body\": {}}}\n",
                String::from_utf8(samples(3)).unwrap()
            );
            write!(stream, "{:x}\r\n{line}\r\n", line.len()).unwrap();
            if i == 1 {
                let mut head = Vec::new();
                while !head.ends_with(b"\r\n\r\n") {
                    connection.stream.read_until(b'\n', &mut head).unwrap();
                }
                assert_eq!(Answer::parse(&head).header("content-encoding"), coding);
            }
            while !String::from_utf8_lossy(&readable(coding, &packed))
                .contains(&format!("{{\"line\":{i},"))
            {
                let mut size = String::new();
                connection.stream.read_line(&mut size).unwrap();
                packed.extend(connection.exactly(usize::from_str_radix(size.trim(), 16).unwrap()));
                connection.exactly(2);
            }
        }
        stream.write_all(b"0\r\n\r\n").unwrap();
        packed.extend(connection.chunks());
        let headers = vec![("content-encoding".to_owned(), coding.to_owned())];
        let text = decoded(&Answer { status: 200, headers, body: packed });
        assert_eq!(text.iter().filter(|byte| **byte == b'\n').count(), 3);
    }
}

/// What can be read of a text that has not ended.
fn readable(coding: &str, packed: &[u8]) -> Vec<u8> {
    let mut text = Vec::new();
    let _ = match coding {
        "gzip" => flate2::read::GzDecoder::new(packed).read_to_end(&mut text),
        _ => zstd::stream::read::Decoder::new(packed).unwrap().read_to_end(&mut text),
    };
    text
}
