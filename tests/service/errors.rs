//! Every wrong request gets a problem that names the place.

use crate::support::mutate::{Random, hostile, mutate};
use crate::support::*;
use serde_json::{Value, json};

/// The service and the schema of its errors.
struct Bench {
    server: Server,
    problem: jsonschema::Validator,
}

impl Bench {
    fn new() -> Self {
        Bench { server: Server::start(), problem: problem_validator(&specification()) }
    }

    /// Checks the form that every error has, and its status and code.
    fn check(&self, answer: &Answer, status: u16, code: &str, what: &str) {
        assert_eq!(answer.status, status, "{what}: {}", answer.text());
        assert_eq!(answer.header("content-type"), "application/problem+json", "{what}");
        let problem = answer.json();
        assert_valid(&self.problem, &problem, what);
        assert!(!has_null(&problem), "{problem}");
        assert_eq!(problem["code"], code, "{what}: {problem}");
        assert_eq!(problem["status"], status, "{what}");
        assert_eq!(problem["type"], format!("urn:springline:problem:{code}"), "{what}");
        for text in [&problem["title"], &problem["detail"]] {
            assert!(text.as_str().is_some_and(|text| !text.is_empty()), "{problem}");
        }
    }

    fn refuse(
        &self,
        path: &str,
        body: &Value,
        (status, code): (u16, &str),
        pointer: &str,
    ) -> String {
        let answer = self.server.post_json(path, body);
        let what = format!("{path} {}", &body.to_string().chars().take(300).collect::<String>());
        self.check(&answer, status, code, &what);
        assert_eq!(answer.pointer(), pointer, "{what}: {}", answer.text());
        answer.json()["detail"].as_str().unwrap().to_owned()
    }

    fn evaluate(&self, curve: Value, expected: (u16, &str), pointer: &str) -> String {
        let pointer = format!("/curve{pointer}");
        self.refuse(
            "/v1/evaluate",
            &json!({"curve": curve, "sampling": {"kind": "count", "count": 2}}),
            expected,
            &pointer,
        )
    }

    fn broken(&self, text: impl AsRef<[u8]>, code: &str, line: u64, column: u64) -> Value {
        let answer = self.server.post("/v1/evaluate", text.as_ref());
        let what =
            String::from_utf8_lossy(&text.as_ref()[..text.as_ref().len().min(200)]).into_owned();
        self.check(&answer, 400, code, &what);
        let problem = answer.json();
        assert_eq!(
            (problem["line"].as_u64(), problem["column"].as_u64()),
            (Some(line), Some(column)),
            "{what}: {problem}"
        );
        problem
    }
}

const OUT_OF_RANGE: (u16, &str) = (422, "out_of_range");
const WRONG_COUNT: (u16, &str) = (422, "wrong_count");
const TOO_FEW: (u16, &str) = (422, "too_few");
const TOO_LARGE: (u16, &str) = (413, "too_large");
const NOT_INCREASING: (u16, &str) = (422, "not_increasing");
const REPEATED: (u16, &str) = (422, "repeated_point");
const CONTRADICTION: (u16, &str) = (422, "contradiction");
const OVERFLOW: (u16, &str) = (422, "overflow");
const ROW_SUM: (u16, &str) = (422, "row_sum");

fn bezier() -> Value {
    json!({"family": "bezier", "control_points": [[0, 0], [1, 3], [4, 3], [5, 0]]})
}

fn piecewise() -> Value {
    let points = json!([[0, 0], [1, 3], [4, 3], [5, 0], [6, -3], [9, -3], [10, 0]]);
    json!({"family": "piecewise", "bases": [{"family": "bezier"}], "order": 3, "knots": [0, 1, 2], "control_points": points})
}

fn bspline() -> Value {
    json!({"family": "bspline", "degree": 2, "knots": [0, 0, 0, 1, 2, 2, 2], "control_points": [[0, 0], [1, 3], [4, 3], [5, 0]]})
}

fn quasi(rows: Value, count: usize) -> Value {
    let points: Vec<_> = (0..count).map(|i| [i, i * i]).collect();
    json!({"family": "quasi-bezier", "shape": {"kind": "matrix", "rows": rows}, "control_points": points})
}

fn points() -> Value {
    json!({"points": [[0, 0], [1, 2], [3, 3], [5, 1]]})
}

// Whole requests.

#[test]
fn unknown_paths_are_problems_too() {
    let bench = Bench::new();
    for path in [
        "/nothing",
        "/v1",
        "/v1/",
        "/v1/evaluate/",
        "/v1/Evaluate",
        "/v2/evaluate",
        "/livez/x",
        "//",
        "/docs/nothing.js",
        "/%00",
    ] {
        bench.check(&bench.server.get(path), 404, "not_found", path);
        assert!(
            bench.server.get(path).json()["detail"].as_str().unwrap().contains("/docs"),
            "{path}"
        );
    }
    bench.check(&bench.server.post("/v1/evaluat", "{}"), 404, "not_found", "evaluat");
}

#[test]
fn other_methods_are_refused_with_those_allowed() {
    let bench = Bench::new();
    for path in springline::api::operations::TABLE.iter().map(|entry| entry.path) {
        for method in ["GET", "PUT", "DELETE", "PATCH", "OPTIONS", "BREW"] {
            let answer = bench.server.method(method, path);
            bench.check(&answer, 405, "method_not_allowed", &format!("{method} {path}"));
            assert_eq!(answer.header("allow"), "POST");
        }
    }
    for path in ["/", "/favicon.svg", "/livez", "/readyz", "/openapi.json"] {
        let answer = bench.server.post(path, "{}");
        bench.check(&answer, 405, "method_not_allowed", path);
        assert!(answer.header("allow").contains("GET"), "{path}");
    }
}

#[test]
fn another_media_type_is_refused() {
    let bench = Bench::new();
    for (path, _, body) in examples() {
        for media_type in [
            None,
            Some("text/plain"),
            Some("application/x-www-form-urlencoded"),
            Some("application/jsonp"),
            Some("json"),
            Some(""),
        ] {
            let answer = bench.server.post_as(path, media_type, body.to_string());
            bench.check(&answer, 415, "unsupported_media_type", &format!("{path} {media_type:?}"));
            assert!(answer.json()["detail"].as_str().unwrap().contains("application/json"));
        }
    }
}

