//! Surfaces: reference vectors, laws, meshes and errors; through the core and over HTTP.

use std::collections::BTreeSet;

use crate::laws::{any, apart, law, point};
use crate::support::{Server, numbers, with, with_key};
use proptest::prelude::*;
use serde_json::{Value, json};
use springline::core::basis::{AlphaBeta, Basis, Bezier};
use springline::core::context::Context;
use springline::core::point::{Point, magnitude};
use springline::core::subdivide::Form;
use springline::core::surface::{
    Mesh, Places, Surface, SurfaceQuantities, SurfaceSamples, evaluate, subdivide, tessellate,
};

type Net = Vec<Vec<Point<3>>>;

fn net(surface: &Surface) -> Net {
    surface.rows().map(<[_]>::to_vec).collect()
}

fn size(surface: &Surface) -> f64 {
    magnitude(&net(surface).concat())
}

fn grid(surface: &Surface, orders: usize) -> SurfaceSamples {
    evaluate(
        &Context::default(),
        surface,
        &Places::Grid(6, 7),
        orders,
        SurfaceQuantities::default(),
    )
    .unwrap()
}

fn at(surface: &Surface, pairs: &[[f64; 2]]) -> Vec<Point<3>> {
    evaluate(
        &Context::default(),
        surface,
        &Places::Parameters(pairs.to_vec()),
        0,
        SurfaceQuantities::default(),
    )
    .unwrap()
    .points
}

/// A surface of any two families.
fn surface() -> impl Strategy<Value = Surface> {
    (1usize..6, 1usize..6).prop_flat_map(|(m, n)| of(any::basis(m), any::basis(n), m, n))
}

fn of(
    u: impl Strategy<Value = Basis>,
    v: impl Strategy<Value = Basis>,
    m: usize,
    n: usize,
) -> impl Strategy<Value = Surface> {
    (u, v, proptest::collection::vec(any::points::<3>(n + 1), m + 1))
        .prop_map(|(u, v, net)| Surface::new(&Context::default(), u, v, net).unwrap())
}

fn remade(surface: &Surface, map: impl Fn(Point<3>) -> Point<3>) -> Surface {
    let [u, v] = surface.bases().clone();
    Surface::new(
        &Context::default(),
        u,
        v,
        net(surface).into_iter().map(|row| row.into_iter().map(&map).collect()).collect(),
    )
    .unwrap()
}

// ---- reference vectors

