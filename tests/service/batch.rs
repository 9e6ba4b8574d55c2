//! Batches: the answers of single requests, in order, whatever fails between them; over HTTP and
//! from the command line.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::Stdio;
use std::thread;

use crate::support::*;
use serde_json::{Value, json};

const NDJSON: &str = "application/x-ndjson";

fn line(id: &str, path: &str, body: &Value) -> String {
    format!("{}\n", json!({"id": id, "op": path.trim_start_matches("/v1/"), "body": body}))
}

fn lines(text: &[u8]) -> Vec<Value> {
    text.split(|byte| *byte == b'\n')
        .filter(|line| !line.is_empty())
        .map(|line| serde_json::from_slice(line).unwrap())
        .collect()
}

/// Every example many times over, with broken lines between.
fn mixed() -> (String, Vec<Option<usize>>) {
    let all = examples();
    let (mut text, mut expected) = (String::new(), Vec::new());
    for round in 0..20 {
        for (i, (path, name, body)) in
            all.iter().enumerate().filter(|(_, (path, ..))| *path != "/v1/fit" || round == 0)
        {
            text += &line(name, path, body);
            expected.push(Some(i));
        }
        for broken in [
            "{",
            "[]",
            r#"["a", "evaluate", {}]"#,
            r#"{"op": "nothing", "body": {}}"#,
            r#"{"op": "evaluate", "body": {}}"#,
            r#"{"op": "evaluate", "body": {}, "more": 1}"#,
        ] {
            text += broken;
            text += "\n";
            expected.push(None);
        }
    }
    (text, expected)
}

fn check(text: &[u8], expected: &[Option<usize>], singles: &[Value]) {
    let answers = lines(text);
    assert_eq!(answers.len(), expected.len());
    for (i, (answer, expected)) in answers.iter().zip(expected).enumerate() {
        assert_eq!(answer["line"], i + 1);
        match expected {
            Some(which) => {
                assert_eq!(
                    (&answer["answer"], &answer["id"]),
                    (&singles[*which], &json!(examples()[*which].1)),
                    "line {}",
                    i + 1
                )
            }
            None => assert!(
                answer["problem"]["status"].as_u64().unwrap() >= 400
                    && answer.get("answer").is_none(),
                "{answer}"
            ),
        }
    }
}

