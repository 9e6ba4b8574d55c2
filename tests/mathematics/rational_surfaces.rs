//! Surfaces with weights against closed forms: a torus and a sphere, pieces of them, and meshes
//! at weights far apart.

use springline::core::basis::{AlphaBeta, Basis, Beta, Bezier};
use springline::core::context::Context;
use springline::core::fault::Fault;
use springline::core::point::Point;
use springline::core::subdivide::Form;
use springline::core::surface::{
    Places, Surface, SurfaceQuantities, SurfaceSamples, evaluate, net_weights, subdivide,
    tessellate,
};

type Net = Vec<Vec<Point<3>>>;

const ALL: SurfaceQuantities =
    SurfaceQuantities { normal: true, mean_curvature: true, gaussian_curvature: true };

fn bezier() -> Basis {
    Basis::Bezier(Bezier)
}

fn surface(bases: [Basis; 2], net: Net, weights: Vec<Vec<f64>>) -> Surface {
    let weights = net_weights(weights, net.len(), net[0].len()).unwrap();
    let [u, v] = bases;
    Surface::new(&Context::default(), u, v, net).unwrap().with_weights(weights).unwrap()
}

/// A quarter turn of three control points of a quarter of a circle.
fn turned(profile: [[f64; 2]; 3], moved: Point<3>) -> Surface {
    let turn = |[x, z]: [f64; 2]| [[x, 0.0, z], [x, x, z], [0.0, x, z]].map(|p| moved + Point(p));
    let net = profile.map(|p| turn(p).to_vec()).to_vec();
    let arc = [1.0, 0.5_f64.sqrt(), 1.0];
    // Halves are exact: the product of the roots is not.
    let weight = |i: usize, j: usize| if (i, j) == (1, 1) { 0.5 } else { arc[i] * arc[j] };
    let weights = (0..3).map(|i| (0..3).map(|j| weight(i, j)).collect()).collect();
    surface([bezier(), bezier()], net, weights)
}

/// Around z at distance 3, with a tube of radius 1.
fn torus(moved: Point<3>) -> Surface {
    turned([[4.0, 0.0], [4.0, 1.0], [3.0, 1.0]], moved)
}

/// Of radius 1; the last row is the pole.
fn sphere() -> Surface {
    turned([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], Point::ZERO)
}

fn sampled(surface: &Surface, places: &Places, orders: usize) -> SurfaceSamples {
    evaluate(&Context::default(), surface, places, orders, ALL).unwrap()
}

fn at(surface: &Surface, pairs: Vec<[f64; 2]>) -> Vec<Point<3>> {
    sampled(surface, &Places::Parameters(pairs), 0).points
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|x| if x.is_nan() { f64::INFINITY } else { x.abs() }).fold(0.0, f64::max)
}

#[test]
fn a_torus_keeps_its_radius_and_its_curvatures() {
    let samples = sampled(&torus(Point::ZERO), &Places::Grid(300, 300), 0);
    let ring = |p: &Point<3>| p[0].hypot(p[1]);
    let off = largest(samples.points.iter().map(|p| (ring(p) - 3.0).hypot(p[2]) - 1.0));
    assert!(off <= 4e-16 * 4.0, "{off:e}");
    assert!(samples.degenerate.is_empty());
    let (mut gaussian, mut mean): (f64, f64) = (0.0, 0.0);
    for (i, p) in samples.points.iter().enumerate() {
        let cosine = ring(p) - 3.0;
        let k = cosine / (3.0 + cosine);
        let h = (3.0 + 2.0 * cosine) / (2.0 * (3.0 + cosine));
        gaussian = gaussian.max((samples.gaussian_curvatures[i] - k).abs());
        mean = mean.max((samples.mean_curvatures[i].abs() - h).abs());
    }
    assert!(gaussian <= 2e-15 && mean <= 2e-15, "{gaussian:e} {mean:e}");
}

