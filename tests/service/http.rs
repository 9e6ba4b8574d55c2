//! The service from outside: examples, round trips, the command line, health, docs.

use std::collections::BTreeSet;

use crate::support::*;
use serde_json::{Value, json};

#[test]
fn every_example_succeeds_with_an_answer_of_its_schema() {
    let (server, api) = (Server::start(), specification());
    for (path, name, body) in examples() {
        let answer = server.post_json(path, &body);
        assert_eq!(
            (answer.status, answer.header("content-type")),
            (200, media_type(path)),
            "{path} {name}: {}",
            answer.text()
        );
        assert_valid(&answer_validator(&api, path), &answer.json(), name);
        assert!(!has_null(&answer.json()), "{name}");
    }
}

#[test]
fn the_same_request_gets_the_same_bytes() {
    let (first, second) = (Server::start(), Server::start());
    for (path, name, body) in examples() {
        let bytes = first.post_json(path, &body).body;
        assert_eq!(bytes, first.post_json(path, &body).body, "{name}, asked again");
        assert_eq!(bytes, second.post_json(path, &body).body, "{name}, another process");
    }
}

#[test]
fn every_curve_returned_is_accepted_again_and_is_the_same_curve() {
    let server = Server::start();
    for (path, name, body) in examples() {
        let answer = server.ok(path, &body);
        let Some(curve) = answer.get("curve") else { continue };
        let sampled = server.ok(
            "/v1/evaluate",
            &json!({"curve": curve, "sampling": {"kind": "count", "count": 3}}),
        );
        let start = &curve["control_points"][0];
        if curve["family"] != "bspline" {
            assert_eq!(
                numbers(&sampled["points"][0]),
                numbers(start),
                "{name} starts at its first control point"
            );
            let echoed = server
                .ok("/v1/subdivide", &json!({"curve": curve, "at": {"kind": "depth", "depth": 0}}))
                ["curve"]
                .take();
            let single = std::slice::from_ref(curve);
            let exact = curve["bases"]
                .as_array()
                .map_or(single, Vec::as_slice)
                .iter()
                .all(|basis| basis["family"] == "bezier");
            if echoed["order"] == curve["order"]
                || curve["family"] != "piecewise" && curve["family"] != "quasi-bezier"
            {
                close(
                    &numbers(&echoed["control_points"]),
                    &numbers(&curve["control_points"]),
                    if exact { 0.0 } else { 1e-13 },
                );
            }
        }
    }
}

fn close(found: &[f64], expected: &[f64], tolerance: f64) {
    let scale = expected.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    let near = found.len() == expected.len()
        && found.iter().zip(expected).all(|(x, y)| (x - y).abs() <= tolerance * scale);
    assert!(near, "{found:?} {expected:?}");
}

/// Doubles whose shortest text is long, or that a careless reader or writer gets wrong by a bit.
const AWKWARD: [f64; 14] = [
    0.1,
    -0.0,
    1.0 / 3.0,
    5e-324,
    2.225073858507201e-308,
    2.2250738585072014e-308,
    9007199254740993.0,
    0.30000000000000004,
    1.7976931348623157e300,
    -123456789.12345679,
    7.205759403792794e16,
    1e23,
    8.41e21,
    2.220446049250313e-16,
];

fn same_bits(left: &[f64], right: &[f64]) {
    let bits = |list: &[f64]| list.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(left), bits(right), "{left:?} {right:?}");
}

#[test]
fn doubles_make_the_round_trip_exactly() {
    let server = Server::start();
    let awkward =
        AWKWARD.iter().chain(&[f64::MAX / 16.0, f64::EPSILON]).copied().collect::<Vec<_>>();
    let points: Vec<_> = awkward.chunks(2).map(|pair| pair.to_vec()).collect();
    let curve = json!({"family": "bezier", "control_points": points});
    let answer =
        server.ok("/v1/subdivide", &json!({"curve": curve, "at": {"kind": "depth", "depth": 0}}));
    same_bits(&numbers(&answer["curve"]["control_points"]), &awkward);
}

#[test]
fn parameters_and_tolerances_are_echoed_exactly() {
    let server = Server::start();
    let curve = json!({"family": "bezier", "control_points": [[0, 0], [1, 1]]});
    let inside: Vec<f64> =
        AWKWARD.into_iter().filter(|value| (0.0..=1.0).contains(value)).collect();
    let answer = server.ok(
        "/v1/evaluate",
        &json!({"curve": curve, "sampling": {"kind": "parameters", "values": inside}}),
    );
    same_bits(&numbers(&answer["parameters"]), &inside);
    let answer = server.ok("/v1/evaluate", &json!({"curve": curve, "sampling": {"kind": "tolerance", "tolerance": 0.30000000000000004}}));
    same_bits(&numbers(&answer["tolerance"]), &[0.30000000000000004]);
}