#[test]
fn a_compressed_body_is_refused_as_that() {
    let bench = Bench::new();
    for (path, media_type, body) in
        [("/v1/evaluate", "application/json", "{}"), ("/v1/batch", "application/x-ndjson", "")]
    {
        let ask = |coding: &str| {
            let head = format!(
                "POST {path} HTTP/1.1\r\nHost: test\r\nConnection: close\r\nContent-Type: {media_type}\r\n"
            );
            let length = body.len();
            bench.server.raw(
                format!(
                    "{head}Content-Encoding: {coding}\r\nContent-Length: {length}\r\n\r\n{body}"
                )
                .as_bytes(),
            )
        };
        let answer = ask("gzip");
        bench.check(&answer, 415, "unsupported_media_type", path);
        assert!(answer.json()["detail"].as_str().unwrap().contains("uncompressed"));
        assert_ne!(ask("Identity").status, 415, "{path}");
    }
}

const HEAD: &str = "POST /v1/evaluate HTTP/1.1\r\nHost: test\r\nConnection: close\r\nContent-Type: application/json\r\n";

#[test]
fn a_body_declared_too_large_is_refused_before_it_is_sent() {
    let bench = Bench::new();
    let answer =
        bench.server.raw(format!("{HEAD}Content-Length: 999999999999\r\n\r\n{{").as_bytes());
    bench.check(&answer, 413, "too_large", "declared");
}

#[test]
fn a_body_streamed_too_large_is_refused() {
    let bench = Bench::new();
    let mut request = format!("{HEAD}Transfer-Encoding: chunked\r\n\r\n").into_bytes();
    let chunk = vec![b' '; 1 << 20];
    for _ in 0..32 {
        request.extend(b"100000\r\n");
        request.extend(&chunk);
        request.extend(b"\r\n");
    }
    // One byte more, and nothing that the server would leave unread.
    request.extend(b"1\r\n \r\n");
    bench.check(&bench.server.raw(&request), 413, "too_large", "streamed");
    assert_eq!(bench.server.get("/livez").status, 200);
}

#[test]
fn a_body_of_exactly_the_limit_is_read() {
    let bench = Bench::new();
    let limit = springline::core::limits::BODY_BYTES;
    let (_, _, body) = &examples()[0];
    let mut text = body.to_string();
    text.push_str(&" ".repeat(limit - text.len()));
    assert_eq!(bench.server.post("/v1/evaluate", &text).status, 200);
    let answer =
        bench.server.raw(format!("{HEAD}Content-Length: {}\r\n\r\n", limit + 1).as_bytes());
    bench.check(&answer, 413, "too_large", "one byte more");
}

#[test]
fn no_media_type_is_reported_before_the_size() {
    let bench = Bench::new();
    let head = HEAD.replace("application/json", "text/plain");
    let answer =
        bench.server.raw(format!("{head}Content-Length: 999999999999\r\n\r\n{{").as_bytes());
    assert!([413, 415].contains(&answer.status), "{answer:?}");
}

// Not JSON.

#[test]
fn broken_json_is_refused_with_line_and_column() {
    let bench = Bench::new();
    let cases: &[(&str, u64, u64)] = &[
        ("", 1, 1),
        (" \n ", 1, 1),
        ("{", 1, 1),
        ("{\"curve\": {\"family\": \"bez", 1, 25),
        ("{\"curve\":\n{\"control_points\": [[NaN, 0]]}}", 2, 22),
        ("{\"curve\": {\"beta\": Infinity}}", 1, 20),
        ("{\"curve\": {\"beta\": -Infinity}}", 1, 21),
        ("{\"curve\": {\"beta\": .5}}", 1, 20),
        ("{\"curve\": {\"beta\": 01}}", 1, 21),
        ("{\"curve\": {\"beta\": +1}}", 1, 20),
        ("{\"curve\": {\"beta\": 0x1}}", 1, 21),
        ("{'curve': 1}", 1, 2),
        ("{\"curve\": {},}", 1, 14),
        ("// comment\n{}", 1, 1),
        ("{\"curve\": {\"family\": \"\\ud800\"}}", 1, 29),
        ("{\"curve\": {\"family\": \"\\udc00\\ud800\"}}", 1, 28),
        ("{\"\\ud83d\": 1}", 1, 9),
        ("{\"curve\": {\"family\": \"\u{1}\"}}", 1, 23),
        ("\u{feff}{}", 1, 1),
        ("hello", 1, 1),
    ];
    for (text, line, column) in cases {
        let problem = bench.broken(text, "not_json", *line, *column);
        assert!(!problem["detail"].as_str().unwrap().contains("at line"), "{problem}");
    }
}

#[test]
fn what_a_message_quotes_of_the_request_stays_as_it_was() {
    let bench = Bench::new();
    let detail = bench.refuse(
        "/v1/interpolate",
        &with_key(&points(), "", "mapping", json!(1)),
        (400, "unknown_field"),
        "/mapping",
    );
    assert!(detail.contains("`mapping`"), "{detail}");
    let detail = bench.evaluate(
        with(&bezier(), "/family", json!("a sequence of f64")),
        (400, "unknown_variant"),
        "/family",
    );
    assert!(detail.contains("unknown value `a sequence of f64`"), "{detail}");
}

#[test]
fn a_long_value_is_not_echoed_whole() {
    let bench = Bench::new();
    let long = "é".repeat(1_000_000);
    let detail = bench.evaluate(
        with(&bezier(), "/family", json!(long)),
        (400, "unknown_variant"),
        "/family",
    );
    assert!(detail.len() < 2_000 && detail.ends_with("`bspline`"), "{}", detail.len());
    let beta = with_key(&with(&bezier(), "/family", json!("beta-bezier")), "", "beta", json!(long));
    let detail = bench.evaluate(beta, (400, "wrong_type"), "/beta");
    assert!(detail.len() < 2_000 && detail.ends_with("expected a number"), "{}", detail.len());
}

