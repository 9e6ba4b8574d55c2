//! Points, partial derivatives, normals and curvatures of a surface.

use super::rational::project_partials;
use super::{Direction, Patch, RationalPatch, Shape, Surface};
use crate::core::argument::Argument;
use crate::core::bezier_form::derivative_size;
use crate::core::check::{at_least, at_most};
use crate::core::context::Context;
use crate::core::error::{Error, Locate, both, every};
use crate::core::fault::Fault;
use crate::core::homogeneous::weight;
use crate::core::point::Point;

/// Where to sample.
#[derive(Debug, Clone, PartialEq)]
pub enum Places {
    /// So many equally spaced values of `u` and of `v`, ends included, each with each: `u` changes
    /// slowest.
    Grid(usize, usize),
    /// At these pairs.
    Parameters(Vec<[f64; 2]>),
}

/// What to compute besides points and partial derivatives.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SurfaceQuantities {
    /// The unit normal, `S_u x S_v` scaled.
    pub normal: bool,
    /// The mean curvature: positive where the surface bends towards its normal.
    pub mean_curvature: bool,
    /// The Gaussian curvature.
    pub gaussian_curvature: bool,
}

/// Samples; every list has one entry for each pair of parameters.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SurfaceSamples {
    /// The pairs.
    pub parameters: Vec<[f64; 2]>,
    /// The points.
    pub points: Vec<Point<3>>,
    /// The partial derivatives asked for, in the order u, v, uu, uv, vv.
    pub derivatives: Vec<Vec<Point<3>>>,
    /// Unit normals; zero where undefined.
    pub normals: Vec<Point<3>>,
    /// Mean curvatures; 0 where undefined.
    pub mean_curvatures: Vec<f64>,
    /// Gaussian curvatures; 0 where undefined.
    pub gaussian_curvatures: Vec<f64>,
    /// The samples at which `S_u` and `S_v` are parallel or vanish, within rounding: no normal, no
    /// curvature.
    pub degenerate: Vec<usize>,
}

/// The patches of the surface and its partial derivatives: itself, u, v, uu, uv, vv.
fn jets<const D: usize>(patch: &Patch<D>, orders: usize) -> Vec<Patch<D>> {
    let mut jets = vec![patch.clone()];
    if orders >= 1 {
        jets.extend([patch.derivative(Direction::U), patch.derivative(Direction::V)]);
    }
    if orders >= 2 {
        let (u, v) = (jets[1].clone(), jets[2].clone());
        jets.extend([
            u.derivative(Direction::U),
            u.derivative(Direction::V),
            v.derivative(Direction::V),
        ]);
    }
    jets
}

