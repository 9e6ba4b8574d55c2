//! Hostile bodies and hostile connections, against the real binary and every operation: each gets
//! an answer or a documented problem, and the service lives on.

use std::collections::HashSet;
use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};

use crate::support::*;
use serde_json::{Value, json};
use springline::api::operations::TABLE;

struct Bench {
    server: Server,
    problem: jsonschema::Validator,
}

impl Bench {
    fn new() -> Self {
        Bench { server: Server::start(), problem: problem_validator(&specification()) }
    }

    /// Sends a body; the answer is a success or a short problem of one of these statuses, which say
    /// that no deadline has passed.
    fn send(&self, path: &str, body: &[u8], statuses: &[u16]) -> Answer {
        let answer = self.server.post(path, body);
        let what = format!("{path} {}", String::from_utf8_lossy(&body[..body.len().min(2_000)]));
        assert!(statuses.contains(&answer.status), "{} {what}", answer.text());
        self.check(&answer, &what);
        answer
    }

    fn check(&self, answer: &Answer, what: &str) {
        let json = answer.json();
        assert!(!has_null(&json), "{json} {what}");
        if answer.status >= 400 {
            assert_eq!(answer.header("content-type"), "application/problem+json", "{what}");
            assert_valid(&self.problem, &json, what);
            assert!(answer.body.len() < 5_000, "{json} {what}");
        }
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            assert_eq!(self.server.get("/livez").status, 200, "alive after all that");
        }
    }
}

/// What a body that is no request may get.
const REFUSED: &[u16] = &[400];
const ANY: &[u16] = &[200, 400, 413, 422];

/// The text of a body with something in the place of a value that need not be JSON.
fn with_text(body: &Value, place: &str, text: &str) -> Vec<u8> {
    with(body, place, json!("HERE")).to_string().replace("\"HERE\"", text).into_bytes()
}

/// Every place of every example, but only the first two items of a list.
fn everywhere() -> impl Iterator<Item = (&'static str, Value, String)> {
    let of = |(path, _, body): (&'static str, &'static str, Value)| {
        let places: Vec<_> = places(&body)
            .into_iter()
            .map(|(place, _)| place)
            .filter(|place| near_the_start_of_lists(place))
            .collect();
        places.into_iter().map(move |place| (path, body.clone(), place))
    };
    examples().into_iter().flat_map(of)
}

fn nested(open: &str, shut: &str, depth: usize) -> String {
    format!("{}1{}", open.repeat(depth), shut.repeat(depth))
}

#[test]
fn nesting_of_any_depth_is_refused_in_every_place() {
    let bench = Bench::new();
    for (open, shut) in [("[", "]"), ("{\"a\":", "}"), ("[{\"a\":", "}]")] {
        let texts: Vec<String> =
            [100, 127, 128].iter().map(|&depth| nested(open, shut, depth)).collect();
        let endless = open.repeat(100_000);
        for (path, body, place) in everywhere() {
            texts
                .iter()
                .for_each(|text| drop(bench.send(path, &with_text(&body, &place, text), REFUSED)));
        }
        for (path, _, body) in examples() {
            bench.send(path, endless.as_bytes(), REFUSED);
            bench.send(path, nested(open, shut, 100_000).as_bytes(), REFUSED);
            for key in body.as_object().unwrap().keys() {
                bench.send(path, &with_text(&body, &format!("/{key}"), &endless), REFUSED);
            }
        }
    }
}

#[test]
fn what_is_not_json_is_refused_in_every_place() {
    const NOT_JSON: &[&str] = &[
        "NaN",
        "Infinity",
        "-Infinity",
        "nan",
        "inf",
        "0x10",
        "+1",
        "01",
        ".5",
        "1.",
        "-",
        "1e",
        "1e+",
        "--1",
        "1_000",
        "\u{661}",
        "'a'",
        "undefined",
        "None",
        "True",
        "/* */ 1",
        "[1,]",
        "{\"a\":1,}",
        "[",
        "]",
        "{",
        "}",
        ":",
        "\"",
        "\"\\ud800\"",
        "\"\\udc00\\ud800\"",
        "\"\\u12\"",
        "\"\\x41\"",
        "\"\t\"",
        "\"\u{0}\"",
        "\u{feff}1",
        "1 1",
        "\u{a0}1",
    ];
    let bench = Bench::new();
    for (i, (path, body, place)) in everywhere().enumerate() {
        // A quarter of them in each place, in turn.
        for text in NOT_JSON.iter().skip(i % 4).step_by(4) {
            bench.send(path, &with_text(&body, &place, text), REFUSED);
        }
    }
}