#[test]
fn messages_speak_of_json_and_say_what_to_do() {
    let bench = Bench::new();
    let says = |path: &str, text: &str, words: &[&str]| {
        let detail = bench.server.post(path, text).json()["detail"].as_str().unwrap().to_owned();
        assert!(words.iter().all(|word| detail.contains(word)), "{text}: {detail}");
    };
    says("/v1/evaluate", "", &["empty", "send"]);
    says("/v1/evaluate", "\u{feff}{}", &["byte order mark", "leave it out"]);
    says("/v1/evaluate", "{\"curve\": {\"control_points\": [[NaN, 0]]}}", &["NaN"]);
    says("/v1/evaluate", "{\"curve\": ", &["the body ends"]);
    says("/v1/evaluate", "{\"curve\": {\"beta\": 1e999}}", &["out of range", "1.8e308"]);
    let basis = "{\"points\": [[0, 0], [1, 1]], \"basis\": \"bezier\"}";
    says(
        "/v1/interpolate",
        basis,
        &["the string \"bezier\"", "an object with the fields `family`"],
    );
    says(
        "/v1/interpolate",
        "{\"points\": [[0, 0], [1, 1], [2, 0]], \"bases\": [{\"family\": \"bezier\"}]}",
        &["expected is 2", "`basis`"],
    );
}

#[test]
fn bytes_that_are_not_utf_8_are_refused() {
    let bench = Bench::new();
    bench.broken(b"{\"curve\": {\"family\": \"\xff\xfe\"}}", "not_json", 1, 23);
    let wide: Vec<u8> = "{}".encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert_eq!(bench.server.post("/v1/evaluate", wide).status, 400);
}

#[test]
fn a_number_beyond_a_double_is_refused_where_it_stands() {
    let bench = Bench::new();
    let huge = format!("1{}", "0".repeat(400));
    for number in ["1e999", "-1e999", "1.8e308", &huge] {
        let text = format!(
            "{{\"curve\": {{\"family\": \"bezier\", \"control_points\": [[0, 0], [1, {number}]]}}, \"sampling\": {{\"kind\": \"count\", \"count\": 2}}}}"
        );
        let answer = bench.server.post("/v1/evaluate", &text);
        bench.check(&answer, 400, "number_out_of_range", &text);
        assert_eq!(answer.pointer(), "/curve/control_points/1/1");
    }
}

#[test]
fn anything_but_an_object_is_refused() {
    let bench = Bench::new();
    for path in springline::api::operations::TABLE.iter().map(|entry| entry.path) {
        for body in [json!([]), json!([{}]), json!(1), json!("x"), json!(true), Value::Null] {
            bench.refuse(path, &body, (400, "wrong_type"), "");
        }
        let answer = bench.server.post(path, "{}");
        bench.check(&answer, 400, "missing_field", path);
        assert!(
            answer
                .faults()
                .iter()
                .all(|(pointer, code)| pointer.is_empty() && code == "missing_field"),
            "{}",
            answer.text()
        );
    }
}

#[test]
fn a_key_given_twice_is_refused_in_every_object() {
    let bench = Bench::new();
    for (path, _, body) in examples() {
        for (object, fields) in objects(&body) {
            for key in fields.keys() {
                let text = doubled(&body, &object, key);
                let answer = bench.server.post(path, &text);
                bench.check(&answer, 400, "duplicate_field", &text);
                assert_eq!(answer.pointer(), format!("{object}/{key}"), "{text}");
            }
        }
    }
}

/// The text of a value with a key of one object given twice.
fn doubled(value: &Value, object: &str, key: &str) -> String {
    let twin = value.pointer(object).unwrap()[key].clone();
    let marked = with_key(value, object, "TWIN", twin).to_string();
    marked.replace("\"TWIN\"", &json!(key).to_string())
}

// Sampling.

#[test]
fn parameters_outside_the_domain_are_refused_not_clamped() {
    let bench = Bench::new();
    let li = json!({"family": "alpha-beta-bezier", "alpha": 0.5, "beta": 2, "control_points": [[0, 0], [1, 3], [4, 3], [5, 0]]});
    for (curve, wrong) in [
        (bezier(), 1.000000000000002),
        (bezier(), -1e-15),
        (li, 0.6),
        (piecewise(), 2.5),
        (bspline(), -0.1),
    ] {
        let values = json!({"kind": "parameters", "values": [0, wrong]});
        let detail = bench.refuse(
            "/v1/evaluate",
            &json!({"curve": curve, "sampling": values}),
            OUT_OF_RANGE,
            "/sampling/values/1",
        );
        assert!(detail.contains("domain") && detail.contains("<= t <="), "{detail}");
        let at = json!({"kind": "parameters", "values": [0, wrong]});
        bench.refuse(
            "/v1/subdivide",
            &json!({"curve": curve, "at": at}),
            OUT_OF_RANGE,
            "/at/values/1",
        );
    }
}

#[test]
fn samplings_have_limits() {
    let bench = Bench::new();
    let refuse = |sampling: Value, expected, pointer: &str| {
        bench.refuse(
            "/v1/evaluate",
            &json!({"curve": bezier(), "sampling": sampling}),
            expected,
            pointer,
        );
    };
    for count in [0, 1] {
        refuse(json!({"kind": "count", "count": count}), TOO_FEW, "/sampling/count");
    }
    refuse(json!({"kind": "count", "count": 200_001}), TOO_LARGE, "/sampling/count");
    refuse(
        json!({"kind": "count", "count": 9_007_199_254_740_992_u64}),
        TOO_LARGE,
        "/sampling/count",
    );
    refuse(json!({"kind": "count", "count": -1}), (400, "wrong_type"), "/sampling/count");
    refuse(json!({"kind": "count", "count": 2.5}), (400, "wrong_type"), "/sampling/count");
    refuse(json!({"kind": "parameters", "values": []}), TOO_FEW, "/sampling/values");
    for tolerance in [0.0, -0.0, -1.0] {
        refuse(
            json!({"kind": "tolerance", "tolerance": tolerance}),
            OUT_OF_RANGE,
            "/sampling/tolerance",
        );
    }
    refuse(
        json!({"kind": "tolerance", "tolerance": 1e-300}),
        (422, "tolerance_too_small"),
        "/sampling/tolerance",
    );
    refuse(json!({"kind": "tolerance", "tolerance": 1e-13}), TOO_LARGE, "/sampling/tolerance");
}

