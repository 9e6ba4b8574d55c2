//! Any curve as one B-spline.

use super::bezier_form::{blossom, split};
use super::continuity::parametric_orders;
use super::curve::{BSpline, Composite, Curve};
use super::error::{At, Error, Fault, at_most};
use super::limits;
use super::point::Point;
use super::work;

/// The kind of knot vector wanted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum KnotStyle {
    /// End knots of multiplicity degree + 1: the curve starts and ends at control points.
    #[default]
    Clamped,
    /// Equally spaced simple knots, also beyond the ends (Cheng et al. eq. (26) for one cubic). A closed curve becomes periodic.
    Uniform,
    /// For closed curves: the knots of one period repeat, and so do the first `degree` control points.
    Periodic,
}

/// A former joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FormerJoint {
    /// Its parameter.
    pub parameter: f64,
    /// How many derivatives agree there; -1 where not even the points do. At most the degree.
    pub continuity: i32,
    /// The multiplicity of its knot.
    pub multiplicity: usize,
}

/// A curve as a B-spline.
#[derive(Debug, Clone, PartialEq)]
pub struct Conversion<const D: usize> {
    /// The same curve over the same domain.
    pub curve: BSpline<D>,
    /// Each former joint; for a closed curve the last is the seam.
    pub joints: Vec<FormerJoint>,
    /// How far apart the two curves can be at equal parameters: a bound, measured on the result.
    pub deviation: f64,
    /// The relative tolerance used to measure continuity.
    pub tolerance: f64,
}

/// Refuses a tolerance that is no fraction.
///
/// # Errors
/// [`Fault::OutOfRange`].
pub fn check_tolerance(tolerance: f64) -> Result<(), Fault> {
    if tolerance > 0.0 && tolerance < 1.0 {
        return Ok(());
    }
    let allowed = "0 < tolerance < 1, relative to the derivatives compared".into();
    Err(Fault::OutOfRange { what: "tolerance", value: tolerance, allowed })
}

/// Converts a curve: degree that of its segments, each joint a knot of the lowest multiplicity,
/// `degree - k`, that its measured continuity `C^k` allows; where the segments are one polynomial,
/// no knot at all. Clamped knots are repeated more often where rounding demands it.
/// O(segments * degree^2).
///
/// # Errors
/// At `tolerance`: not positive or 1 and more. At `knots`: uniform or periodic knots that the curve does not allow.
pub fn to_bspline<const D: usize>(curve: &Curve<D>, style: KnotStyle, tolerance: f64) -> Result<Conversion<D>, Error> {
    check_tolerance(tolerance).at("tolerance")?;
    let composite = curve.composite().at("curve")?;
    let found = parametric_orders(&composite, curve.closed(), tolerance)?;
    let realized = |plan| realize(plan, &composite, curve.closed(), tolerance);
    let (curve, deviation) = match style {
        KnotStyle::Clamped => leanest(&composite, &found, realized),
        KnotStyle::Uniform => uniform(&composite, &found, curve.closed()).at("knots").and_then(realized),
        KnotStyle::Periodic if curve.closed() => realized(periodic(&composite, &found)),
        KnotStyle::Periodic => {
            Err(unsuitable("periodic knots need a closed curve; mark it \"closed\", or ask for clamped knots").at("knots"))
        }
    }?;
    let knots = curve.knots().as_slice();
    let multiplicity = |t: f64| knots.partition_point(|&knot| knot <= t) - knots.partition_point(|&knot| knot < t);
    let joint = |&(parameter, continuity)| FormerJoint { parameter, continuity, multiplicity: multiplicity(parameter) };
    let joints = found.iter().map(joint).collect();
    Ok(Conversion { curve, joints, deviation, tolerance })
}

/// A plan carried out: the B-spline, and how far it may be from the curve.
fn realize<const D: usize>(plan: Plan, composite: &Composite<D>, closed: bool, tolerance: f64) -> Result<(BSpline<D>, f64), Error> {
    at_most("control points in the answer", plan.count(), limits::effective().control_points, "Convert the curve in parts")?;
    let points = plan.control_points(composite)?;
    let curve = BSpline::new(composite.degree(), plan.knots, points, closed)?;
    let deviation = deviation(composite, &curve.composite()?)?;
    check_deviation(deviation, tolerance, composite).at("knots")?;
    Ok((curve, deviation))
}