#[test]
fn a_batch_has_the_answers_of_single_requests_in_order() {
    let server = Server::start();
    let singles: Vec<Value> =
        examples().iter().map(|(path, _, body)| server.post_json(path, body).json()).collect();
    let (text, expected) = mixed();
    let answer = server.post_as("/v1/batch", Some(NDJSON), &text);
    assert_eq!((answer.status, answer.header("content-type")), (200, NDJSON));
    check(&answer.body, &expected, &singles);
    // The same from the command line, byte for byte.
    let mut child = binary()
        .args(["batch", "--quiet"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    let writing = thread::spawn(move || input.write_all(text.as_bytes()).unwrap());
    let output = child.wait_with_output().unwrap();
    writing.join().unwrap();
    assert!(output.status.success());
    assert!(output.stdout == answer.body, "the command line answers otherwise");
}

#[test]
fn lines_are_answered_while_the_batch_is_sent() {
    let server = Server::start();
    let mut stream = TcpStream::connect(&server.address).unwrap();
    stream
        .write_all(b"POST /v1/batch HTTP/1.1\r\nhost: t\r\ncontent-type: application/x-ndjson\r\ntransfer-encoding: chunked\r\n\r\n")
        .unwrap();
    let (path, name, body) = examples().remove(0);
    let mut received = String::new();
    for i in 1..=3 {
        let text = line(name, path, &body);
        write!(stream, "{:x}\r\n{text}\r\n", text.len()).unwrap();
        while !received.contains(&format!("{{\"line\":{i},")) {
            let mut bytes = [0; 4096];
            let count = stream.read(&mut bytes).unwrap();
            assert!(count > 0, "closed after {received}");
            received += &String::from_utf8_lossy(&bytes[..count]);
        }
    }
    stream.write_all(b"0\r\n\r\n").unwrap();
}

#[test]
fn a_client_that_stops_reading_stops_the_work_and_memory_stays_bounded() {
    let server = Server::with(&["--answer-time", "1s"]);
    let curve = json!({"family": "bezier", "control_points": [[0, 0], [1, 3], [4, 3], [5, 0]]});
    let text = line(
        "a",
        "/v1/evaluate",
        &json!({"curve": curve, "sampling": {"kind": "count", "count": 500}}),
    );
    let mut stream = TcpStream::connect(&server.address).unwrap();
    stream
        .write_all(b"POST /v1/batch HTTP/1.1\r\nhost: t\r\ncontent-type: application/x-ndjson\r\ntransfer-encoding: chunked\r\n\r\n")
        .unwrap();
    let many = text.repeat(2_000);
    let chunk = format!("{:x}\r\n{many}\r\n", many.len());
    // 200,000 lines and gigabytes of answers, if they were taken; the service stops reading long
    // before.
    let sent = (0..100).take_while(|_| stream.write_all(chunk.as_bytes()).is_ok()).count();
    assert!(sent < 100, "everything was taken from a client that reads nothing");
    wait_until(|| server.metric("springline_connections_closed_total{reason=\"answer\"}") == 1.0);
    wait_until(|| {
        server.metric("springline_held_bytes") == 0.0
            && server.metric("springline_computations_running") == 0.0
    });
}

#[test]
fn a_line_without_end_is_refused_and_the_type_is_checked() {
    let server = Server::with(&["--max-body", "4KiB"]);
    let (path, name, body) = examples().remove(0);
    let text = format!("{}{}", line(name, path, &body), "x".repeat(100_000));
    let answers = lines(&server.post_as("/v1/batch", Some(NDJSON), text).body);
    assert_eq!(answers.len(), 2);
    assert_eq!(answers[1]["problem"]["code"], "too_large", "{}", answers[1]);
    assert_eq!(server.post("/v1/batch", "{}").status, 415);
    assert_eq!(server.post_as("/v1/batch", Some(NDJSON), "").body, b"");
}

#[test]
fn a_line_that_is_no_operation_says_why_in_sentences() {
    let server = Server::start();
    let cases = [
        // As derived readers would take it: its fields in order.
        (r#"["a", "basis", {}]"#, "bad_line", "this is an array; expected an object", &[""][..]),
        (
            r#"{"id": 1.5, "op": "basis", "body": {}}"#,
            "bad_line",
            "this is the number 1.5; expected text, or a whole number",
            &["/id"],
        ),
        (
            r#"{"id": null, "op": "basis", "body": {}}"#,
            "bad_line",
            "this is null; expected text",
            &["/id"],
        ),
        (r#"{"id": 7, "oop": "basis"}"#, "bad_line", "did you mean `op`?", &["/oop", ""]),
        (
            r#"{"id": 7, "op": 1, "op": 2, "body": {}}"#,
            "bad_line",
            "this is the number 1; expected a string",
            &["/op", "/op"],
        ),
        (
            r#"{"id": 7, "op": "evalute", "body": {}}"#,
            "unknown_operation",
            "did you mean evaluate?",
            &["/op"],
        ),
        (
            r#"{"id": 7, "op": "evaluate", "#,
            "not_json",
            "the line ends in the middle of an object",
            &[],
        ),
    ];
    let text: String = cases.iter().map(|(line, ..)| format!("{line}\n")).collect();
    let answers = lines(&server.post_as("/v1/batch", Some(NDJSON), text).body);
    for ((line, code, detail, places), answer) in cases.iter().zip(&answers) {
        let problem = &answer["problem"];
        assert_eq!(problem["code"], *code, "{line}: {answer}");
        assert!(problem["detail"].as_str().unwrap().contains(detail), "{line}: {answer}");
        let found: Vec<&str> = problem["errors"]
            .as_array()
            .unwrap()
            .iter()
            .map(|item| item["pointer"].as_str().unwrap())
            .collect();
        assert_eq!(found, *places, "{line}: {answer}");
        let id =
            if line.contains("\"id\": 7") && *code != "not_json" { json!(7) } else { Value::Null };
        assert_eq!(answer["id"], id, "{line}: what can be read of a line is its name too");
    }
    assert_eq!(answers[6]["problem"]["line"], 7);
}