#[test]
fn fields_of_another_variant_are_refused_at_the_field() {
    let bench = Bench::new();
    let sampling = json!({"kind": "count", "count": 2, "tolerance": 1});
    bench.refuse(
        "/v1/evaluate",
        &json!({"curve": bezier(), "sampling": sampling}),
        (400, "unknown_field"),
        "/sampling/tolerance",
    );
    bench.evaluate(with_key(&bezier(), "", "beta", json!(1)), (400, "unknown_field"), "/beta");
    bench.evaluate(with_key(&bspline(), "", "order", json!(1)), (400, "unknown_field"), "/order");
    let basis = json!({"family": "beta-bezier", "beta": 1, "alpha": 1});
    bench.evaluate(
        with_key(&piecewise(), "", "bases", json!([basis])),
        (400, "unknown_field"),
        "/bases/0/alpha",
    );
}

#[test]
fn derivatives_and_quantities_have_limits() {
    let bench = Bench::new();
    let request = json!({"curve": bezier(), "sampling": {"kind": "count", "count": 2}});
    let refuse = |key: &str, value: Value, expected, pointer: &str| {
        bench.refuse("/v1/evaluate", &with_key(&request, "", key, value), expected, pointer);
    };
    refuse("derivatives", json!(65), TOO_LARGE, "/derivatives");
    refuse("derivatives", json!(-1), (400, "wrong_type"), "/derivatives");
    refuse("derivatives", json!(1e300), (400, "wrong_type"), "/derivatives");
    refuse("quantities", json!(["tangent", "torsion"]), (422, "unsuitable_curve"), "/quantities/1");
    refuse("quantities", json!(["speed", "Speed"]), (400, "unknown_variant"), "/quantities/1");
    let many = json!({"curve": bezier(), "sampling": {"kind": "count", "count": 200_000}, "derivatives": 5});
    let answer = bench.server.post_json("/v1/evaluate", &many);
    bench.check(&answer, 413, "too_large", "an answer too large");
}

// Curves.

#[test]
fn polygons_need_enough_points_of_one_dimension() {
    let bench = Bench::new();
    let curve = |points: Value| with(&bezier(), "/control_points", points);
    bench.evaluate(curve(json!([])), TOO_FEW, "/control_points");
    bench.evaluate(curve(json!([[0, 0]])), TOO_FEW, "/control_points");
    bench.evaluate(curve(json!([[0, 0], [1, 1, 1]])), (400, "wrong_type"), "/control_points/1");
    bench.evaluate(curve(json!([[0, 0], [1, 1], [2]])), (400, "wrong_type"), "/control_points/2");
    bench.evaluate(curve(json!(vec![[0, 0]; 66])), TOO_LARGE, "/control_points");
}

#[test]
fn shape_parameters_have_ranges() {
    let bench = Bench::new();
    let beta = |key: &str, value: f64| {
        with_key(&with(&bezier(), "/family", json!("beta-bezier")), "", key, json!(value))
    };
    for key in ["beta", "lambda"] {
        for value in [-1.0, -5e-324] {
            let detail = bench.evaluate(beta(key, value), OUT_OF_RANGE, &format!("/{key}"));
            assert!(detail.contains(format!("is {value:?}").trim_end_matches(".0")), "{detail}");
        }
    }
    bench.evaluate(
        with_key(&beta("beta", 1.0), "", "lambda", json!(1)),
        (422, "contradiction"),
        "/lambda",
    );
    bench.evaluate(without_key(&beta("beta", 1.0), "", "beta"), (400, "missing_field"), "");
    let li = with_key(
        &with(&beta("beta", 2.0), "/family", json!("alpha-beta-bezier")),
        "",
        "alpha",
        json!(1),
    );
    for (key, value) in [
        ("alpha", 2.0),
        ("alpha", 0.0),
        ("alpha", -1.0),
        ("beta", 0.0),
        ("beta", 3.0000000000000004),
    ] {
        bench.evaluate(with_key(&li, "", key, json!(value)), OUT_OF_RANGE, &format!("/{key}"));
    }
    for count in [2, 3, 5] {
        bench.evaluate(
            with(&li, "/control_points", json!(vec![[0, 1]; count])),
            WRONG_COUNT,
            "/control_points",
        );
    }
}

#[test]
fn shape_matrices_are_checked_entry_by_entry() {
    let bench = Bench::new();
    let (first, last) = ([1, 0, 0], [0, 0, 1]);
    bench.evaluate(quasi(json!([first, [0.5, 0.6, 0], last]), 3), ROW_SUM, "/shape/rows/1");
    bench.evaluate(quasi(json!([first, [1.5, 0, 0], last]), 3), OUT_OF_RANGE, "/shape/rows/1/0");
    bench.evaluate(quasi(json!([first, [0.5, -0.5, 1], last]), 3), OUT_OF_RANGE, "/shape/rows/1/1");
    bench.evaluate(quasi(json!([first, [0.5, 0.5], last]), 3), WRONG_COUNT, "/shape/rows/1");
    bench.evaluate(quasi(json!([first, last]), 3), WRONG_COUNT, "/shape/rows");
    bench.evaluate(quasi(json!([first, first, last]), 3), (422, "rank_deficient_shape"), "/shape");
    bench.evaluate(quasi(json!([]), 3), TOO_FEW, "/shape/rows");
    bench.evaluate(quasi(json!([[]]), 3), TOO_FEW, "/shape/rows");
    bench.evaluate(quasi(json!([first, [0, 1, 0], last]), 4), WRONG_COUNT, "/control_points");
    let bad = json!({"family": "quasi-bezier", "shape": {"kind": "matrix", "rows": [first, [0, 1, 0], [0.5, 0.6, 0]]}});
    let curve =
        with(&with(&piecewise(), "/bases", json!([{"family": "bezier"}, bad])), "/order", json!(2));
    bench.evaluate(
        with(&curve, "/control_points", json!(vec![[0, 1]; 5])),
        ROW_SUM,
        "/bases/1/shape/rows/2",
    );
}