/// The first of three clamped knot vectors that keeps the curve: of lowest multiplicities; with every joint as a knot,
/// where rounding forbids to continue one short segment over many; with full multiplicities, which loses nothing.
fn leanest<const D: usize, T>(
    composite: &Composite<D>,
    found: &[(f64, i32)],
    realized: impl Fn(Plan) -> Result<T, Error>,
) -> Result<T, Error> {
    let attempt = |least| {
        work::checkpoint()?;
        realized(clamped(composite, found, least))
    };
    attempt(0).or_else(|_| attempt(1)).or_else(|_| attempt(composite.degree()))
}

fn unsuitable(why: &str) -> Fault {
    Fault::UnsuitableCurve(why.into())
}

/// A knot vector, and how its parameters beyond the domain map back into it.
struct Plan {
    degree: usize,
    knots: Vec<f64>,
    /// The length after which the curve repeats.
    period: Option<f64>,
}

/// `degree - k` copies of each joint, at least `least`.
fn copies(degree: usize, found: &[(f64, i32)], least: usize) -> impl Iterator<Item = f64> {
    found.iter().flat_map(move |&(t, k)| std::iter::repeat_n(t, ((degree as i32 - k).max(0) as usize).max(least)))
}

fn clamped<const D: usize>(composite: &Composite<D>, found: &[(f64, i32)], least: usize) -> Plan {
    let degree = composite.degree();
    let (a, b) = composite.breaks().domain();
    let inner = &found[..composite.breaks().segments() - 1];
    let ends = |t: f64| std::iter::repeat_n(t, degree + 1);
    Plan { degree, knots: ends(a).chain(copies(degree, inner, least)).chain(ends(b)).collect(), period: None }
}

/// One period of knots, continued to both sides by `degree` knots.
fn periodic<const D: usize>(composite: &Composite<D>, found: &[(f64, i32)]) -> Plan {
    let degree = composite.degree();
    let (a, b) = composite.breaks().domain();
    let (inner, seam) = found.split_at(found.len() - 1);
    let seam_copies = (degree as i32 - seam[0].1).clamp(1, degree as i32) as usize;
    let one: Vec<f64> = std::iter::repeat_n(a, seam_copies).chain(copies(degree, inner, 0)).collect();
    let count = one.len() as i64;
    // Knot number `degree` is the last copy of `a`, so that the domain starts there.
    let knot = |j: i64| {
        let i = j - degree as i64 + seam_copies as i64 - 1;
        let (turns, i) = (i.div_euclid(count), i.rem_euclid(count) as usize);
        if turns == 1 && one[i] == a { b } else { one[i] + turns as f64 * (b - a) }
    };
    let knots = (0..count + 2 * degree as i64 + 1).map(knot).collect();
    Plan { degree, knots, period: Some(b - a) }
}

/// Simple knots at equal distances; every joint becomes one, however smooth.
fn uniform<const D: usize>(composite: &Composite<D>, found: &[(f64, i32)], closed: bool) -> Result<Plan, Fault> {
    let degree = composite.degree();
    let breaks = composite.breaks();
    let (a, b) = breaks.domain();
    let step = (b - a) / breaks.segments() as f64;
    let even = |i: i64| a + i as f64 * step;
    if let Some(i) = (0..=breaks.segments()).find(|&i| (breaks.as_slice()[i] - even(i as i64)).abs() > 1e-12 * (b - a)) {
        let t = breaks.as_slice()[i];
        let why = format!(
            "uniform knots need segments of equal length, but the joint {t:?} is not at {:?}; ask for clamped knots",
            even(i as i64)
        );
        return Err(Fault::UnsuitableCurve(why));
    }
    if let Some((t, k)) = found.iter().find(|(_, k)| *k < degree as i32 - 1) {
        let needed = degree - 1;
        let why = format!("simple knots need C{needed} joints, but the curve is C{k} at {t:?}; ask for clamped knots");
        return Err(Fault::UnsuitableCurve(why));
    }
    // Joints as they are given, not as they round.
    let inside = |i: i64| usize::try_from(i).ok().and_then(|i| breaks.as_slice().get(i).copied());
    let knot = |j: i64| inside(j - degree as i64).unwrap_or_else(|| even(j - degree as i64));
    let knots = (0..(breaks.segments() + 2 * degree + 1) as i64).map(knot).collect();
    Ok(Plan { degree, knots, period: closed.then_some(b - a) })
}

impl Plan {
    /// How many control points it makes.
    fn count(&self) -> usize {
        self.knots.len() - self.degree - 1
    }

