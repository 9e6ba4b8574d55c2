//! Answers in other shapes hold the same numbers; requests in the raw format mean the same.

use crate::support::*;
use serde_json::{Value, json};

const RAW: &str = "application/vnd.springline.f64";

/// The request of a test, with headers of its own.
fn ask(server: &Server, path: &str, accept: &str, body: &Value) -> Answer {
    let body = body.to_string();
    let head = format!(
        "POST {path} HTTP/1.1\r\nhost: t\r\nconnection: close\r\ncontent-type: application/json\r\naccept: {accept}\r\ncontent-length: {}\r\n\r\n{body}",
        body.len()
    );
    server.raw(head.as_bytes())
}

/// A raw answer as the JSON it stands for.
fn decoded(bytes: &[u8]) -> Value {
    assert_eq!(&bytes[..8], b"SPRLINE1");
    let length = u32::from_le_bytes(bytes[8..12].try_into().unwrap()) as usize;
    assert_eq!((length + 16) % 8, 0, "the numbers are aligned");
    let header = serde_json::from_slice(&bytes[16..16 + length]).unwrap();
    resolved(header, &bytes[16 + length..])
}

fn resolved(value: Value, numbers: &[u8]) -> Value {
    match value {
        Value::Array(items) => items.into_iter().map(|item| resolved(item, numbers)).collect(),
        Value::Object(fields) => match (fields.get("$f64"), fields.get("$f32")) {
            (Some(place), _) => rows(
                place,
                numbers.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect(),
            ),
            (_, Some(place)) => rows(
                place,
                numbers
                    .as_chunks()
                    .0
                    .iter()
                    .map(|bytes| f64::from(f32::from_le_bytes(*bytes)))
                    .collect(),
            ),
            _ => fields.into_iter().map(|(key, field)| (key, resolved(field, numbers))).collect(),
        },
        other => other,
    }
}

fn rows(place: &Value, numbers: Vec<f64>) -> Value {
    let [start, rows, columns] = [0, 1, 2].map(|i| place[i].as_u64().unwrap() as usize);
    let row = |i: usize| match columns {
        0 => json!(numbers[start + i]),
        _ => json!(numbers[start + i * columns..start + (i + 1) * columns]),
    };
    (0..rows).map(row).collect()
}

#[test]
fn raw_answers_hold_the_same_doubles() {
    let server = Server::start();
    for (path, name, body) in examples().into_iter().filter(|(path, ..)| *path != "/v1/render") {
        let answer = ask(&server, path, RAW, &body);
        assert_eq!((answer.status, answer.header("content-type")), (200, RAW), "{name}");
        let plain = server.ok(path, &body);
        let raw = decoded(&answer.body);
        same(&plain, &raw, name);
    }
}

fn same(plain: &Value, raw: &Value, name: &str) {
    let bits =
        |value: &Value| numbers(value).iter().map(|number| number.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(plain), bits(raw), "{name}");
    let shape =
        |value: &Value| places(value).into_iter().map(|(place, _)| place).collect::<Vec<_>>();
    assert_eq!(shape(plain), shape(raw), "{name}");
}

#[test]
fn numbers_are_rounded_as_asked() {
    let server = Server::start();
    let curve = json!({"family": "bezier", "control_points": [[0, 0, 0], [1, 3, 0.1], [4, 3, 1e-9], [5, 0, 1e9]]});
    let body = json!({"curve": curve, "sampling": {"kind": "count", "count": 17}});
    let exact = numbers(&server.ok("/v1/evaluate", &body));
    for (precision, bound) in [("single", 6e-8), ("3", 5.1e-3), ("15", 5.1e-15)] {
        for accept in ["application/json", RAW] {
            let answer =
                ask(&server, &format!("/v1/evaluate?precision={precision}"), accept, &body);
            let answer = if accept == RAW { decoded(&answer.body) } else { answer.json() };
            let found = numbers(&answer);
            assert_eq!(found.len(), exact.len());
            for (found, exact) in found.iter().zip(&exact) {
                assert!(
                    (found - exact).abs() <= bound * exact.abs(),
                    "{precision}: {found} for {exact}"
                );
            }
            assert_ne!(found, exact, "{precision}: nothing was rounded");
        }
    }
    assert_eq!(numbers(&ask(&server, "/v1/evaluate?precision=17", "*/*", &body).json()), exact);
    for digits in 1..=17 {
        let rounded: Vec<f64> = exact
            .iter()
            .map(|number| format!("{number:.*e}", digits - 1).parse().unwrap())
            .collect();
        for accept in ["application/json", RAW] {
            let answer = ask(&server, &format!("/v1/evaluate?precision={digits}"), accept, &body);
            let answer = if accept == RAW { decoded(&answer.body) } else { answer.json() };
            assert_eq!(numbers(&answer), rounded, "{digits}");
        }
    }
}