#[test]
fn a_sphere_has_its_curvatures_up_to_the_pole() {
    let samples = sampled(&sphere(), &Places::Grid(301, 301), 2);
    let off = largest(samples.points.iter().map(|p| p.norm() - 1.0));
    assert!(off <= 5e-16, "{off:e}");
    // The last row is the pole, and nothing else has no normal.
    assert_eq!(samples.degenerate, (300 * 301..301 * 301).collect::<Vec<_>>());
    let sign = samples.normals[0].dot(samples.points[0]).signum();
    let off = |rows: std::ops::Range<usize>| {
        let places = || rows.start * 301..rows.end * 301;
        [
            largest(places().map(|i| samples.gaussian_curvatures[i] - 1.0)),
            largest(places().map(|i| samples.mean_curvatures[i] + sign)),
            largest(places().map(|i| samples.normals[i].distance(samples.points[i] * sign))),
        ]
    };
    // Next to the pole, S_v is a hundredth as long, and so has fewer digits.
    let (regular, near) = (off(0..270), off(270..300));
    assert!(regular[0] <= 1e-14 && regular[1] <= 5e-15 && regular[2] <= 1e-15, "{regular:?}");
    assert!(near[0] <= 6e-12 && near[1] <= 3e-12 && near[2] <= 2e-14, "{near:?}");
}

#[test]
fn partial_derivatives_are_those_of_the_quotient() {
    // (u, v, u v) / (1 + u + 2 v), whose weights are linear.
    let net = vec![
        vec![Point([0.0; 3]), Point([0.0, 1.0 / 3.0, 0.0])],
        vec![Point([0.5, 0.0, 0.0]), Point([0.25, 0.25, 0.25])],
    ];
    let surface = surface([bezier(), bezier()], net, vec![vec![1.0, 3.0], vec![2.0, 4.0]]);
    let samples = sampled(&surface, &Places::Grid(9, 9), 2);
    for (i, &[u, v]) in samples.parameters.iter().enumerate() {
        let d = 1.0 + u + 2.0 * v;
        let expected = [
            [u / d, v / d, u * v / d],
            [(1.0 + 2.0 * v) / d.powi(2), -v / d.powi(2), v * (1.0 + 2.0 * v) / d.powi(2)],
            [-2.0 * u / d.powi(2), (1.0 + u) / d.powi(2), u * (1.0 + u) / d.powi(2)],
            [
                -2.0 * (1.0 + 2.0 * v) / d.powi(3),
                2.0 * v / d.powi(3),
                -2.0 * v * (1.0 + 2.0 * v) / d.powi(3),
            ],
            [
                (2.0 * d - 4.0 * (1.0 + 2.0 * v)) / d.powi(3),
                (4.0 * v - d) / d.powi(3),
                ((1.0 + 4.0 * v) * d - 4.0 * v * (1.0 + 2.0 * v)) / d.powi(3),
            ],
            [8.0 * u / d.powi(3), -4.0 * (1.0 + u) / d.powi(3), -4.0 * u * (1.0 + u) / d.powi(3)],
        ];
        let found = std::iter::once(&samples.points).chain(&samples.derivatives);
        for (list, expected) in found.zip(expected) {
            let off = list[i].distance(Point(expected));
            assert!(off <= 4e-15, "{u} {v}: {off:e} {:?} {expected:?}", list[i]);
        }
    }
}

#[test]
fn far_away_a_torus_is_as_round() {
    // Half the digits of the place are left for its shape, and no more are lost.
    let far = Point([2f64.powi(26), -(2f64.powi(26)), 2f64.powi(27)]);
    let (near, moved) = (torus(Point::ZERO), torus(far));
    let places = Places::Grid(40, 40);
    let (near, moved) = (sampled(&near, &places, 0), sampled(&moved, &places, 0));
    let apart = near.points.iter().zip(&moved.points).map(|(&p, &q)| (far + p).distance(q));
    assert!(largest(apart) <= 2f64.powi(-26), "a unit in the last place of the largest coordinate");
    let pairs = near.gaussian_curvatures.iter().zip(&moved.gaussian_curvatures);
    let bent = largest(pairs.map(|(k, l)| k - l));
    assert!(bent <= 2e-15, "{bent:e}");
}

#[test]
fn pieces_run_over_the_same_surface_with_weights_of_their_own() {
    let mixed = [Basis::Beta(Beta::from_beta(3.0).unwrap()), bezier()];
    let net = torus(Point::ZERO).rows().map(<[_]>::to_vec).collect();
    let weights = vec![vec![1.0, 0.5, 2.0], vec![3.0, 1.0, 1.5], vec![1.0, 2.0, 0.25]];
    let mixed = surface(mixed, net, weights);
    for whole in [torus(Point::ZERO), sphere(), mixed] {
        for form in [Form::Auto, Form::Family, Form::Bezier] {
            let pieces =
                subdivide(&Context::default(), &whole, &[0.25, 0.875], &[0.5], form).unwrap();
            assert_eq!((pieces.pieces.len(), pieces.in_family), (6, form != Form::Bezier));
            for piece in &pieces.pieces {
                assert!(piece.surface.weights().is_some());
                let own = sampled(&piece.surface, &Places::Grid(7, 7), 0);
                let [(a, b), (c, d)] = piece.domain;
                let pair = |&[u, v]: &[f64; 2]| [a + (b - a) * u, c + (d - c) * v];
                let there = at(&whole, own.parameters.iter().map(pair).collect());
                let apart = largest(own.points.iter().zip(&there).map(|(p, &q)| p.distance(q)));
                assert!(apart <= 4e-15 * pieces.condition, "{form:?}: {apart:e}");
            }
        }
    }
}