/// Samples a surface. O(samples * degree_u * degree_v).
///
/// # Errors
/// At `at`: counts below 2, parameters outside the domain, more samples than the limits. At
/// `derivatives`: above 2.
///
/// ```
/// use springline::core::basis::{Basis, Bezier};
/// use springline::core::context::Context;
/// use springline::core::point::Point;
/// use springline::core::surface::{Places, Surface, SurfaceQuantities, evaluate};
///
/// let context = Context::default();
/// // The saddle z = x y over the unit square.
/// let net = vec![
///     vec![Point([0.0, 0.0, 0.0]), Point([0.0, 1.0, 0.0])],
///     vec![Point([1.0, 0.0, 0.0]), Point([1.0, 1.0, 1.0])],
/// ];
/// let saddle = Surface::new(&context, Basis::Bezier(Bezier), Basis::Bezier(Bezier), net)?;
/// let places = Places::Parameters(vec![[0.0, 0.0], [0.5, 0.5]]);
/// let wanted = SurfaceQuantities { gaussian_curvature: true, ..Default::default() };
/// let samples = evaluate(&context, &saddle, &places, 0, wanted)?;
/// assert_eq!(samples.points[1], Point([0.5, 0.5, 0.25]));
/// assert_eq!(samples.gaussian_curvatures[0], -1.0);
/// # Ok::<_, springline::core::error::Error>(())
/// ```
pub fn evaluate(
    context: &Context,
    surface: &Surface,
    places: &Places,
    orders: usize,
    wanted: SurfaceQuantities,
) -> Result<SurfaceSamples, Error> {
    check_orders(orders).at(Argument::Derivatives)?;
    places.check(context).at(Argument::Places)?;
    let shape = surface.shape();
    let pairs = pairs(shape.domain(), places).at(Argument::Places)?;
    let asked = [1, 3, 6][orders] + usize::from(wanted.normal);
    at_most(
        "points and vectors in the answer",
        pairs.len() * asked,
        context.limits.answer_points,
        "Ask for fewer samples",
    )
    .at(Argument::Places)?;
    let needed = match wanted {
        SurfaceQuantities { mean_curvature: true, .. }
        | SurfaceQuantities { gaussian_curvature: true, .. } => 2,
        SurfaceQuantities { normal: true, .. } => 1,
        _ => orders,
    };
    let mut partials = match &shape {
        Shape::Polynomial(patch) => Partials {
            lists: sampled(context, patch, needed.max(orders), &pairs)?,
            sizes: sizes(patch, patch.magnitude()),
            weights: Vec::new(),
        },
        Shape::Rational(rational) => {
            Partials::projected(context, rational, needed.max(orders), &pairs)?
        }
    };
    let mut samples = SurfaceSamples::default();
    if wanted != SurfaceQuantities::default() {
        let mut pace = context.pace();
        for i in 0..pairs.len() {
            pace.step()?;
            samples.push(i, &partials.frame(i), wanted);
        }
    }
    samples.parameters = pairs;
    let kept = [1, 3, 6][orders];
    partials.lists.truncate(kept);
    samples.derivatives = partials.lists.split_off(1);
    samples.points = partials.lists.swap_remove(0);
    Ok(samples)
}

/// The patch and its partial derivatives at these parameters, one list for each.
fn sampled<const D: usize>(
    context: &Context,
    patch: &Patch<D>,
    orders: usize,
    pairs: &[[f64; 2]],
) -> Result<Vec<Vec<Point<D>>>, Error> {
    let at = |jet: &Patch<D>, &[u, v]: &[f64; 2]| {
        jet.combine(&jet.weights(Direction::U, u), &jet.weights(Direction::V, v))
    };
    let jets = jets(patch, orders);
    jets.iter().map(|jet| context.collect(pairs.iter().map(|pair| at(jet, pair)))).collect()
}

/// Points and partial derivatives of a surface at many places.
struct Partials {
    /// Itself, u, v, uu, uv, vv, as far as they are needed.
    lists: Vec<Vec<Point<3>>>,
    /// How large `S_u` and `S_v` can be, times the weight at the place.
    sizes: [f64; 2],
    /// The weight at each place; none without weights.
    weights: Vec<f64>,
}

impl Partials {
    fn projected(
        context: &Context,
        rational: &RationalPatch,
        orders: usize,
        pairs: &[[f64; 2]],
    ) -> Result<Self, Error> {
        let lifted = sampled(context, &rational.patch, orders, pairs)?;
        let mut lists = vec![Vec::with_capacity(pairs.len()); lifted.len()];
        let mut pace = context.pace();
        let mut here = [Point::ZERO; 6];
        for i in 0..pairs.len() {
            pace.step()?;
            here.iter_mut().zip(&lifted).for_each(|(here, list)| *here = list[i]);
            let found = project_partials(&here[..lifted.len()]);
            lists.iter_mut().zip(found).for_each(|(list, p)| list.push(p));
        }
        lists[0] = lifted[0].iter().map(|&h| rational.placed(h)).collect();
        let weights = lifted[0].iter().map(|&h| weight(h)).collect();
        Ok(Partials { lists, sizes: sizes(&rational.patch, rational.magnitude()), weights })
    }