#[test]
fn the_other_shapes_are_checked_too() {
    let bench = Bench::new();
    let shape = |shape: Value| json!({"family": "quasi-bezier", "shape": shape, "control_points": [[0, 0], [1, 1], [2, 0]]});
    let symmetric = |degree: usize, rows: Value| {
        shape(json!({"kind": "symmetric", "degree": degree, "upper_rows": rows}))
    };
    bench.evaluate(symmetric(1, json!([])), OUT_OF_RANGE, "/shape/degree");
    bench.evaluate(symmetric(65, json!([])), OUT_OF_RANGE, "/shape/degree");
    bench.evaluate(symmetric(4, json!([[0.5, 0.5, 0]])), WRONG_COUNT, "/shape/upper_rows");
    bench.evaluate(symmetric(3, json!([[0.5, 0.6, 0]])), ROW_SUM, "/shape/upper_rows/0");
    bench.evaluate(
        symmetric(4, json!([[0.5, 0.5, 0], [0.5, 0.3, 0.2]])),
        OUT_OF_RANGE,
        "/shape/upper_rows/1/0",
    );
    bench.evaluate(shape(json!({"kind": "elevation", "lambdas": []})), TOO_FEW, "/shape/lambdas");
    bench.evaluate(
        shape(json!({"kind": "elevation", "lambdas": [0, 9]})),
        OUT_OF_RANGE,
        "/shape/lambdas/1",
    );
    bench.evaluate(
        shape(json!({"kind": "elevation", "lambdas": [0, 0, 0]})),
        WRONG_COUNT,
        "/control_points",
    );
    bench.evaluate(
        shape(json!({"kind": "recursive", "seed": [[1, 0], [0.5, 0.6]]})),
        ROW_SUM,
        "/shape/seed/1",
    );
}

#[test]
fn piecewise_curves_must_fit_together() {
    let bench = Bench::new();
    let change = |place: &str, value: Value| with(&piecewise(), place, value);
    bench.evaluate(change("/knots", json!([0, 2, 1])), NOT_INCREASING, "/knots/2");
    bench.evaluate(change("/knots", json!([0, 0, 1])), NOT_INCREASING, "/knots/1");
    bench.evaluate(change("/knots", json!([0])), TOO_FEW, "/knots");
    bench.evaluate(change("/knots", json!([])), TOO_FEW, "/knots");
    bench.evaluate(change("/knots", json!([0, 1, 2, 3])), WRONG_COUNT, "/control_points");
    bench.evaluate(change("/knots", json!([-1e308, 0, 1e308])), OVERFLOW, "/knots");
    bench.evaluate(change("/bases", json!([])), TOO_FEW, "/bases");
    bench.evaluate(
        change("/bases", json!(vec![json!({"family": "bezier"}); 3])),
        WRONG_COUNT,
        "/bases",
    );
    bench.evaluate(change("/order", json!(2)), WRONG_COUNT, "/control_points");
    bench.evaluate(change("/order", json!(0)), OUT_OF_RANGE, "/order");
    bench.evaluate(change("/order", json!(65)), OUT_OF_RANGE, "/order");
    bench.evaluate(
        with_key(&piecewise(), "", "closed", json!(true)),
        (422, "unsuitable_curve"),
        "/control_points/6",
    );
}

#[test]
fn bsplines_need_a_full_knot_vector() {
    let bench = Bench::new();
    let change = |place: &str, value: Value| with(&bspline(), place, value);
    let detail = bench.evaluate(change("/knots", json!([0, 0, 1, 2, 2])), WRONG_COUNT, "/knots");
    assert!(detail.contains('7') && detail.contains("leave out"), "{detail}");
    bench.evaluate(change("/knots", json!([0, 0, 0, 2, 1, 2, 2])), NOT_INCREASING, "/knots/4");
    bench.evaluate(change("/knots", json!([0, 0, 0, 0, 2, 2, 2])), OUT_OF_RANGE, "/knots/3");
    let empty = json!({"family": "bspline", "degree": 1, "knots": [0, 1, 1, 2], "control_points": [[0, 0], [1, 3]]});
    bench.evaluate(empty.clone(), NOT_INCREASING, "/knots/2");
    bench.evaluate(with_key(&empty, "", "closed", json!(true)), NOT_INCREASING, "/knots/2");
    bench.evaluate(change("/degree", json!(0)), OUT_OF_RANGE, "/degree");
    bench.evaluate(change("/degree", json!(65)), OUT_OF_RANGE, "/degree");
    bench.evaluate(change("/degree", json!(4)), TOO_FEW, "/control_points");
    bench.evaluate(
        with_key(&bspline(), "", "closed", json!(true)),
        (422, "unsuitable_curve"),
        "/closed",
    );
}

#[test]
fn coordinates_that_overflow_are_refused_never_null() {
    let bench = Bench::new();
    let wild = json!([[1e308, 1e308], [-1e308, 1e308], [1e308, -1e308], [-1e308, 0]]);
    let requests = [
        (
            "/v1/evaluate",
            json!({"curve": with(&bezier(), "/control_points", wild.clone()), "sampling": {"kind": "count", "count": 3}, "derivatives": 2}),
        ),
        (
            "/v1/to-bspline",
            json!({"curve": with(&bezier(), "/control_points", wild.clone()), "knots": "uniform"}),
        ),
        ("/v1/interpolate", json!({"points": wild})),
    ];
    for (path, body) in requests {
        let answer = bench.server.post_json(path, &body);
        bench.check(&answer, 422, "overflow", path);
    }
}

// Operations.