#[test]
fn a_piece_without_positive_weights_in_its_family_is_bezier() {
    let basis = || Basis::AlphaBeta(AlphaBeta::new(0.25, 0.43).unwrap());
    let net: Net = (0..4)
        .map(|i| (0..2).map(|j| Point([i as f64, j as f64, (i * j % 3) as f64])).collect())
        .collect();
    let weights = [1e-3, 1.0, 1.0, 1.0].map(|w| vec![w, w]).to_vec();
    let whole = surface([basis(), bezier()], net, weights);
    let cut = |form| subdivide(&Context::default(), &whole, &[0.225], &[], form);
    let refused = cut(Form::Family).unwrap_err();
    assert_eq!(refused.place.to_string(), "/form");
    assert!(refused.fault.to_string().contains("a weight that is not positive"), "{refused}");
    let pieces = cut(Form::Auto).unwrap();
    assert!(!pieces.in_family);
    for piece in &pieces.pieces {
        let own = sampled(&piece.surface, &Places::Grid(9, 3), 0);
        let [(a, b), _] = piece.domain;
        let there = own.parameters.iter().map(|&[u, v]| [a + (b - a) * u, v]).collect();
        let there = at(&whole, there);
        let apart = largest(own.points.iter().zip(&there).map(|(p, &q)| p.distance(q)));
        assert!(apart <= 2e-15, "{apart:e}");
    }
}

#[test]
fn equal_weights_are_none_and_a_common_factor_changes_nothing() {
    let torus = torus(Point::ZERO);
    let net: Net = torus.rows().map(<[_]>::to_vec).collect();
    let equal = surface([bezier(), bezier()], net.clone(), vec![vec![0.3; 3]; 3]);
    assert!(equal.weights().is_none());
    let weights: Vec<Vec<f64>> = torus.weights().unwrap().map(<[_]>::to_vec).collect();
    for exponent in [-1000, -40, 900] {
        let scale = |w: &f64| w * 2f64.powi(exponent);
        let scaled = weights.iter().map(|row| row.iter().map(scale).collect()).collect();
        let other = surface([bezier(), bezier()], net.clone(), scaled);
        let places = Places::Grid(5, 5);
        assert_eq!(sampled(&torus, &places, 2), sampled(&other, &places, 2), "2^{exponent}");
    }
}

/// Numbers in [0, 1) that look like any.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / 2f64.powi(53)
    }
}

/// The largest distance between mesh and surface at equal parameters, at random places of every
/// triangle, 10^5 at least.
fn deviation(surface: &Surface, tolerance: f64, numbers: &mut Numbers) -> (f64, f64, [usize; 2]) {
    let mesh = tessellate(&Context::default(), surface, tolerance).unwrap();
    assert!(mesh.bound <= tolerance);
    assert_eq!(mesh.points, at(surface, mesh.parameters.clone()));
    let each = 100_000usize.div_ceil(mesh.triangles.len());
    let (mut pairs, mut flat) = (Vec::new(), Vec::new());
    for corners in &mesh.triangles {
        for _ in 0..each {
            let (mut a, mut b) = (numbers.next(), numbers.next());
            if a + b > 1.0 {
                (a, b) = (1.0 - a, 1.0 - b);
            }
            let shares = [1.0 - a - b, a, b];
            let mixed = |axis: usize| -> f64 {
                (0..3).map(|k| mesh.parameters[corners[k]][axis] * shares[k]).sum()
            };
            pairs.push([mixed(0).min(1.0), mixed(1).min(1.0)]);
            flat.push((0..3).fold(Point::ZERO, |sum, k| sum + mesh.points[corners[k]] * shares[k]));
        }
    }
    let mut worst = 0.0;
    for (pairs, flat) in pairs.chunks(100_000).zip(flat.chunks(100_000)) {
        let exact = at(surface, pairs.to_vec());
        worst = largest(exact.iter().zip(flat).map(|(p, &q)| p.distance(q)).chain([worst]));
    }
    (worst, mesh.bound, mesh.cells)
}