    fn frame(&self, i: usize) -> TangentFrame {
        let weight = self.weights.get(i).copied().unwrap_or(1.0);
        let derivative = |k: usize| self.lists.get(k).map_or(Point::ZERO, |list| list[i]);
        TangentFrame::new(derivative, self.sizes.map(|size| size / weight))
    }
}

/// How large `S_u` and `S_v` can be for points of this size: rounding errors are measured in it.
fn sizes<const D: usize>(patch: &Patch<D>, size: f64) -> [f64; 2] {
    [0, 1].map(|axis| {
        let (a, b) = patch.domain()[axis];
        derivative_size(size, patch.degrees()[axis], 1, b - a)
    })
}

/// Refuses derivatives that are not computed.
///
/// # Errors
/// [`Fault::OutOfRange`].
pub fn check_orders(orders: usize) -> Result<(), Fault> {
    if orders <= 2 {
        return Ok(());
    }
    Err(Fault::OutOfRange {
        what: "derivatives",
        value: orders as f64,
        allowed: "0, 1 or 2".into(),
    })
}

impl Places {
    /// What can be wrong with them whatever the surface.
    ///
    /// # Errors
    /// Counts out of range, each at its field.
    pub fn check(&self, context: &Context) -> Result<(), Error> {
        let few = |count| {
            at_most("samples", count, context.limits.samples, "Sample the surface in parts")
        };
        match self {
            Places::Grid(rows, columns) => {
                both(
                    at_least("samples", *rows, 2).at(Argument::U),
                    at_least("samples", *columns, 2).at(Argument::V),
                )?;
                Ok(few(rows.saturating_mul(*columns))?)
            }
            Places::Parameters(pairs) => at_least("parameters", pairs.len(), 1)
                .and_then(|()| few(pairs.len()))
                .at(Argument::Parameters),
        }
    }
}

fn pairs(domain: [(f64, f64); 2], places: &Places) -> Result<Vec<[f64; 2]>, Error> {
    match places {
        Places::Grid(rows, columns) => {
            let (us, vs) = (spread(domain[0], *rows), spread(domain[1], *columns));
            Ok(us.iter().flat_map(|&u| vs.iter().map(move |&v| [u, v])).collect())
        }
        Places::Parameters(pairs) => {
            let [of_u, of_v] = super::domains(domain);
            let settle = |(i, &[u, v]): (usize, &[f64; 2])| {
                let (u, v) = (of_u.settle(u).at(0), of_v.settle(v).at(1));
                both(u, v).at(i).map(|(u, v)| [u, v])
            };
            every(pairs.iter().enumerate().map(settle)).at(Argument::Parameters)
        }
    }
}

/// Equally spaced values from end to end.
pub(super) fn spread((a, b): (f64, f64), count: usize) -> Vec<f64> {
    let last = count - 1;
    (0..count)
        .map(|i| if i == last { b } else { (a + (b - a) * (i as f64 / last as f64)).min(b) })
        .collect()
}

/// The normal and the curvatures at one place; none where the surface has no tangent plane.
struct TangentFrame(Option<(Point<3>, f64, f64)>);

impl TangentFrame {
    /// From the partial derivatives, numbered 1 to 5 as u, v, uu, uv, vv; the first two are
    /// compared with their sizes. Lengths are divided out first, so that neither large nor small
    /// surfaces leave the range of doubles.
    fn new(derivative: impl Fn(usize) -> Point<3>, sizes: [f64; 2]) -> Self {
        let [long_u, long_v] = [1, 2].map(|k| derivative(k).norm());
        let (Some(u), Some(v)) = (derivative(1).unit(), derivative(2).unit()) else {
            return TangentFrame(None);
        };
        let across = cross(u, v);
        let sine = across.norm();
        if sine * (long_u / sizes[0]) * (long_v / sizes[1]) <= 8.0 * f64::EPSILON {
            return TangentFrame(None);
        }
        let Some(normal) = across.unit() else { return TangentFrame(None) };
        // First and second fundamental forms for unit tangents (E = G = 1), do Carmo 1976, 2-5 and
        // 3-3.
        let f = u.dot(v);
        let l = derivative(3).dot(normal) / long_u / long_u;
        let m = derivative(4).dot(normal) / long_u / long_v;
        let n = derivative(5).dot(normal) / long_v / long_v;
        let gaussian = (l * n - m * m) / (sine * sine);
        let mean = (l - 2.0 * f * m + n) / (2.0 * sine * sine);
        TangentFrame(Some((normal, mean, gaussian)))
    }
}

