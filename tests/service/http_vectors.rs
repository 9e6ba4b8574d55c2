//! The reference vectors, exact results rounded once, through the real server.

use crate::support::*;
use serde_json::{Value, json};

fn vectors(name: &str) -> Vec<Value> {
    let path = format!("{}/tests/vectors/{name}.json", env!("CARGO_MANIFEST_DIR"));
    let list: Vec<Value> = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    assert!(list.len() >= 20, "{name}");
    list
}

fn largest(value: &Value) -> f64 {
    numbers(value).into_iter().fold(0.0, |most, number| most.max(number.abs()))
}

/// Each number within `tolerance` times `scale` of the one expected.
fn close(found: &Value, expected: &Value, scale: f64, tolerance: f64, what: &str) {
    let (found, expected) = (numbers(found), numbers(expected));
    assert_eq!(found.len(), expected.len(), "{what}");
    let error = found.iter().zip(&expected).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
    assert!(error <= tolerance * scale, "{what}: error {error:e}, scale {scale:e}");
}

fn count(list: &Value) -> usize {
    list.as_array().unwrap().len()
}

/// The degree of the polynomial: with a shape matrix it exceeds the order of the polygon.
fn degree(vector: &Value) -> usize {
    let (curve, order) = (&vector["curve"], count(&vector["curve"]["control_points"]) - 1);
    let shape = &curve["shape"];
    match shape["kind"].as_str() {
        Some("matrix") => count(&shape["rows"]) - 1,
        Some("symmetric") => shape["degree"].as_u64().unwrap() as usize,
        Some("recursive") => order + count(&shape["seed"]) - count(&shape["seed"][0]),
        Some("elevation") => order + 1,
        _ => order,
    }
}

/// How large a k-th derivative can be: `magnitude * d! / (d - k)! * (2 / length)^k`.
fn derivative_scale(vector: &Value, k: usize) -> f64 {
    let length = numbers(&vector["domain"]).iter().rev().copied().reduce(|b, a| b - a).unwrap();
    let d = degree(vector);
    (0..k).fold(largest(&vector["curve"]["control_points"]), |scale, i| {
        scale * d.saturating_sub(i).max(1) as f64 * 2.0 / length
    })
}

#[test]
fn evaluate() {
    let server = Server::start();
    for (i, vector) in vectors("evaluate").iter().enumerate() {
        let sampling = json!({"kind": "parameters", "values": vector["parameters"]});
        let answer =
            server.ok("/v1/evaluate", &json!({"curve": vector["curve"], "sampling": sampling, "derivatives": vector["derivatives"]}));
        assert_eq!(numbers(&answer["domain"]), numbers(&vector["domain"]));
        for (j, expected) in vector["expected"].as_array().unwrap().iter().enumerate() {
            for (k, expected) in expected.as_array().unwrap().iter().enumerate() {
                let found =
                    if k == 0 { &answer["points"][j] } else { &answer["derivatives"][k - 1][j] };
                close(
                    found,
                    expected,
                    derivative_scale(vector, k),
                    1e-14,
                    &format!("vector {i}, sample {j}, derivative {k}"),
                );
            }
        }
    }
}

#[test]
fn subdivide() {
    let server = Server::start();
    for (i, vector) in vectors("subdivide").iter().enumerate() {
        let at = json!({"kind": "parameters", "values": [vector["at"]]});
        let answer = server
            .ok("/v1/subdivide", &json!({"curve": vector["curve"], "at": at, "form": "bezier"}));
        let scale = largest(&vector["curve"]["control_points"]);
        close(
            &answer["curve"]["control_points"],
            &vector["bezier"],
            scale,
            1e-14,
            &format!("vector {i}"),
        );
    }
}

#[test]
fn to_bspline() {
    let server = Server::start();
    for (i, vector) in vectors("to_bspline").iter().enumerate() {
        for (knots, expected) in [("uniform", "uniform_control_points"), ("clamped", "bezier")] {
            let answer =
                server.ok("/v1/to-bspline", &json!({"curve": vector["curve"], "knots": knots}));
            let scale = largest(&vector["curve"]["control_points"]).max(largest(&vector[expected]));
            close(
                &answer["curve"]["control_points"],
                &vector[expected],
                scale,
                1e-14,
                &format!("vector {i}, {knots}"),
            );
        }
    }
}

fn interpolation(vector: &Value, basis: impl Fn(&Value) -> Value) -> Value {
    let kind = &vector["parameterization"];
    let parameterization = if kind == "knots" {
        json!({"kind": kind, "knots": vector["knots"]})
    } else {
        json!({"kind": kind})
    };
    let bases: Vec<Value> = vector["betas"].as_array().unwrap().iter().map(basis).collect();
    let mut request = json!({"points": vector["points"], "closed": vector["closed"], "bases": bases, "parameterization": parameterization});
    for end in ["start", "end"] {
        if !vector[end].is_null() {
            request[end] = vector[end].clone();
        }
    }
    request
}

/// The control points of segments as a piecewise curve has them: each joint once.
fn joined(segments: &Value) -> Value {
    let later = segments
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|segment| segment.as_array().unwrap()[1..].to_vec());
    Value::Array(std::iter::once(segments[0][0].clone()).chain(later).collect())
}

#[test]
fn interpolate() {
    let server = Server::start();
    for (i, vector) in vectors("interpolate").iter().enumerate() {
        let forms = [("bezier_segments", json!("bezier")), ("beta_segments", json!("beta-bezier"))];
        for (expected, family) in forms {
            let basis = |beta: &Value| {
                if family == "bezier" {
                    json!({"family": family})
                } else {
                    json!({"family": family, "beta": beta})
                }
            };
            let answer = server.ok("/v1/interpolate", &interpolation(vector, basis));
            let expected = joined(&vector[expected]);
            let what = format!("vector {i}, {family}");
            close(
                &answer["curve"]["knots"],
                &vector["knots"],
                largest(&vector["knots"]),
                1e-13,
                &what,
            );
            close(&answer["curve"]["control_points"], &expected, largest(&expected), 1e-13, &what);
            assert_eq!(answer["continuity"]["class"], "C2", "{what}");
        }
    }
}

#[test]
fn fit() {
    let server = Server::start();
    for (i, vector) in vectors("fit").iter().enumerate() {
        let request = json!({
            "points": vector["points"],
            "parameterization": {"kind": "parameters", "values": vector["parameters"]},
            "solve": {"kind": "control-points", "basis": vector["basis"], "order": vector["order"]},
            "ends": vector["ends"],
        });
        let answer = server.ok("/v1/fit", &request);
        let (expected, what) = (&vector["control_points"], format!("vector {i}"));
        close(&answer["curve"]["control_points"], expected, largest(expected), 1e-11, &what);
        for (found, expected) in [("max", "max_error"), ("rms", "rms_error")] {
            close(
                &answer["error"][found],
                &vector[expected],
                largest(&vector["points"]),
                1e-11,
                &what,
            );
        }
    }
}