#[test]
fn knots_are_echoed_exactly() {
    let server = Server::start();
    let knots = [-1e23, 5e-324, 0.1, 0.30000000000000004, 9007199254740993.0];
    let points = json!([[0, 0], [1, 2], [3, 3], [5, 1], [6, 0]]);
    let request = json!({"points": points, "parameterization": {"kind": "knots", "knots": [0.1, 0.2, 0.30000000000000004, 1, 2]}});
    let answer = server.ok("/v1/interpolate", &request);
    same_bits(&numbers(&answer["curve"]["knots"]), &[0.1, 0.2, 0.30000000000000004, 1.0, 2.0]);
    let curve = json!({"family": "piecewise", "bases": [{"family": "bezier"}], "order": 1, "knots": knots, "control_points": points});
    let answer =
        server.ok("/v1/subdivide", &json!({"curve": curve, "at": {"kind": "depth", "depth": 0}}));
    same_bits(&numbers(&answer["curve"]["knots"]), &knots);
}

#[test]
fn spelling_of_a_request_does_not_matter() {
    let server = Server::start();
    for (path, name, body) in examples() {
        let plain = server.post_json(path, &body).body;
        let pretty = format!("\r\n\t {}\n ", serde_json::to_string_pretty(&body).unwrap());
        assert_eq!(plain, server.post(path, pretty).body, "{name}");
        for media_type in ["application/json; charset=utf-8", "Application/JSON"] {
            assert_eq!(
                plain,
                server.post_as(path, Some(media_type), body.to_string()).body,
                "{name} as {media_type}"
            );
        }
    }
}

#[test]
fn the_greeting_names_the_real_port() {
    let server = Server::start();
    let port: u16 = server.address.rsplit_once(':').unwrap().1.parse().unwrap();
    assert_ne!(port, 0);
    assert!(server.greeting.starts_with("springline "), "{}", server.greeting);
    assert_eq!(server.get("/livez").status, 200);
}

#[test]
fn the_listen_address_comes_from_the_environment_too_and_a_flag_wins() {
    let mut command = binary();
    command.env("SPRINGLINE_LISTEN", "127.0.0.2:0");
    let server = Server::run(command);
    assert!(server.address.starts_with("127.0.0.2:"), "{}", server.address);
    assert_eq!(server.get("/livez").status, 200);
    let mut command = binary();
    command.args(["serve", "--listen", "127.0.0.3:0"]).env("SPRINGLINE_LISTEN", "127.0.0.2:0");
    assert!(Server::run(command).address.starts_with("127.0.0.3:"));
}

#[test]
fn a_bad_listen_address_is_refused_at_the_start() {
    let output = binary().args(["serve", "--listen", "nowhere"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("--listen"));
    let taken = Server::start();
    let output = binary().args(["serve", "--listen", &taken.address]).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains(&taken.address));
}

#[test]
fn the_command_line_prints_the_specification() {
    let output = binary().arg("openapi").output().unwrap();
    assert!(output.status.success());
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(printed, specification());
    assert_eq!(printed, Server::start().get("/openapi.json").json());
}

#[cfg(unix)]
#[test]
fn sigterm_and_sigint_end_the_process_with_success() {
    for signal in ["TERM", "INT"] {
        let mut server = Server::start();
        assert_eq!(server.get("/livez").status, 200);
        server.signal(signal);
        assert_eq!(server.wait().code(), Some(0), "{signal}");
    }
}

#[test]
fn health_answers_json_of_its_schema() {
    let (server, api) = (Server::start(), specification());
    for path in ["/livez", "/readyz"] {
        let answer = server.get(path);
        assert_eq!((answer.status, answer.header("content-type")), (200, "application/json"));
        let schema =
            &api["paths"][path]["get"]["responses"]["200"]["content"]["application/json"]["schema"];
        assert_valid(&validator(&api, schema), &answer.json(), path);
        assert_eq!(server.method("HEAD", path).status, 200);
    }
}

#[test]
fn every_answer_forbids_sniffing() {
    let server = Server::start();
    for path in ["/livez", "/docs/", "/openapi.json", "/nothing"] {
        assert_eq!(server.get(path).header("x-content-type-options"), "nosniff", "{path}");
    }
}

#[test]
fn the_docs_load_only_files_of_this_server() {
    let server = Server::start();
    let redirect = server.get("/docs");
    assert!(redirect.status == 200 || redirect.header("location") == "/docs/", "{redirect:?}");
    let page = server.get("/docs/");
    assert_eq!(page.status, 200);
    assert!(page.header("content-type").starts_with("text/html"));
    let files = references(&page.text());
    assert!(files.len() >= 4, "{files:?}");
    for file in &files {
        assert!(!file.contains("//") && !file.starts_with('/'), "{file} is not relative");
        let answer = server.get(&format!("/docs/{}", file.trim_start_matches("./")));
        assert_eq!(answer.status, 200, "{file}");
        assert!(!file.ends_with(".css") || !answer.text().contains("url(http"), "{file}");
    }
    let script = server.get("/docs/swagger-initializer.js").text();
    assert!(script.contains("/openapi.json") && !script.contains("petstore"), "{script}");
}

/// What a page's `src` and `href` attributes name.
fn references(page: &str) -> BTreeSet<String> {
    let of = |attribute: &str| {
        page.split(attribute)
            .skip(1)
            .filter_map(|rest| rest.split('"').next())
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    [of("src=\""), of("href=\"")].concat().into_iter().collect()
}

#[test]
fn the_specification_is_served_as_json() {
    let answer = Server::start().get("/openapi.json");
    assert_eq!((answer.status, answer.header("content-type")), (200, "application/json"));
    assert_eq!(answer.json(), specification());
}