#[test]
fn meshes_stay_within_their_bound_at_weights_from_1e_minus_6_to_1e6() {
    let mut numbers = Numbers(7);
    for case in 0..8 {
        let (m, n) = ([1, 2, 3, 4][case % 4], [2, 3, 1][case % 3]);
        let range = [1.0, 6.0, 2.0, 6.0, 3.0, 6.0, 6.0, 6.0][case];
        let mut row = |m: usize, f: &mut dyn FnMut(&mut Numbers) -> f64| -> Vec<f64> {
            (0..=m).map(|_| f(&mut numbers)).collect()
        };
        let weights: Vec<Vec<f64>> =
            (0..=m).map(|_| row(n, &mut |x| 10f64.powf(range * (2.0 * x.next() - 1.0)))).collect();
        let net: Net = (0..=m)
            .map(|i| {
                let heights = row(n, &mut Numbers::next);
                (0..=n).map(|j| Point([i as f64, j as f64, 2.0 * heights[j]])).collect()
            })
            .collect();
        let surface = surface([bezier(), bezier()], net, weights);
        let (worst, bound, cells) = deviation(&surface, 0.125, &mut numbers);
        // Where weights are far apart the bound says little less than for any other surface.
        assert!(worst <= bound && bound <= 3.1 * worst, "{case}: {worst} {bound} {cells:?}");
    }
}

#[test]
fn the_bound_of_a_mesh_is_near_what_is_found() {
    let mut numbers = Numbers(3);
    for (surface, tolerance) in [(torus(Point::ZERO), 1e-3), (sphere(), 1e-3), (sphere(), 1e-5)] {
        let (worst, bound, cells) = deviation(&surface, tolerance, &mut numbers);
        assert!(worst <= bound && bound <= 2.0 * worst, "{cells:?}: {worst:e} {bound:e}");
    }
}

/// All weights from one end of the range to the other, side by side.
#[test]
fn a_mesh_holds_at_the_largest_ratio_of_weights() {
    let mut numbers = Numbers(11);
    let ends = |i: usize| if i.is_multiple_of(2) { 1e-6 } else { 1e6 };
    for turned in [false, true] {
        let weight = |i: usize, j: usize| ends(if turned { i + j } else { i });
        let weights = (0..3).map(|i| (0..3).map(|j| weight(i, j)).collect()).collect();
        let height = |i: usize, j: usize| ((i + 2 * j) % 3) as f64;
        let point = |i: usize, j: usize| Point([i as f64, j as f64, height(i, j)]);
        let net = (0..3).map(|i| (0..3).map(|j| point(i, j)).collect()).collect();
        let surface = surface([bezier(), bezier()], net, weights);
        let (worst, bound, cells) = deviation(&surface, 0.25, &mut numbers);
        assert!(worst <= bound && bound <= 3.1 * worst, "{worst} {bound} {cells:?}");
    }
}

#[test]
fn a_twist_counts_in_the_bound_of_a_mesh() {
    let net = vec![
        vec![Point([0.0; 3]), Point([0.0, 1.0, 0.0])],
        vec![Point([1.0, 0.0, 0.0]), Point([1.0, 1.0, 1.0])],
    ];
    let saddle = surface([bezier(), bezier()], net, vec![vec![1.0, 1.0], vec![1.0, 1.0 + 1e-9]]);
    let mesh = |tolerance| tessellate(&Context::default(), &saddle, tolerance).unwrap();
    let (coarse, fine) = (mesh(0.2500001), mesh(0.2499999));
    assert_eq!((coarse.cells, fine.cells), ([1, 1], [2, 2]));
    assert!((coarse.bound - 0.25).abs() <= 1e-8 && (fine.bound - 0.0625).abs() <= 1e-8);
}

#[test]
fn a_mesh_beyond_the_range_of_doubles_is_refused() {
    let net = [-1.7e308, 1.7e308].map(|x| vec![Point([x, 0.0, 0.0]), Point([x, 1.7e308, 1.0])]);
    let wide = surface([bezier(), bezier()], net.to_vec(), vec![vec![1.0, 1.0], vec![1.0, 2.0]]);
    let refused = tessellate(&Context::default(), &wide, 1e300).unwrap_err();
    assert_eq!(refused.fault, Fault::Overflow);
}