#[test]
fn flat_lists_have_the_same_numbers_in_one_row() {
    let server = Server::start();
    let curve = json!({"family": "bezier", "control_points": [[0, 0], [1, 3], [4, 3], [5, 0]]});
    let body = json!({"curve": curve, "sampling": {"kind": "count", "count": 5}, "derivatives": 1});
    let flat = ask(&server, "/v1/evaluate?layout=flat", "*/*", &body).json();
    let nested = server.ok("/v1/evaluate", &body);
    assert_eq!(numbers(&flat), numbers(&nested));
    assert_eq!(flat["points"].as_array().unwrap().len(), 10);
    assert_eq!(flat["derivatives"][0].as_array().unwrap().len(), 10);
}

/// A raw request: the header, and the numbers after it.
fn raw(header: &str, numbers: &[f64]) -> Vec<u8> {
    let header = format!("{header:<width$}", width = (header.len() + 16).next_multiple_of(8) - 16);
    let mut bytes = b"SPRLINE1".to_vec();
    bytes.extend((header.len() as u32).to_le_bytes());
    bytes.extend([0; 4]);
    bytes.extend(header.as_bytes());
    numbers.iter().for_each(|number| bytes.extend(number.to_le_bytes()));
    bytes
}

#[test]
fn raw_requests_mean_the_same() {
    let server = Server::start();
    let points: Vec<f64> = (0..300).map(|i| f64::from(i) + (f64::from(i) * 0.7).sin()).collect();
    for columns in [2, 3] {
        let rows: Vec<&[f64]> = points.chunks_exact(columns).collect();
        let plain = server.post_json("/v1/interpolate", &json!({"points": rows}));
        let header = format!(r#"{{"points": {{"$f64": [0, {}, {columns}]}}}}"#, rows.len());
        let answer = server.post_as("/v1/interpolate", Some(RAW), raw(&header, &points));
        assert_eq!((answer.status, &answer.body), (200, &plain.body), "{}", answer.text());
    }
    let curve = r#"{"family": "bezier", "control_points": {"$f64": [3, 4, 2]}}"#;
    let header = format!(
        r#"{{"curve": {curve}, "sampling": {{"kind": "parameters", "values": {{"$f64": [0, 3, 0]}}}}}}"#
    );
    let numbers = [0.0, 0.25, 1.0, 0.0, 0.0, 1.0, 3.0, 4.0, 3.0, 5.0, 0.0];
    let answer = server.post_as("/v1/evaluate", Some(RAW), raw(&header, &numbers));
    assert_eq!(answer.json()["parameters"], json!([0.0, 0.25, 1.0]), "{}", answer.text());
}

#[test]
fn broken_raw_requests_are_refused() {
    let server = Server::start();
    let refused = |body: Vec<u8>, pointer: Option<&str>| {
        let answer = server.post_as("/v1/interpolate", Some(RAW), body);
        assert_eq!(answer.status, 400, "{}", answer.text());
        assert_valid(&problem_validator(&specification()), &answer.json(), "problem");
        if let Some(pointer) = pointer {
            assert_eq!(answer.pointer(), pointer, "{}", answer.text());
        }
    };
    let good = raw(r#"{"points": {"$f64": [0, 2, 2]}}"#, &[0.0, 0.0, 1.0, 1.0]);
    assert_eq!(server.post_as("/v1/interpolate", Some(RAW), &good).status, 200);
    for end in [0, 7, 15, 20] {
        refused(good[..end].to_vec(), None);
    }
    refused(b"SPRLINE2".iter().chain(&good[8..]).copied().collect(), None);
    refused(raw(r#"{"points": {"$f64": [0, 3, 2]}}"#, &[0.0; 4]), Some("/points"));
    refused(raw(r#"{"points": {"$f64": [0, 2, 4]}}"#, &[0.0; 8]), Some("/points"));
    refused(
        raw(r#"{"points": {"$f64": [18446744073709551615, 2, 2]}}"#, &[0.0; 4]),
        Some("/points"),
    );
    refused(raw(r#"{"points": {"$f64": [0, 2, 2]}}"#, &[0.0, f64::NAN, 1.0, 1.0]), Some("/points"));
    refused(raw(r#"{"points": {"points": 1}}"#, &[]), None);
    // Nothing stands for numbers where there are none.
    let answer = server.post("/v1/interpolate", r#"{"points": {"$f64": [0, 2, 2]}}"#);
    assert_eq!((answer.status, answer.pointer().as_str()), (400, "/points"));
}

#[test]
fn what_nobody_can_give_is_refused() {
    let server = Server::start();
    let (path, _, body) = examples().remove(0);
    let refused = |path: &str, accept: &str, status: u16, code: &str| {
        let answer = ask(&server, path, accept, &body);
        assert_eq!(
            (answer.status, answer.json()["code"].as_str()),
            (status, Some(code)),
            "{path} {accept}"
        );
    };
    refused(path, "text/html", 406, "not_acceptable");
    refused("/v1/render", "application/json", 406, "not_acceptable");
    refused("/v1/evaluate?precision=18", "*/*", 400, "bad_query");
    refused("/v1/evaluate?layout=", "*/*", 400, "bad_query");
    refused("/v1/evaluate?digits=3", "*/*", 400, "bad_query");
    refused("/v1/evaluate?layout=flat&layout=flat", "*/*", 400, "bad_query");
}

/// Runs a script that reads and writes the raw format, where its runtime is there; it prints what
/// it found as JSON.
fn script(program: &str, arguments: &[&str], probe: &[&str]) -> Option<Value> {
    let there = std::process::Command::new(program)
        .args(probe)
        .output()
        .is_ok_and(|output| output.status.success());
    if !there {
        eprintln!("{program} is not there: its reader is not tried");
        return None;
    }
    let output = std::process::Command::new(program).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(serde_json::from_slice(&output.stdout).unwrap())
}

/// Interpolates raw points, and prints the control points found.
fn readers_agree(found: Option<Value>, server: &Server) {
    let points = json!([[0, 0], [1, 2], [3, 3], [4, 0]]);
    let plain = server.ok("/v1/interpolate", &json!({"points": points}));
    if let Some(found) = found {
        assert_eq!(numbers(&found), numbers(&plain["curve"]["control_points"]));
    }
}

#[test]
fn the_reader_in_javascript_reads_and_writes() {
    let server = Server::start();
    let url = server.url("/v1/interpolate");
    let module = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/raw/raw.mjs");
    let code = format!(
        "import {{ decode, encode, points }} from '{module}'; const type = '{RAW}';
         const body = encode({{ points: points([0, 0, 1, 2, 3, 3, 4, 0], 2) }});
         const answer = await fetch('{url}', {{ method: 'POST', headers: {{ 'content-type': type, accept: type }}, body }});
         console.log(JSON.stringify([...decode(await answer.arrayBuffer()).curve.control_points]));"
    );
    readers_agree(script("node", &["--input-type=module", "-e", &code], &["--version"]), &server);
}

#[test]
fn the_reader_in_python_reads_and_writes() {
    let server = Server::start();
    let url = server.url("/v1/interpolate");
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/raw");
    let code = format!(
        "import sys, json, urllib.request; sys.path.insert(0, '{folder}'); import numpy, raw
body = raw.encode({{'points': numpy.array([[0, 0], [1, 2], [3, 3], [4, 0]], float)}})
request = urllib.request.Request('{url}', body, {{'content-type': '{RAW}', 'accept': '{RAW}'}})
print(json.dumps(raw.decode(urllib.request.urlopen(request).read())['curve']['control_points'].tolist()))"
    );
    readers_agree(script("python3", &["-B", "-c", &code], &["-c", "import numpy"]), &server);
}

#[test]
fn answers_are_compressed_where_that_is_set_for_who_asks_from_a_size_on() {
    let encoding = |server: &Server, count: usize, headers: &str| {
        let curve = json!({"family": "bezier", "control_points": [[0, 0], [1, 3], [4, 3], [5, 0]]});
        let body =
            json!({"curve": curve, "sampling": {"kind": "count", "count": count}}).to_string();
        let head = format!(
            "POST /v1/evaluate HTTP/1.1\r\nhost: t\r\nconnection: close\r\ncontent-type: application/json\r\n{headers}content-length: {}\r\n\r\n{body}",
            body.len()
        );
        let answer = server.raw(head.as_bytes());
        assert_eq!(answer.status, 200);
        (answer.header("content-encoding").to_owned(), answer.body.len())
    };
    let browser = "accept-encoding: gzip, deflate, br, zstd\r\n";
    assert_eq!(encoding(&Server::start(), 10_000, browser).0, "", "off by default");
    let server = Server::with(&["--compression", "on"]);
    let (none, plain) = encoding(&server, 10_000, "");
    assert_eq!(none, "");
    for (headers, coding) in [("accept-encoding: gzip\r\n", "gzip"), (browser, "zstd")] {
        let (given, small) = encoding(&server, 10_000, headers);
        assert_eq!(given, coding);
        assert!(2 * small < plain, "{coding}: {small} of {plain}");
        assert_eq!(encoding(&server, 2, headers).0, "", "small answers are not worth it");
        assert_eq!(
            encoding(&server, 10_000, &format!("{headers}accept: {RAW}\r\n")).0,
            "",
            "numbers as bytes shrink little"
        );
    }
}