#[test]
fn numbers_at_the_edge_of_doubles_are_taken_or_refused_in_every_place() {
    let digits = "7".repeat(400);
    let numbers = [
        "1e308",
        "-1e308",
        "1e309",
        "-1e309",
        "1e999999",
        "1e-999999",
        "-1e-400",
        "1e99999999999999999999",
        &digits,
        &format!("0.{digits}"),
    ];
    let (bench, numbers) = (Bench::new(), numbers.map(str::to_owned));
    for (path, body, place) in everywhere() {
        numbers
            .iter()
            .for_each(|text| drop(bench.send(path, &with_text(&body, &place, text), ANY)));
    }
}

#[test]
fn bytes_of_another_encoding_are_refused() {
    let bench = Bench::new();
    for (path, _, body) in examples() {
        let text = body.to_string();
        let wide =
            |bytes: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(bytes).collect::<Vec<u8>>();
        let gzip = [b"\x1f\x8b\x08\x00".as_slice(), text.as_bytes()].concat();
        let cases = [
            wide(u16::to_le_bytes),
            wide(u16::to_be_bytes),
            gzip,
            vec![0; 1000],
            vec![0xff; 1000],
            b"\xef\xbb\xbf{}".to_vec(),
        ];
        cases.iter().for_each(|bytes| drop(bench.send(path, bytes, REFUSED)));
        for bytes in [
            b"\"\xff\"".as_slice(),
            b"\"\xc3\"",
            b"\"\xed\xa0\x80\"",
            b"\"\xf8\x88\x80\x80\x80\"",
            b"\xc0\x80",
        ] {
            let (before, after) = text.split_at(1);
            bench.send(
                path,
                &[before.as_bytes(), bytes, b":1,", after.as_bytes()].concat(),
                REFUSED,
            );
        }
    }
}

#[test]
fn an_example_is_refused_wherever_it_is_cut_and_whatever_follows_it() {
    let bench = Bench::new();
    for (path, _, body) in examples() {
        let text = body.to_string();
        for end in 0..text.len() {
            let answer = bench.send(path, &text.as_bytes()[..end], REFUSED);
            assert_eq!(answer.json()["code"], "not_json", "{}", &text[..end]);
        }
        for rest in ["x", "{}", " }", "\u{0}", ",", "null", &text] {
            let answer = bench.send(path, format!("{text}{rest}").as_bytes(), REFUSED);
            assert_eq!(
                (answer.json()["code"].as_str(), answer.pointer().as_str()),
                (Some("not_json"), ""),
                "{rest}"
            );
        }
        bench.send(path, &b" \t\r\n".repeat(100_000), REFUSED);
    }
}

#[test]
fn a_long_name_is_not_echoed_whole() {
    let bench = Bench::new();
    for (path, _, body) in examples() {
        for (object, _) in
            objects(&body).into_iter().filter(|(place, _)| near_the_start_of_lists(place))
        {
            let count = if object.is_empty() { 333_333 } else { 3_333 };
            let long = "k~/".repeat(count);
            let answer = bench.send(
                path,
                with_key(&body, &object, &long, json!(1)).to_string().as_bytes(),
                REFUSED,
            );
            assert!(
                answer.pointer().starts_with(&format!("{object}/k~0~1k"))
                    && answer.pointer().contains("[...]"),
                "{}",
                answer.text()
            );
        }
    }
}

#[test]
fn a_million_empty_lists_are_refused() {
    let bench = Bench::new();
    let lists = format!("[{}[]]", "[],".repeat(1_000_000));
    let mut sent = HashSet::new();
    for (path, _, body) in examples() {
        for key in body.as_object().unwrap().keys().filter(|&key| sent.insert((path, key.clone())))
        {
            bench.send(path, &with_text(&body, &format!("/{key}"), &lists), REFUSED);
        }
    }
}

#[test]
fn long_paths_methods_and_media_types_are_not_echoed_whole() {
    let bench = Bench::new();
    let long = "x".repeat(20_000);
    let (get, type_of) = (
        bench.server.get(&format!("/{long}")),
        bench.server.post_as("/v1/evaluate", Some(&long), "{}"),
    );
    let method = bench.server.method(&long[..5_000], "/v1/evaluate");
    for (answer, status) in [(get, 404), (type_of, 415), (method, 405)] {
        assert_eq!(answer.status, status, "{}", answer.text());
        bench.check(&answer, "long");
    }
}

// Connections.

const HEAD: &str = "Host: test\r\nConnection: close\r\nContent-Type: application/json\r\n";

