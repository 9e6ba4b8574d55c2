//! Curves with weights over HTTP: what is taken, what is refused, and what stays as it was.

use crate::support::{Server, examples, with, with_key, without_key};
use serde_json::{Value, json};

fn circle() -> Value {
    let of_circle = |(_, name, _): &(&str, &str, Value)| *name == "circle";
    examples().into_iter().find(of_circle).unwrap().2["curve"].clone()
}

/// Requests that take a curve at `/curve`.
fn requests(curve: &Value) -> Vec<(&'static str, Value)> {
    let basis = json!({"family": "bezier"});
    vec![
        ("/v1/evaluate", json!({"curve": curve, "sampling": {"kind": "count", "count": 5}})),
        ("/v1/subdivide", json!({"curve": curve, "at": {"kind": "depth", "depth": 1}})),
        ("/v1/to-bspline", json!({"curve": curve})),
        ("/v1/convert", json!({"curve": curve, "to": basis})),
        ("/v1/continuity", json!({"curve": curve})),
    ]
}

#[test]
fn wrong_weights_are_refused_at_their_place() {
    let server = Server::start();
    let refused = |weights: Value, pointer: &str, code: &str| {
        let curve = with(&circle(), "/weights", weights);
        for (path, body) in requests(&curve) {
            let answer = server.post_json(path, &body);
            assert_eq!(answer.status, if code == "wrong_type" { 400 } else { 422 }, "{path}");
            assert_eq!(answer.faults(), [(pointer.to_owned(), code.to_owned())], "{path}");
        }
    };
    let of = |place: usize, weight: f64| {
        let mut weights = circle()["weights"].as_array().unwrap().clone();
        weights[place] = json!(weight);
        Value::from(weights)
    };
    refused(of(3, 0.0), "/curve/weights/3", "out_of_range");
    refused(of(3, -1.0), "/curve/weights/3", "out_of_range");
    refused(of(3, 1e-13), "/curve/weights/3", "out_of_range");
    refused(json!([1, 2]), "/curve/weights", "wrong_count");
    refused(json!([]), "/curve/weights", "wrong_count");
    refused(json!("heavy"), "/curve/weights", "wrong_type");
}

#[test]
fn a_closed_curve_has_one_weight_at_its_seam() {
    let server = Server::start();
    let cubic = [[0, 0], [1, 1], [2, 0], [0, 0]];
    let curve = json!({"family": "piecewise", "bases": [{"family": "bezier"}], "order": 3,
        "knots": [0, 1], "control_points": cubic, "closed": true, "weights": [1, 2, 3, 4]});
    let answer = server.post_json("/v1/continuity", &json!({"curve": curve}));
    assert_eq!(answer.faults(), [("/curve/weights/3".into(), "unsuitable_curve".into())]);
    server.ok("/v1/continuity", &json!({"curve": with(&curve, "/weights/3", json!(1))}));
    let answer = server
        .post_json("/v1/continuity", &json!({"curve": with(&circle(), "/weights/8", json!(2))}));
    assert_eq!(answer.faults(), [("/curve/weights".into(), "unsuitable_curve".into())]);
}

#[test]
fn equal_weights_give_the_bytes_of_none() {
    let server = Server::start();
    let plain = without_key(&circle(), "", "weights");
    for weight in [1.0, 0.3, 1e300] {
        let equal = with_key(&plain, "", "weights", json!(vec![weight; 9]));
        for ((path, without), (_, with)) in requests(&plain).into_iter().zip(requests(&equal)) {
            let (a, b) = (server.post_json(path, &without), server.post_json(path, &with));
            assert_eq!((a.status, a.text()), (200, b.text()), "{path}");
        }
    }
}

#[test]
fn the_curve_of_an_answer_is_the_input_of_the_next_call() {
    let server = Server::start();
    let at = |curve: &Value, t: f64| {
        let sampling = json!({"kind": "parameters", "values": [t]});
        let answer = server.ok("/v1/evaluate", &json!({"curve": curve, "sampling": sampling}));
        let p = &answer["points"][0];
        (p[0].as_f64().unwrap(), p[1].as_f64().unwrap())
    };
    let cut = json!({"curve": circle(), "at": {"kind": "depth", "depth": 2}});
    let pieces = server.ok("/v1/subdivide", &cut)["curve"].clone();
    let cubic = json!({"curve": pieces, "to": "bezier", "order": 3});
    let cubic = server.ok("/v1/convert", &cubic)["curve"].clone();
    let whole = server.ok("/v1/to-bspline", &json!({"curve": cubic}))["curve"].clone();
    for curve in [&pieces, &cubic, &whole] {
        assert!(curve["weights"].is_array(), "{curve}");
        for t in [0.0, 0.3, 1.5, 2.75, 4.0] {
            let ((x, y), (u, v)) = (at(curve, t), at(&circle(), t));
            assert!((x - u).hypot(y - v) < 1e-14, "{t}: {x} {y}");
        }
    }
    let segment = json!({"family": "bezier", "control_points": [[1, 0], [1, 1], [0, 1]],
        "weights": [1, std::f64::consts::FRAC_1_SQRT_2, 1]});
    let next = json!({"family": "bezier", "control_points": [[0, 1], [-2, 1], [-2, 0]],
        "weights": [2, 1, 1]});
    let body = json!({"curves": [segment, next], "smoothness": "G1"});
    let joined = server.ok("/v1/join", &body);
    assert!(joined["curve"]["weights"].is_array() && joined["continuity"]["class"] != "C0");
    let bent = json!({"curve": joined["curve"], "basis": {"family": "beta-bezier", "beta": 0.5}});
    assert!(server.ok("/v1/reshape", &bent)["curve"]["weights"].is_array());
}

#[test]
fn what_takes_no_curve_takes_no_weights_of_one() {
    let server = Server::start();
    let body = json!({"points": [[0, 0], [1, 1], [2, 0]], "weights": [1, 2, 1]});
    let answer = server.post_json("/v1/interpolate", &body);
    assert_eq!((answer.status, answer.pointer()), (400, "/weights".into()));
}

#[test]
fn weights_in_a_list_of_curves_are_refused_at_their_place() {
    let server = Server::start();
    let arc = |weights: Value| json!({"family": "bezier", "control_points": [[0, 0], [1, 1], [2, 0]], "weights": weights});
    let curves = json!([arc(json!([1, 2, 1])), arc(json!([0, 2, 1]))]);
    let drawn = json!([{"curve": arc(json!([1, 2, 1]))}, {"curve": arc(json!([0, 2, 1]))}]);
    for (path, body, pointer) in [
        ("/v1/continuity", json!({"curves": curves}), "/curves/1/weights/0"),
        ("/v1/join", json!({"curves": curves, "smoothness": "C0"}), "/curves/1/weights/0"),
        ("/v1/render", json!({"curves": drawn}), "/curves/1/curve/weights/0"),
    ] {
        let answer = server.post_json(path, &body);
        assert_eq!((answer.status, answer.pointer()), (422, pointer.into()), "{path}");
    }
    // And measured where they lie end to end, with weights and without.
    let line = json!({"family": "bezier", "control_points": [[2, 0], [3, -1]]});
    let curves = json!([arc(json!([1, 2, 1])), line]);
    let answer = server.ok("/v1/continuity", &json!({"curves": curves}));
    assert_eq!(answer["continuity"]["joints"][0]["geometric"], "G1");
}