fn cross(a: Point<3>, b: Point<3>) -> Point<3> {
    Point([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
}

impl SurfaceSamples {
    fn push(&mut self, index: usize, frame: &TangentFrame, wanted: SurfaceQuantities) {
        if frame.0.is_none() {
            self.degenerate.push(index);
        }
        let (normal, mean, gaussian) = frame.0.unwrap_or((Point::ZERO, 0.0, 0.0));
        if wanted.normal {
            self.normals.push(normal);
        }
        if wanted.mean_curvature {
            self.mean_curvatures.push(mean);
        }
        if wanted.gaussian_curvature {
            self.gaussian_curvatures.push(gaussian);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::basis::{Basis, Bezier};

    /// z = x^2 - y^2 over [-1, 1]^2 as a Bezier patch, u along x and v along y.
    fn saddle() -> Surface {
        let z = [[0.0, 2.0, 0.0], [-2.0, 0.0, -2.0], [0.0, 2.0, 0.0]];
        let point = |i: usize, j: usize| Point([i as f64 - 1.0, j as f64 - 1.0, z[i][j]]);
        let net = (0..3).map(|i| (0..3).map(|j| point(i, j)).collect()).collect();
        Surface::new(&Context::default(), Basis::Bezier(Bezier), Basis::Bezier(Bezier), net)
            .unwrap()
    }

    #[test]
    fn the_saddle_has_its_curvatures() {
        let all =
            SurfaceQuantities { normal: true, mean_curvature: true, gaussian_curvature: true };
        let samples =
            evaluate(&Context::default(), &saddle(), &Places::Grid(5, 7), 2, all).unwrap();
        for (i, p) in samples.points.iter().enumerate() {
            let (x, y) = (p[0], p[1]);
            assert!((p[2] - (x * x - y * y)).abs() < 1e-15 * 8.0);
            let w = 1.0 + 4.0 * x * x + 4.0 * y * y;
            let gaussian = -4.0 / (w * w);
            let mean = (4.0 * y * y - 4.0 * x * x) / w.powf(1.5);
            assert!((samples.gaussian_curvatures[i] - gaussian).abs() < 1e-14, "{x} {y}");
            assert!(
                (samples.mean_curvatures[i] - mean).abs() < 1e-14,
                "{x} {y}: {} {mean}",
                samples.mean_curvatures[i]
            );
            let normal = Point([-2.0 * x, 2.0 * y, 1.0]).unit().unwrap();
            assert!(samples.normals[i].distance(normal) < 1e-14);
        }
        assert!(samples.degenerate.is_empty());
    }

    #[test]
    fn a_collapsed_edge_has_no_normal() {
        let net =
            vec![vec![Point([0.0; 3]); 2], vec![Point([1.0, 0.0, 0.0]), Point([0.0, 1.0, 0.0])]];
        let surface =
            Surface::new(&Context::default(), Basis::Bezier(Bezier), Basis::Bezier(Bezier), net)
                .unwrap();
        let samples = evaluate(
            &Context::default(),
            &surface,
            &Places::Grid(2, 2),
            0,
            SurfaceQuantities { normal: true, ..Default::default() },
        )
        .unwrap();
        assert_eq!(samples.degenerate, [0, 1]);
        assert_eq!(samples.normals[0], Point::ZERO);
    }
}