#[test]
fn cuts_must_increase_and_stay_few() {
    let bench = Bench::new();
    let refuse = |at: Value, expected, pointer: &str| {
        bench.refuse("/v1/subdivide", &json!({"curve": bezier(), "at": at}), expected, pointer);
    };
    refuse(json!({"kind": "parameters", "values": [0.5, 0.5]}), NOT_INCREASING, "/at/values/1");
    refuse(json!({"kind": "parameters", "values": [0.5, 0.25]}), NOT_INCREASING, "/at/values/1");
    refuse(json!({"kind": "depth", "depth": 17}), TOO_LARGE, "/at/depth");
    refuse(json!({"kind": "depth", "depth": 9_007_199_254_740_992_u64}), TOO_LARGE, "/at/depth");
    refuse(json!({"kind": "flatness", "tolerance": 0}), OUT_OF_RANGE, "/at/tolerance");
    refuse(
        json!({"kind": "flatness", "tolerance": 1e-14}),
        (422, "tolerance_too_small"),
        "/at/tolerance",
    );
    let body = json!({"curve": bspline(), "at": {"kind": "depth", "depth": 1}, "form": "family"});
    bench.refuse("/v1/subdivide", &body, (422, "unsuitable_curve"), "/form");
    for lambda in [0.0, -0.0] {
        let straight = json!({"family": "beta-bezier", "lambda": lambda, "control_points": [[0, 0], [1, 1], [2, 0]]});
        let body =
            json!({"curve": straight, "at": {"kind": "depth", "depth": 1}, "form": "family"});
        assert_eq!(bench.server.post_json("/v1/subdivide", &body).pointer(), "/form");
    }
}

#[test]
fn bspline_options_are_checked() {
    let bench = Bench::new();
    let refuse = |curve: Value, key: &str, value: Value, expected| {
        bench.refuse(
            "/v1/to-bspline",
            &json!({"curve": curve, key: value}),
            expected,
            &format!("/{key}"),
        );
    };
    for tolerance in [0.0, 1.0, -1.0] {
        refuse(bezier(), "tolerance", json!(tolerance), OUT_OF_RANGE);
    }
    refuse(bezier(), "knots", json!("periodic"), (422, "unsuitable_curve"));
    refuse(
        with(&piecewise(), "/knots", json!([0, 1, 3])),
        "knots",
        json!("uniform"),
        (422, "unsuitable_curve"),
    );
    refuse(bezier(), "knots", json!("Clamped"), (400, "unknown_variant"));
}

#[test]
fn repeated_points_are_refused_at_the_second_one() {
    let bench = Bench::new();
    let repeated = json!([[0, 0], [1, 2], [1, 2], [5, 1]]);
    for kind in ["chord-length", "centripetal"] {
        let body = json!({"points": repeated, "parameterization": {"kind": kind}});
        let detail = bench.refuse("/v1/interpolate", &body, REPEATED, "/points/2");
        assert!(detail.contains(kind) && detail.contains("remove"), "{detail}");
    }
    bench.refuse("/v1/interpolate", &json!({"points": repeated}), REPEATED, "/points/2");
    let closed = json!({"points": [[0, 0], [1, 2], [5, 1], [0, 0]], "closed": true});
    bench.refuse("/v1/interpolate", &closed, REPEATED, "/points/3");
}

#[test]
fn options_that_contradict_each_other_are_refused() {
    let bench = Bench::new();
    let refuse = |key: &str, value: Value, key2: &str, value2: Value, pointer: &str| {
        bench.refuse(
            "/v1/interpolate",
            &with_key(&with_key(&points(), "", key, value), "", key2, value2),
            CONTRADICTION,
            pointer,
        );
    };
    refuse("closed", json!(true), "start", json!({"kind": "natural"}), "/start");
    refuse("closed", json!(true), "end", json!({"kind": "natural"}), "/end");
    let bezier = json!({"family": "bezier"});
    refuse("basis", bezier.clone(), "bases", json!([bezier, bezier, bezier]), "/bases");
    let both = json!({"family": "beta-bezier", "beta": 1, "lambda": 1});
    bench.refuse(
        "/v1/interpolate",
        &with_key(&points(), "", "basis", both.clone()),
        CONTRADICTION,
        "/basis/lambda",
    );
    bench.refuse(
        "/v1/interpolate",
        &with_key(&points(), "", "bases", json!([bezier, both, bezier])),
        CONTRADICTION,
        "/bases/1/lambda",
    );
}

#[test]
fn interpolation_checks_its_points_knots_and_ends() {
    let bench = Bench::new();
    let refuse = |key: &str, value: Value, expected, pointer: &str| {
        bench.refuse("/v1/interpolate", &with_key(&points(), "", key, value), expected, pointer);
    };
    refuse("points", json!([]), TOO_FEW, "/points");
    refuse("points", json!([[1, 1]]), TOO_FEW, "/points");
    refuse("bases", json!([{"family": "bezier"}, {"family": "bezier"}]), WRONG_COUNT, "/bases");
    refuse(
        "start",
        json!({"kind": "derivative", "vector": [1, 2, 3]}),
        WRONG_COUNT,
        "/start/vector",
    );
    refuse("end", json!({"kind": "derivative"}), (400, "missing_field"), "/end");
    refuse(
        "end",
        json!({"kind": "natural", "vector": [1, 2]}),
        (400, "unknown_field"),
        "/end/vector",
    );
    let knots = |knots: Value| json!({"kind": "knots", "knots": knots});
    refuse("parameterization", knots(json!([0, 1, 2])), WRONG_COUNT, "/parameterization/knots");
    refuse(
        "parameterization",
        knots(json!([0, 1, 1, 2])),
        NOT_INCREASING,
        "/parameterization/knots/2",
    );
    let closed = json!({"points": [[0, 0], [1, 1]], "closed": true});
    bench.refuse("/v1/interpolate", &closed, TOO_FEW, "/points");
    let few = json!({"points": [[0, 0], [1, 1], [2, 0]], "start": {"kind": "not-a-knot"}, "end": {"kind": "not-a-knot"}});
    assert_eq!(bench.server.post_json("/v1/interpolate", &few).status, 422);
    let straight = json!({"family": "beta-bezier", "lambda": 0});
    refuse("basis", straight, (422, "unsuitable_basis"), "/basis");
    refuse(
        "basis",
        json!({"family": "beta-bezier", "beta": 1e12}),
        (422, "ill_conditioned"),
        "/basis",
    );
}

// Several faults at once.

impl Bench {
    /// The places and codes of all faults, after a look at what is said of the request as a whole.
    fn faults(&self, path: &str, text: &str) -> Vec<(String, String)> {
        let answer = self.server.post(path, text);
        let problem = answer.json();
        self.check(&answer, answer.status, problem["code"].as_str().unwrap(), text);
        let faults = answer.faults();
        let lead = faults.iter().any(|(_, code)| problem["code"] == code.as_str());
        assert!(lead, "{problem}");
        faults
    }