/// A list of the answer, what it should be, and the size its errors are measured in.
type Expected = (&'static str, Vec<Point<3>>, f64);

/// The surface of a vector, in the core and in JSON; its pairs; and what is expected of points, du
/// and dv.
type Vector = (Surface, Value, Vec<[f64; 2]>, Vec<Expected>);

fn vectors() -> Vec<Vector> {
    let cases = crate::laws::cases("surface");
    assert_eq!(cases.len(), 6);
    let read = |case: &Value| {
        let (alpha, beta) = (numbers(&case["alpha"]), numbers(&case["beta"]));
        let basis = |i: usize| Basis::AlphaBeta(AlphaBeta::new(alpha[i], beta[i]).unwrap());
        let in_json =
            |i: usize| json!({"family": "alpha-beta-bezier", "alpha": alpha[i], "beta": beta[i]});
        let points: Net =
            case["control_net"].as_array().unwrap().iter().map(crate::laws::points).collect();
        let size = magnitude(&points.concat());
        let samples = case["samples"].as_array().unwrap();
        let list = |name: &str| samples.iter().map(|sample| point(&sample[name])).collect();
        let pairs =
            samples.iter().map(|s| [s["u"].as_f64().unwrap(), s["v"].as_f64().unwrap()]).collect();
        // A first derivative can be degree * 2 / length times as large as the net, as in the
        // vectors of curves.
        let expected = vec![
            ("points", list("point"), size),
            ("du", list("du"), size * 6.0 / alpha[0]),
            ("dv", list("dv"), size * 6.0 / alpha[1]),
        ];
        let body = json!({"u": in_json(0), "v": in_json(1), "control_net": case["control_net"]});
        (
            Surface::new(&Context::default(), basis(0), basis(1), points).unwrap(),
            body,
            pairs,
            expected,
        )
    };
    cases.iter().map(read).collect()
}

#[test]
fn the_core_meets_the_vectors_to_1e_14() {
    for (surface, _, pairs, expected) in vectors() {
        let samples = evaluate(
            &Context::default(),
            &surface,
            &Places::Parameters(pairs),
            1,
            SurfaceQuantities::default(),
        )
        .unwrap();
        let found = [&samples.points, &samples.derivatives[0], &samples.derivatives[1]];
        for (found, (name, expected, scale)) in found.into_iter().zip(&expected) {
            assert!(
                apart(found, expected) <= 1e-14 * scale,
                "{name}: {:e}",
                apart(found, expected) / scale
            );
        }
    }
}

#[test]
fn the_service_meets_the_vectors_to_1e_14() {
    let server = Server::start();
    for (_, surface, pairs, expected) in vectors() {
        let body = json!({"surface": surface, "at": {"kind": "parameters", "values": pairs}, "derivatives": 1});
        let answer = server.ok("/v1/surfaces/evaluate", &body);
        for (name, expected, scale) in expected {
            assert!(
                apart(&crate::laws::points(&answer[name]), &expected) <= 1e-14 * scale,
                "{name}"
            );
        }
        assert!(
            answer.get("duu").is_none()
                && answer.get("normal").is_none()
                && answer.get("degenerate").is_none()
        );
    }
}

// ---- laws

#[test]
fn corners_are_control_points() {
    law(80, surface(), |surface| {
        let [(a, b), (c, d)] = surface.domain();
        let points = net(&surface);
        let [m, n] = surface.orders();
        assert_eq!(
            at(&surface, &[[a, c], [a, d], [b, c], [b, d]]),
            [points[0][0], points[0][n], points[m][0], points[m][n]]
        );
    });
}

#[test]
fn a_constant_net_is_one_point() {
    law(60, (surface(), any::point()), |(surface, place)| {
        let samples = grid(&remade(&surface, |_| place), 2);
        assert!(samples.points.iter().all(|p| p.distance(place) < 1e-14 * 10.0));
    });
}

#[test]
fn surfaces_move_with_their_nets_under_affine_maps() {
    law(
        60,
        (surface(), [any::point::<3>(), any::point(), any::point(), any::point()]),
        |(surface, [x, y, z, origin])| {
            let map = |p: Point<3>| origin + x * p[0] + y * p[1] + z * p[2];
            let moved = grid(&remade(&surface, map), 0).points;
            let expected: Vec<_> = grid(&surface, 0).points.into_iter().map(map).collect();
            assert!(apart(&moved, &expected) < 1e-11);
        },
    );
}

#[test]
fn a_transposed_net_exchanges_u_and_v() {
    law(60, surface(), |surface| {
        let ([u, v], points) = (surface.bases().clone(), net(&surface));
        let columns =
            (0..points[0].len()).map(|j| points.iter().map(|row| row[j]).collect()).collect();
        let other = Surface::new(&Context::default(), v, u, columns).unwrap();
        let (one, swap) = (grid(&surface, 2), |pairs: &[[f64; 2]]| {
            pairs.iter().map(|[u, v]| [*v, *u]).collect::<Vec<_>>()
        });
        let two = evaluate(
            &Context::default(),
            &other,
            &Places::Parameters(swap(&one.parameters)),
            2,
            SurfaceQuantities::default(),
        )
        .unwrap();
        assert!(apart(&one.points, &two.points) < 1e-13 * size(&surface));
        for (k, l) in [(0, 1), (1, 0), (2, 4), (3, 3), (4, 2)] {
            let scale = magnitude(&one.derivatives[k]) + size(&surface);
            assert!(apart(&one.derivatives[k], &two.derivatives[l]) < 1e-11 * scale);
        }
    });
}

#[test]
fn pieces_run_over_the_same_surface_in_every_form() {
    let cubic = of(any::cubic_with_way_back(), any::cubic_with_way_back(), 3, 3);
    law(50, (cubic, [0.1..0.4, 0.6..0.9, 0.2..0.8]), |(surface, [first, second, third])| {
        let [(_, b), (_, d)] = surface.domain();
        for form in [Form::Auto, Form::Family, Form::Bezier] {
            let pieces = match subdivide(
                &Context::default(),
                &surface,
                &[first * b, second * b],
                &[third * d],
                form,
            ) {
                Ok(pieces) => pieces,
                Err(error) => {
                    assert_eq!((form, error.place.to_string().as_str()), (Form::Family, "/form"));
                    continue;
                }
            };
            assert_eq!(pieces.pieces.len(), 6);
            assert!(pieces.in_family || form != Form::Family);
            for piece in &pieces.pieces {
                let own = grid(&piece.surface, 0);
                let along = |axis: usize, t: f64| {
                    let ((a, b), (_, length)) = (piece.domain[axis], piece.surface.domain()[axis]);
                    (a + (b - a) * (t / length)).min(b)
                };
                let pairs: Vec<_> =
                    own.parameters.iter().map(|&[u, v]| [along(0, u), along(1, v)]).collect();
                assert!(
                    apart(&own.points, &at(&surface, &pairs))
                        < 1e-13 * pieces.condition * size(&surface)
                );
            }
        }
    });
}

#[test]
fn flat_surfaces_have_no_gaussian_curvature() {
    let all = SurfaceQuantities { normal: true, mean_curvature: true, gaussian_curvature: true };
    // A cylinder over a curve: ruled, its tangent plane constant along each ruling. Mean curvature
    // is half that of the curve.
    law(40, (any::basis(3), any::point::<2>()), |(basis, bump)| {
        let curve = [[0.0, 0.0], [1.0, bump[0]], [2.0, bump[1]], [3.0, 0.0]];
        let rows = curve.map(|[x, z]| vec![Point([x, 0.0, z]), Point([x, 5.0, z])]).to_vec();
        let surface =
            Surface::new(&Context::default(), basis, Basis::Bezier(Bezier), rows).unwrap();
        let samples = evaluate(&Context::default(), &surface, &Places::Grid(5, 5), 0, all).unwrap();
        for i in (0..25).filter(|i| !samples.degenerate.contains(i)) {
            assert!(
                samples.gaussian_curvatures[i].abs()
                    <= 1e-12 * (1.0 + samples.mean_curvatures[i].powi(2))
            );
            assert!(samples.normals[i][1].abs() < 1e-13);
        }
    });
    let plane = Surface::new(
        &Context::default(),
        Basis::Bezier(Bezier),
        Basis::Bezier(Bezier),
        rectangle(),
    )
    .unwrap();
    let samples = evaluate(&Context::default(), &plane, &Places::Grid(3, 3), 0, all).unwrap();
    assert_eq!(
        (samples.gaussian_curvatures, samples.mean_curvatures),
        (vec![0.0; 9], vec![0.0; 9])
    );
}

fn rectangle() -> Net {
    vec![
        vec![Point([0.0, 0.0, 1.0]), Point([0.0, 2.0, 1.0])],
        vec![Point([3.0, 0.0, 1.0]), Point([3.0, 2.0, 1.0])],
    ]
}

#[test]
fn curvature_scales_with_the_surface_at_any_size() {
    let all = SurfaceQuantities { normal: true, mean_curvature: true, gaussian_curvature: true };
    let rows: Net = (0..3)
        .map(|i| {
            (0..3).map(|j| Point([i as f64, j as f64, (i * j) as f64 + (i * i) as f64])).collect()
        })
        .collect();
    let measured = |exponent: i32| {
        let surface = Surface::new(
            &Context::default(),
            Basis::Bezier(Bezier),
            Basis::Bezier(Bezier),
            rows.clone(),
        )
        .unwrap();
        let scale = 2f64.powi(exponent);
        evaluate(&Context::default(), &remade(&surface, |p| p * scale), &Places::Grid(3, 3), 0, all)
            .unwrap()
    };
    let one = measured(0);
    for exponent in [-500, 400] {
        let other = measured(exponent);
        assert!(other.degenerate.is_empty(), "2^{exponent}");
        assert!(apart(&one.normals, &other.normals) < 1e-15);
        let ratio = other.mean_curvatures[4] * 2f64.powi(exponent) / one.mean_curvatures[4];
        assert!((ratio - 1.0).abs() < 1e-14, "2^{exponent}: {ratio}");
    }
}

#[test]
fn pieces_whose_conditions_multiply_beyond_8_digits_are_bezier() {
    let stiff = || Basis::Beta(springline::core::basis::Beta::from_beta(100.0).unwrap());
    let cubic = |i: usize| (0..4).map(|j| Point([i as f64, j as f64, (i * j) as f64])).collect();
    let surface =
        Surface::new(&Context::default(), stiff(), stiff(), (0..4).map(cubic).collect()).unwrap();
    let each = stiff().way_back(&Context::default(), 3).unwrap().condition;
    let both = subdivide(&Context::default(), &surface, &[0.5], &[0.5], Form::Auto).unwrap();
    assert_eq!(both.in_family, each * each <= 1e8, "{each:e}");
}

// ---- meshes

/// The largest distance between mesh and surface at equal parameters, on a fine lattice of each
/// triangle.
fn deviation(surface: &Surface, mesh: &Mesh) -> f64 {
    const FINE: usize = 5;
    let lattice: Vec<[f64; 3]> = (0..=FINE)
        .flat_map(|i| {
            (0..=FINE - i).map(move |j| [i, j, FINE - i - j].map(|x| x as f64 / FINE as f64))
        })
        .collect();
    let [(_, b), (_, d)] = surface.domain();
    let mut worst: f64 = 0.0;
    for triangle in &mesh.triangles {
        let mixed =
            |w: &[f64; 3]| (0..3).fold(Point::ZERO, |sum, k| sum + mesh.points[triangle[k]] * w[k]);
        let pair = |w: &[f64; 3]| {
            let [u, v] = [0, 1]
                .map(|axis| (0..3).map(|k| mesh.parameters[triangle[k]][axis] * w[k]).sum::<f64>());
            [u.min(b), v.min(d)]
        };
        let (flat, pairs): (Vec<_>, Vec<_>) = lattice.iter().map(|w| (mixed(w), pair(w))).unzip();
        worst = worst.max(apart(&flat, &at(surface, &pairs)));
    }
    worst
}

#[test]
fn meshes_stay_within_their_bound_and_the_bound_within_the_tolerance() {
    law(25, (surface(), 0.5..5.0), |(surface, tolerance)| {
        let mesh = tessellate(&Context::default(), &surface, tolerance).unwrap();
        assert!(mesh.bound <= tolerance);
        assert!(deviation(&surface, &mesh) <= mesh.bound + 1e-12);
        assert_eq!(mesh.points, at(&surface, &mesh.parameters));
    });
}

#[test]
fn meshes_are_disks_whose_triangles_face_the_normal() {
    law(25, surface(), |surface| {
        let mesh = tessellate(&Context::default(), &surface, 1.0).unwrap();
        let [m, n] = mesh.cells;
        assert_eq!((mesh.points.len(), mesh.triangles.len()), ((m + 1) * (n + 1), 2 * m * n));
        let directed: BTreeSet<_> =
            mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
        // Each side is used once in each direction at most: neighbours share vertices and agree on
        // the orientation.
        assert_eq!(directed.len(), 3 * mesh.triangles.len());
        let edges: BTreeSet<_> = directed.iter().map(|&(a, b)| (a.min(b), a.max(b))).collect();
        assert_eq!(
            mesh.points.len() + mesh.triangles.len(),
            edges.len() + 1,
            "Euler characteristic"
        );
        let used: BTreeSet<_> = mesh.triangles.iter().flatten().copied().collect();
        assert_eq!(used.len(), mesh.points.len());
        for [a, b, c] in mesh.triangles.iter().map(|corners| corners.map(|i| mesh.parameters[i])) {
            // Counter-clockwise in the plane of (u, v) is counter-clockwise seen from du x dv.
            assert!((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0);
        }
    });
}

#[test]
fn opposite_edges_that_coincide_share_their_vertices() {
    let closed = surface().prop_map(|surface| {
        let ([u, v], mut points) = (surface.bases().clone(), net(&surface));
        let last = points.len() - 1;
        points[last] = points[0].clone();
        Surface::new(&Context::default(), u, v, points).unwrap()
    });
    law(40, closed, |surface| {
        let mesh = tessellate(&Context::default(), &surface, 0.5).unwrap();
        let row = mesh.cells[1] + 1;
        assert_eq!(mesh.points[..row], mesh.points[mesh.points.len() - row..]);
    });
}

#[test]
fn flat_directions_take_one_cell_and_no_mesh_is_finer_than_it_needs() {
    let bezier = || Basis::Bezier(Bezier);
    assert_eq!(
        tessellate(
            &Context::default(),
            &Surface::new(&Context::default(), bezier(), bezier(), rectangle()).unwrap(),
            1e-3
        )
        .unwrap()
        .cells,
        [1, 1]
    );
    // A parabola with second derivative 8, extruded: 8 / (8 m^2) <= 0.01 takes 10 cells.
    let arch = [[0.0, 0.0], [1.0, -4.0], [2.0, 0.0]]
        .map(|[x, z]| vec![Point([x, 0.0, z]), Point([x, 1.0, z])]);
    let mut bent = arch.to_vec();
    bent.iter_mut().flatten().for_each(|p| p[2] *= 0.5);
    let surface = Surface::new(&Context::default(), bezier(), bezier(), bent).unwrap();
    assert_eq!(tessellate(&Context::default(), &surface, 0.0100001).unwrap().cells, [10, 1]);
}

// ---- over HTTP

const CODES: [(u16, &str); 5] = [
    (422, "wrong_count"),
    (422, "too_few"),
    (422, "out_of_range"),
    (413, "too_large"),
    (400, "wrong_type"),
];

fn example() -> Value {
    let net: Vec<Vec<[usize; 3]>> =
        (0..4).map(|i| (0..4).map(|j| [i, j, (i * j) % 3]).collect()).collect();
    json!({"u": {"family": "alpha-beta-bezier", "alpha": 0.5, "beta": 1}, "v": {"family": "bezier"}, "control_net": net})
}

#[test]
fn every_error_names_its_place() {
    let server = Server::start();
    let [count, few, range, large, shape] = CODES;
    let refuse = |path: &str, body: Value, (status, code): (u16, &str), pointer: &str| {
        let answer = server.post_json(&format!("/v1/surfaces/{path}"), &body);
        assert_eq!(
            (answer.status, answer.json()["code"].as_str().unwrap()),
            (status, code),
            "{body}: {}",
            answer.text()
        );
        assert_eq!(answer.pointer(), pointer, "{}", answer.text());
        answer.json()["detail"].as_str().unwrap().to_owned()
    };
    let sample = json!({"surface": example(), "at": {"kind": "grid", "u": 2, "v": 2}});
    let evaluate = |pointer: &str, value: Value, expected, place: &str| {
        refuse("evaluate", with(&sample, pointer, value), expected, place)
    };
    let net = "/surface/control_net";
    evaluate(&format!("{net}/2"), json!([[0, 0, 0], [1, 1, 1]]), count, "/surface/control_net/2");
    let flat = server
        .post_json("/v1/surfaces/evaluate", &with(&sample, net, json!(vec![vec![[0, 0]; 4]; 4])))
        .json();
    let rows: Vec<&str> = flat["errors"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| row["pointer"].as_str().unwrap())
        .collect();
    assert_eq!(rows, [0, 1, 2, 3].map(|row| format!("{net}/{row}")));
    assert!(flat["errors"][0]["detail"].as_str().unwrap().contains("3D"), "{flat}");
    evaluate(net, json!([[[0, 0, 0], [1, 1, 1]]]), few, net);
    evaluate(net, json!([[[0, 0, 0]], [[1, 1, 1]]]), few, "/surface/control_net/0");
    evaluate(net, json!([[], []]), few, "/surface/control_net/0");
    evaluate("/at", json!({"kind": "grid", "u": 1, "v": 2}), few, "/at/u");
    evaluate("/at", json!({"kind": "grid", "u": 1000, "v": 1000}), large, "/at");
    evaluate("/at", json!({"kind": "parameters", "values": []}), few, "/at/values");
    let pairs = |pair: Value| json!({"kind": "parameters", "values": [[0, 0], pair]});
    assert!(
        evaluate("/at", pairs(json!([0.6, 0.5])), range, "/at/values/1/0")
            .contains("surface's domain, 0.0 <= u <= 0.5")
    );
    evaluate("/at", pairs(json!([0.5, -0.1])), range, "/at/values/1/1");
    evaluate("/at", pairs(json!([0.5])), shape, "/at/values/1");
    evaluate("/at", pairs(json!([0.5, 0.5, 0.5])), shape, "/at/values/1");
    refuse("evaluate", with_key(&sample, "", "derivatives", json!(3)), range, "/derivatives");
    let cut = |at: Value| json!({"surface": example(), "at": at});
    refuse("subdivide", cut(json!({"u": [0.6]})), range, "/at/u/0");
    refuse("subdivide", cut(json!({"v": [0.5, 0.5]})), (422, "not_increasing"), "/at/v/1");
    let mesh = |tolerance: f64| json!({"surface": example(), "tolerance": tolerance});
    refuse("tessellate", mesh(0.0), range, "/tolerance");
    refuse("tessellate", mesh(1e-12), large, "/tolerance");
    refuse("tessellate", mesh(1e-16), (422, "tolerance_too_small"), "/tolerance");
}

#[test]
fn a_piece_goes_back_in() {
    let server = Server::start();
    let body = json!({"surface": example(), "at": {"u": [0.25]}, "form": "family"});
    let answer = server.ok("/v1/surfaces/subdivide", &body);
    assert_eq!(answer["pieces"][1]["domain"], json!({"u": [0.25, 0.5], "v": [0.0, 1.0]}));
    let piece = &answer["pieces"][1]["surface"];
    assert_eq!(piece["u"], json!({"family": "alpha-beta-bezier", "alpha": 0.5, "beta": 1.0}));
    let mesh = server.ok("/v1/surfaces/tessellate", &json!({"surface": piece, "tolerance": 0.05}));
    assert_eq!(mesh["tolerance"], 0.05);
    assert!(
        mesh["bound"].as_f64().unwrap() <= 0.05
            && !mesh["triangles"].as_array().unwrap().is_empty()
    );
}

// ---- weights

/// A sixteenth of a torus: a quarter turn of a quarter of a circle.
fn torus() -> Value {
    let arc = [1.0, 0.5_f64.sqrt(), 1.0];
    let weights = arc.map(|a| arc.map(|b| a * b));
    json!({"u": {"family": "bezier"}, "v": {"family": "bezier"}, "weights": weights, "control_net": [
        [[4, 0, 0], [4, 4, 0], [0, 4, 0]], [[4, 0, 1], [4, 4, 1], [0, 4, 1]],
        [[3, 0, 1], [3, 3, 1], [0, 3, 1]],
    ]})
}

#[test]
fn a_wrong_weight_is_refused_at_its_row_and_column() {
    let server = Server::start();
    let refuse = |weights: Value, code: &str, pointers: &[&str]| {
        let surface = with_key(&torus(), "", "weights", weights);
        for (path, rest) in [
            ("surfaces/evaluate", json!({"at": {"kind": "grid", "u": 2, "v": 2}})),
            ("surfaces/subdivide", json!({"at": {"u": [0.5]}})),
            ("surfaces/tessellate", json!({"tolerance": 0.1})),
        ] {
            let body = with_key(&rest, "", "surface", surface.clone());
            let answer = server.post_json(&format!("/v1/{path}"), &body);
            assert_eq!(answer.status, 422, "{}", answer.text());
            let answer = answer.json();
            let errors = answer["errors"].as_array().unwrap();
            let found: Vec<_> = errors.iter().map(|e| e["pointer"].as_str().unwrap()).collect();
            let expected: Vec<_> = pointers.iter().map(|p| format!("/surface{p}")).collect();
            assert_eq!(
                (answer["code"].as_str(), found),
                (Some(code), expected.iter().map(String::as_str).collect())
            );
        }
    };
    refuse(
        json!([[1, 1, 1], [1, -1, 0], [1, 1, 1]]),
        "out_of_range",
        &["/weights/1/1", "/weights/1/2"],
    );
    refuse(json!([[1, 1, 1], [1, 1, 1], [1e-12, 1, 1.5]]), "out_of_range", &["/weights/2/0"]);
    refuse(json!([[1, 1, 1], [1, 1, 1]]), "wrong_count", &["/weights"]);
    refuse(json!([[1, 1, 1], [1, 1], [1, 1, 1]]), "wrong_count", &["/weights/1"]);
    refuse(json!([[], [], []]), "wrong_count", &["/weights/0", "/weights/1", "/weights/2"]);
}

#[test]
fn a_wrong_net_does_not_hide_a_wrong_weight() {
    let server = Server::start();
    let weights = json!([[1, 1, 1], [1, 1, 0], [1, 1, 1]]);
    let surface = with_key(&torus(), "", "weights", weights);
    let flat = json!([
        [[0, 0], [1, 1], [2, 2]],
        [[0, 0, 0], [1, 1, 1], [2, 2, 2]],
        [[0, 0, 0], [1, 1, 1], [2, 2, 3]]
    ]);
    let surface = with(&surface, "/control_net", flat);
    let body = json!({"surface": surface, "tolerance": 0.1});
    let answer = server.post_json("/v1/surfaces/tessellate", &body).json();
    let pointers: Vec<_> =
        answer["errors"].as_array().unwrap().iter().map(|e| &e["pointer"]).collect();
    assert_eq!(pointers, ["/surface/control_net/0", "/surface/weights/1/2"]);
}

#[test]
fn equal_weights_give_the_bytes_that_none_give() {
    let server = Server::start();
    let plain = example();
    let equal = with_key(&plain, "", "weights", json!(vec![vec![0.7; 4]; 4]));
    for (path, rest) in [
        (
            "surfaces/evaluate",
            json!({"at": {"kind": "grid", "u": 9, "v": 9}, "derivatives": 2, "quantities": ["normal"]}),
        ),
        ("surfaces/subdivide", json!({"at": {"u": [0.25], "v": [0.5]}})),
        ("surfaces/tessellate", json!({"tolerance": 0.01})),
    ] {
        let answer = |surface: &Value| {
            server
                .post_json(&format!("/v1/{path}"), &with_key(&rest, "", "surface", surface.clone()))
                .text()
        };
        assert_eq!(answer(&equal), answer(&plain), "{path}");
        assert_ne!(answer(&with(&equal, "/weights/1/1", json!(0.5))), answer(&plain), "{path}");
    }
}

#[test]
fn a_rational_piece_goes_back_in_and_is_drawn() {
    let server = Server::start();
    let whole = torus();
    let cut = json!({"surface": whole, "at": {"u": [0.5], "v": [0.25]}});
    let answer = server.ok("/v1/surfaces/subdivide", &cut);
    assert_eq!(answer["pieces"].as_array().unwrap().len(), 4);
    for piece in answer["pieces"].as_array().unwrap() {
        let surface = &piece["surface"];
        assert!(numbers(&surface["weights"][1]).iter().all(|&w| w > 0.0 && w <= 1.0), "{surface}");
        let at = json!({"kind": "grid", "u": 5, "v": 5});
        let samples = server.ok("/v1/surfaces/evaluate", &json!({"surface": surface, "at": at}));
        for p in crate::laws::points::<3>(&samples["points"]) {
            assert!(((p[0].hypot(p[1]) - 3.0).hypot(p[2]) - 1.0).abs() <= 2e-15, "{p:?}");
        }
    }
    let picture = |surface: &Value| {
        server.post_json("/v1/render", &json!({"surfaces": [{"surface": surface}]})).text()
    };
    let flatter = with(&whole, "/weights/1/1", json!(1e-3));
    assert_ne!(picture(&flatter), picture(&whole));
    assert!(picture(&whole).starts_with("<svg"), "{}", picture(&whole));
}