    /// Control point `i` is the blossom, at `knots[i + 1] .. knots[i + degree]`, of any segment in its support
    /// (Ramshaw 1987): the one nearest to the middle of the arguments is taken, where extrapolation is least.
    fn control_points<const D: usize>(&self, curve: &Composite<D>) -> Result<Vec<Point<D>>, Error> {
        let count = self.count();
        let mut points = work::collect((0..count).map(|i| self.control_point(curve, i)))?;
        if self.period.is_some() {
            // The first `degree` points come again at the end, to the last bit.
            for i in 0..self.degree {
                points[count - self.degree + i] = points[i];
            }
        }
        Ok(points)
    }

    fn control_point<const D: usize>(&self, curve: &Composite<D>, i: usize) -> Point<D> {
        let arguments = &self.knots[i + 1..=i + self.degree];
        let middle = 0.5 * (arguments[(self.degree - 1) / 2] + arguments[self.degree / 2]);
        let (lo, hi) = self.span_near(i, middle);
        let (segment, shift) = locate(curve, lo, hi, middle, self.period);
        let (a, b) = curve.breaks().interval(segment);
        blossom(curve.segment(segment), arguments.iter().map(|t| (t - shift - a) / (b - a)))
    }

    /// The span of positive length in the support of control point `i` that is nearest to a parameter.
    fn span_near(&self, i: usize, middle: f64) -> (f64, f64) {
        let last = self.knots.len() - self.degree - 1;
        let spans = (i..=i + self.degree).filter(|&k| self.period.is_some() || (self.degree..last).contains(&k));
        let spans = spans.map(|k| (self.knots[k], self.knots[k + 1])).filter(|(lo, hi)| lo < hi);
        let distance = |&(lo, hi): &(f64, f64)| (lo - middle).max(middle - hi).max(0.0);
        spans.min_by(|x, y| distance(x).total_cmp(&distance(y))).unwrap_or((self.knots[self.degree], self.knots[last]))
    }
}

/// The segment of the curve inside the span `[lo, hi]` nearest to `middle`, and the multiple of the period to subtract.
fn locate<const D: usize>(curve: &Composite<D>, lo: f64, hi: f64, middle: f64, period: Option<f64>) -> (usize, f64) {
    let (a, b) = curve.breaks().domain();
    let center = lo + 0.5 * (hi - lo);
    let shift = period.map_or(0.0, |period| ((center - a) / period).floor() * period);
    let (lo, hi) = ((lo - shift).max(a), (hi - shift).min(b));
    let segment = curve.breaks().segment_at((middle - shift).clamp(lo, hi));
    let starts_after = curve.breaks().interval(segment).0 >= hi;
    (segment - usize::from(starts_after && segment > 0), shift)
}

/// The largest distance between Bezier points of the two curves on the intervals of the first.
fn deviation<const D: usize>(original: &Composite<D>, result: &Composite<D>) -> Result<f64, Error> {
    let on_interval = |i: usize| {
        let (a, b) = original.breaks().interval(i);
        let holder = result.breaks().segment_at(a + 0.5 * (b - a));
        let (start, end) = (result.breaks().local(holder, a).0, result.breaks().local(holder, b).0);
        let points = result.segment(holder);
        let piece = if start <= 0.0 && end >= 1.0 { points.to_vec() } else { restricted(points, start.max(0.0), end.min(1.0)) };
        original.segment(i).iter().zip(piece).map(|(p, q)| p.distance(q)).fold(0.0, f64::max)
    };
    Ok(work::collect((0..original.breaks().segments()).map(on_interval))?.into_iter().fold(0.0, f64::max))
}

/// The Bezier points over `[u, v]`, a part of `[0, 1]`.
fn restricted<const D: usize>(points: &[Point<D>], u: f64, v: f64) -> Vec<Point<D>> {
    let (left, _) = split(points, v);
    split(&left, if v > 0.0 { u / v } else { 0.0 }).1
}

/// Refuses a result that lost the curve: control points beyond the ends amplify rounding errors with the degree.
fn check_deviation<const D: usize>(deviation: f64, tolerance: f64, composite: &Composite<D>) -> Result<(), Fault> {
    if deviation <= tolerance.max(1e-9) * composite.magnitude() {
        return Ok(());
    }
    let degree = composite.degree();
    let why = format!(
        "these knots put control points so far beyond the ends of a curve of degree {degree} that rounding moves it by {deviation:.1e}; \
         ask for clamped knots"
    );
    Err(Fault::UnsuitableCurve(why))
}