    fn expect(&self, path: &str, text: &str, expected: &[(&str, &str)]) -> Value {
        let found = self.faults(path, text);
        let found: Vec<(&str, &str)> =
            found.iter().map(|(pointer, code)| (pointer.as_str(), code.as_str())).collect();
        assert_eq!(found, expected, "{text}");
        self.server.post(path, text).json()
    }
}

#[test]
fn all_faults_of_a_request_are_told_at_once_in_its_order() {
    let bench = Bench::new();
    let text = r#"{
        "sampling": {"kind": "count", "count": 1, "colour": 2},
        "curve": {"family": "beta-bezier", "beta": -1, "control_point": [[0, 0], [1, "x"]], "lamda": true},
        "derivatives": "two"
    }"#;
    let problem = bench.expect(
        "/v1/evaluate",
        text,
        &[
            ("/sampling/count", "too_few"),
            ("/sampling/colour", "unknown_field"),
            ("/curve/beta", "out_of_range"),
            ("/curve/control_point", "unknown_field"),
            ("/curve/lamda", "unknown_field"),
            ("/derivatives", "wrong_type"),
        ],
    );
    // The shape before the mathematics: that is what the request as a whole is refused for.
    assert_eq!(problem["status"], 400);
    let detail = problem["detail"].as_str().unwrap();
    assert!(
        detail.starts_with("/sampling/colour: ") && detail.contains("and 5 more faults"),
        "{detail}"
    );
}

#[test]
fn what_follows_from_another_fault_is_not_told() {
    let bench = Bench::new();
    let sampling = r#""sampling": {"kind": "count", "count": 2}"#;
    for (curve, expected) in [
        // Not that control_points are missing, nor that the knots do not fit them.
        (
            r#"{"family": "bspline", "degree": 2, "knots": [0, 1], "control_point": [[0, 0]]}"#,
            &[("/curve/control_point", "unknown_field")][..],
        ),
        (
            r#"{"family": "bezier", "control_points": [[0, "a"], [1, 1]]}"#,
            &[("/curve/control_points/0/1", "wrong_type")],
        ),
        (
            r#"{"family": "beta-bezier", "lambda": "1", "control_points": [[0, 0], [1, 1]]}"#,
            &[("/curve/lambda", "wrong_type")],
        ),
        (
            r#"{"family": "Bezier", "control_points": [[0, 0], [1, 1]]}"#,
            &[("/curve/family", "unknown_variant")],
        ),
    ] {
        bench.expect("/v1/evaluate", &format!("{{\"curve\": {curve}, {sampling}}}"), expected);
    }
}

#[test]
fn parts_that_are_right_in_shape_are_checked_beside_each_other() {
    let bench = Bench::new();
    let text = r#"{"curve": {"family": "bspline", "degree": 0, "knots": [0, 2, 1], "control_points": [[0, 0], [1, 1]]},
        "at": {"kind": "flatness", "tolerance": 0}}"#;
    let expected = [
        ("/curve/degree", "out_of_range"),
        ("/curve/knots/2", "not_increasing"),
        ("/at/tolerance", "out_of_range"),
    ];
    let problem = bench.expect("/v1/subdivide", text, &expected);
    assert_eq!(problem["status"], 422);
    let text = r#"{"at": {"kind": "parameters", "values": [0, 2, 0.5, -3]}, "curve": {"family": "bezier", "control_points": [[0, 0], [1, 1]]}}"#;
    bench.expect(
        "/v1/subdivide",
        text,
        &[("/at/values/1", "out_of_range"), ("/at/values/3", "out_of_range")],
    );
    let text = r#"{"points": [[0, 0], [1, 1], [2, 0]], "weights": [1, 0, -1],
        "solve": {"kind": "control-points", "basis": {"family": "bezier"}, "order": 1}}"#;
    bench.expect(
        "/v1/fit",
        text,
        &[("/weights/1", "out_of_range"), ("/weights/2", "out_of_range")],
    );
    let text = r#"{"width": 1, "curves": [{"color": 99, "curve": {"family": "alpha-beta-bezier", "alpha": 2, "beta": 9,
        "control_points": [[0, 0], [1, 1], [2, 1], [3, 0]]}}], "height": 2}"#;
    let expected =
        ["/width", "/curves/0/color", "/curves/0/curve/alpha", "/curves/0/curve/beta", "/height"];
    bench.expect("/v1/render", text, &expected.map(|pointer| (pointer, "out_of_range")));
}

#[test]
fn missing_fields_are_all_named_where_their_object_ends() {
    let bench = Bench::new();
    let text =
        r#"{"curve": {"family": "piecewise", "closed": 1}, "quantities": ["speed", "sped"]}"#;
    let problem = bench.expect(
        "/v1/evaluate",
        text,
        &[
            ("/curve/closed", "wrong_type"),
            ("/curve", "missing_field"),
            ("/curve", "missing_field"),
            ("/curve", "missing_field"),
            ("/curve", "missing_field"),
            ("/quantities/1", "unknown_variant"),
            ("", "missing_field"),
        ],
    );
    let details: Vec<&str> = problem["errors"]
        .as_array()
        .unwrap()
        .iter()
        .map(|item| item["detail"].as_str().unwrap())
        .collect();
    for field in ["`bases`", "`order`", "`knots`", "`control_points`", "`sampling`"] {
        assert_eq!(
            details
                .iter()
                .filter(|detail| detail.contains(field) && detail.contains("missing"))
                .count(),
            1,
            "{details:?}"
        );
    }
}

#[test]
fn at_most_twenty_faults_are_listed() {
    let bench = Bench::new();
    for wrong in [21, 100_000] {
        let points = vec!["[0, true]"; wrong].join(",");
        let text = format!("{{\"points\": [{points}]}}");
        let problem = bench.server.post("/v1/interpolate", text).json();
        assert_eq!(problem["errors"].as_array().unwrap().len(), 20);
        assert_eq!(problem["errors"][19]["pointer"], "/points/19/1");
        assert!(
            problem["detail"].as_str().unwrap().contains("more than 19 more"),
            "{}",
            problem["detail"]
        );
    }
}