/// What the server says to these pieces, sent one after the other, until it closes; and then, if
/// not before, the sender closes too.
fn converse(server: &Server, pieces: &[Vec<u8>], close: bool) -> String {
    let mut stream = TcpStream::connect(&server.address).unwrap();
    stream.set_nodelay(true).unwrap();
    // The server may answer and close before it has read everything.
    let _ = pieces.iter().try_for_each(|piece| stream.write_all(piece));
    if close {
        let _ = stream.shutdown(Shutdown::Write);
    }
    let mut heard = Vec::new();
    let _ = stream.read_to_end(&mut heard);
    String::from_utf8_lossy(&heard).into_owned()
}

fn head(path: &str, more: &str) -> Vec<u8> {
    format!("POST {path} HTTP/1.1\r\n{HEAD}{more}\r\n\r\n").into_bytes()
}

#[test]
fn a_body_that_trickles_in_is_answered_like_any_other() {
    let bench = Bench::new();
    for (path, name, body) in examples() {
        let text = body.to_string().into_bytes();
        let chunk = |byte: &u8| vec![b'1', b'\r', b'\n', *byte, b'\r', b'\n'];
        let chunks = text.iter().map(chunk).chain([b"0\r\n\r\n".to_vec()]);
        let pieces: Vec<_> =
            std::iter::once(head(path, "Transfer-Encoding: chunked")).chain(chunks).collect();
        let heard = converse(&bench.server, &pieces, false);
        let expected = bench.server.post_json(path, &body).text();
        assert!(
            heard.starts_with("HTTP/1.1 200 ") && heard.ends_with(&expected),
            "{name}: {heard}"
        );
    }
}

#[test]
fn a_body_that_ends_early_gets_no_success() {
    let bench = Bench::new();
    for (path, _, body) in examples() {
        let text = body.to_string();
        let declared = head(path, &format!("Content-Length: {}", text.len() + 1));
        let chunked = [
            head(path, "Transfer-Encoding: chunked"),
            format!("{:x}\r\n{text}\r\n", text.len()).into_bytes(),
        ]
        .concat();
        for pieces in [[declared, text.clone().into_bytes()], [chunked, Vec::new()]] {
            let heard = converse(&bench.server, &pieces, true);
            assert!(
                heard.is_empty()
                    || heard.starts_with("HTTP/1.1 400 ") && heard.contains("unreadable_body"),
                "{path}: {heard}"
            );
        }
    }
}

#[test]
fn framing_that_contradicts_itself_gets_no_success() {
    let bench = Bench::new();
    for path in TABLE.iter().map(|entry| entry.path) {
        let chunked = |body: &str| {
            [head(path, "Transfer-Encoding: chunked"), body.as_bytes().to_vec()].concat()
        };
        let with_body = |more: &str| [head(path, more), b"{}{}".to_vec()].concat();
        let requests = [
            chunked("x\r\n{}\r\n0\r\n\r\n"),
            chunked("-1\r\n{}\r\n0\r\n\r\n"),
            chunked("ffffffffffffffffff\r\n{}\r\n0\r\n\r\n"),
            chunked("1\r\n{}\r\n0\r\n\r\n"),
            chunked(&format!("2;{}\r\n{{}}\r\n0\r\n\r\n", "x".repeat(100_000))),
            with_body("Content-Length: 2\r\nContent-Length: 4"),
            with_body("Content-Length: 2, 4"),
            with_body("Content-Length: -2"),
            with_body("Content-Length: +2"),
            with_body("Content-Length: 99999999999999999999999"),
            with_body("Transfer-Encoding: gzip"),
            with_body("Content-Length: 2\r\nBad Name: 1"),
            with_body("Content-Length: 2\r\nX: \u{0}"),
        ];
        for request in requests {
            let heard = converse(&bench.server, std::slice::from_ref(&request), true);
            let refused = heard.is_empty() || heard.starts_with("HTTP/1.1 4");
            assert!(
                refused && heard.matches("HTTP/1.1").count() <= 1,
                "{}: {heard}",
                String::from_utf8_lossy(&request[..150])
            );
        }
    }
}

#[test]
fn a_list_that_no_curve_needs_is_refused_while_it_is_read() {
    let server = Server::start();
    let long = |item: &str| vec![item; 1_000_000].join(",");
    let curve = r#"{"family": "bezier", "control_points": [[0, 0], [1, 1]]}"#;
    let values = format!(
        r#"{{"curve": {curve}, "sampling": {{"kind": "parameters", "values": [{}]}}}}"#,
        long("0")
    );
    let points = format!(r#"{{"points": [{}]}}"#, long("[0,0]"));
    for (path, body, pointer) in
        [("/v1/evaluate", values, "/sampling/values"), ("/v1/interpolate", points, "/points")]
    {
        let answer = server.post(path, body);
        assert_eq!(
            (answer.status, answer.pointer().starts_with(pointer)),
            (413, true),
            "{}",
            answer.text()
        );
    }
}