#[test]
fn names_that_were_probably_meant_are_named() {
    let bench = Bench::new();
    let detail = |path: &str, body: Value| {
        bench.server.post_json(path, &body).json()["errors"][0]["detail"]
            .as_str()
            .unwrap()
            .to_owned()
    };
    let sampling = json!({"kind": "count", "count": 2});
    let curve =
        |curve: Value| detail("/v1/evaluate", json!({"curve": curve, "sampling": sampling}));
    for (found, meant) in [
        (curve(json!({"family": "bezier", "controlPoints": [[0, 0], [1, 1]]})), "`control_points`"),
        (
            curve(json!({"family": "beta_bezier", "beta": 1, "control_points": [[0, 0], [1, 1]]})),
            "`beta-bezier`",
        ),
        (
            curve(
                json!({"family": "b-spline", "degree": 1, "knots": [0, 0, 1, 1], "control_points": [[0, 0], [1, 1]]}),
            ),
            "`bspline`",
        ),
        (
            detail(
                "/v1/interpolate",
                json!({"points": [[0, 0], [1, 1]], "parametrization": {"kind": "uniform"}}),
            ),
            "`parameterization`",
        ),
    ] {
        assert!(found.contains(&format!("did you mean {meant}?")), "{found}");
    }
    let far = curve(json!({"family": "nurbs", "control_points": [[0, 0], [1, 1]]}));
    assert!(!far.contains("did you mean") && far.contains("`bspline`"), "{far}");
    let answer = bench.server.post_as("/v1/evaluate?precison=3", Some("application/json"), "{}");
    assert!(answer.text().contains("did you mean precision?"), "{}", answer.text());
}

#[test]
fn a_name_may_not_be_given_as_an_object() {
    let bench = Bench::new();
    bench.evaluate(
        with(&bezier(), "/family", json!({"bezier": {}})),
        (400, "wrong_type"),
        "/family",
    );
    let null = r#"{"curve": {"family": {"bezier": null}, "control_points": [[0, 0], [1, 1]]}, "sampling": {"kind": "count", "count": 2}}"#;
    bench.expect("/v1/evaluate", null, &[("/curve/family", "wrong_type")]);
}

#[test]
fn a_parameter_that_rounding_took_beyond_an_end_is_the_end() {
    let bench = Bench::new();
    let beyond = f64::from_bits(1.0_f64.to_bits() + 4);
    let values = json!({"kind": "parameters", "values": [-2e-16, 0.5, beyond]});
    let answer = bench.server.ok("/v1/evaluate", &json!({"curve": bezier(), "sampling": values}));
    assert_eq!(answer["parameters"], json!([0.0, 0.5, 1.0]));
    assert_eq!(
        (&answer["points"][0], &answer["points"][2]),
        (&json!([0.0, 0.0]), &json!([5.0, 0.0]))
    );
    let cut = bench.server.ok(
        "/v1/subdivide",
        &json!({"curve": bezier(), "at": {"kind": "parameters", "values": [0.5, beyond]}}),
    );
    assert_eq!(
        (&cut["split_parameters"], &cut["curve"]["knots"]),
        (&json!([0.5, 1.0]), &json!([0.0, 0.5, 1.0]))
    );
    let surface = json!({"u": {"family": "bezier"}, "v": {"family": "bezier"}, "control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]});
    let at = json!({"kind": "parameters", "values": [[beyond, -2e-16]]});
    assert_eq!(
        bench.server.ok("/v1/surfaces/evaluate", &json!({"surface": surface, "at": at}))["parameters"],
        json!([[1.0, 0.0]])
    );
    let cuts = bench
        .server
        .ok("/v1/surfaces/subdivide", &json!({"surface": surface, "at": {"u": [beyond]}}));
    assert_eq!(cuts["pieces"].as_array().unwrap().len(), 1);
    let given = json!({"kind": "parameters", "values": [0, 0.4, 1.0_f64.next_down()]});
    let solve = json!({"kind": "control-points", "basis": {"family": "bezier"}, "order": 1});
    let fit = bench.server.ok(
        "/v1/fit",
        &json!({"points": [[0, 0], [1, 1], [2, 0]], "parameterization": given, "solve": solve}),
    );
    assert_eq!(fit["parameters"], json!([0.0, 0.4, 1.0]));
}

// Hostile requests.

#[test]
fn mutated_examples_get_an_answer_or_a_problem_never_a_fault() {
    const MUTATIONS: u64 = 400; // of each example
    let (bench, hostile, api) = (Bench::new(), hostile(), specification());
    for (number, (path, name, body)) in examples().iter().enumerate() {
        let schema = answer_validator(&api, path);
        for round in 0..MUTATIONS {
            let seed = number as u64 * 1_000_000 + round;
            let mut random = Random(seed);
            let mutated = (0..=round % 3)
                .fold(body.clone(), |value, _| mutate(&value, &mut random, &hostile));
            let answer = bench.server.post_json(path, &mutated);
            well_formed(
                &bench,
                &schema,
                &answer,
                &format!("{name}, seed {seed}: {path} {mutated}"),
            );
        }
    }
}

fn well_formed(bench: &Bench, schema: &jsonschema::Validator, answer: &Answer, what: &str) {
    assert!([200, 400, 413, 415, 422].contains(&answer.status), "{what}: {}", answer.text());
    let json = answer.json();
    if answer.status == 200 {
        assert_valid(schema, &json, what);
        assert!(!has_null(&json), "{what}");
    } else {
        bench.check(answer, answer.status, json["code"].as_str().unwrap(), what);
    }
}

#[test]
fn every_value_of_every_example_may_be_hostile() {
    let (bench, api) = (Bench::new(), specification());
    for (path, name, body) in examples() {
        let schema = answer_validator(&api, path);
        for (place, _) in
            places(&body).into_iter().filter(|(place, _)| near_the_start_of_lists(place))
        {
            for value in hostile() {
                let answer = bench.server.post_json(path, &with(&body, &place, value.clone()));
                well_formed(&bench, &schema, &answer, &format!("{name}: {path} {place} = {value}"));
            }
        }
    }
}
