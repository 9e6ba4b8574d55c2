//! Cutting a curve into pieces that together run over the same curve.

use super::argument::Argument;
use super::basis::{Basis, Bezier};
use super::bezier_form::{evaluate, split};
use super::check::{at_most, increasing};
use super::curve::{Bases, Composite, Curve, Piecewise, Segment};
use super::domain::Domain;
use super::error::{Error, Locate};
use super::evaluate::{Piece, check_distance, check_tolerance, flat_pieces};
use super::fault::Fault;
use super::knots::Breaks;
use super::metric::{Affine, Metric};
use super::point::Point;
use crate::core::context::Context;

/// Where to cut.
#[derive(Debug, Clone, PartialEq)]
pub enum Cuts {
    /// At these parameters, which increase strictly and lie inside the domain. An end or an
    /// existing joint is no new cut.
    Parameters(Vec<f64>),
    /// Every segment in two, so many times over: `2^depth` pieces of each.
    Depth(usize),
    /// Segments in halves until every piece is this close to its chord.
    Flatness(f64),
}

impl Cuts {
    /// What can be wrong with them whatever the curve.
    ///
    /// # Errors
    /// At `tolerance`: no distance.
    pub fn check(&self) -> Result<(), Error> {
        match self {
            Cuts::Flatness(tolerance) => check_distance(*tolerance).at(Argument::Tolerance),
            Cuts::Parameters(_) | Cuts::Depth(_) => Ok(()),
        }
    }
}

/// In which basis the pieces are wanted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Form {
    /// In their own family where that keeps 8 digits, else as Bezier curves.
    #[default]
    Auto,
    /// In their own family, with the same shape parameters.
    Family,
    /// As Bezier curves.
    Bezier,
}

/// A curve cut into pieces.
#[derive(Debug, Clone, PartialEq)]
pub struct Subdivision<C, const D: usize> {
    /// The pieces, over the domain of the input: equal to the input at every parameter.
    pub curve: C,
    /// The parameters of the cuts.
    pub split_parameters: Vec<f64>,
    /// The points there.
    pub split_points: Vec<Point<D>>,
    /// Whether the pieces are in their own family.
    pub in_family: bool,
    /// By how much the control points may amplify relative rounding errors: the largest 2-norm
    /// condition number of the shape matrices; 1 for Bezier pieces.
    pub condition: f64,
}

/// Cuts a curve. O(pieces * degree^2).
///
/// # Errors
/// At `at`: parameters that do not increase or leave the domain, a tolerance below rounding, more
/// pieces than [`SEGMENTS`](crate::core::limits::SEGMENTS). At `form`: the family form of a curve
/// that has none. At `curve`: a B-spline that jumps.
///
/// ```
/// use springline::core::basis::{Basis, Bezier};
/// use springline::core::context::Context;
/// use springline::core::curve::{Curve, Single};
/// use springline::core::point::Point;
/// use springline::core::subdivide::{Cuts, Form, subdivide};
///
/// let context = Context::default();
/// let points = [[0.0, 0.0], [2.0, 4.0], [4.0, 0.0]].map(Point).to_vec();
/// let parabola = Curve::Single(Single::new(&context, Basis::Bezier(Bezier), points)?);
/// let halves = subdivide(&context, &parabola, &Cuts::Parameters(vec![0.5]), Form::Auto)?;
/// assert_eq!(halves.split_points, [Point([2.0, 2.0])]);
/// let expected = [[0.0, 0.0], [1.0, 2.0], [2.0, 2.0], [3.0, 2.0], [4.0, 0.0]].map(Point);
/// assert_eq!(halves.curve.control_points(), expected);
/// # Ok::<_, springline::core::error::Error>(())
/// ```
pub fn subdivide<const D: usize>(
    context: &Context,
    curve: &Curve<D>,
    cuts: &Cuts,
    form: Form,
) -> Result<Subdivision<Piecewise<D>, D>, Error> {
    subdivide_by(context, curve, cuts, form, &Affine)
}

/// The same of a curve whose distances are those of a metric.
pub(crate) fn subdivide_by<const D: usize>(
    context: &Context,
    curve: &Curve<D>,
    cuts: &Cuts,
    form: Form,
    metric: &impl Metric<D>,
) -> Result<Subdivision<Piecewise<D>, D>, Error> {
    let composite = curve.composite(context).at(Argument::Curve)?;
    let settled = match cuts {
        Cuts::Parameters(values) => {
            let domain = Domain { ends: composite.breaks().domain(), name: "t", of: "curve" };
            domain.settle_all(values).at(Argument::Parameters).at(Argument::Cuts)?
        }
        Cuts::Depth(_) | Cuts::Flatness(_) => Vec::new(),
    };
    let pieces = match cuts {
        Cuts::Parameters(_) => cut_at(context, &composite, &settled).at(Argument::Parameters),
        Cuts::Depth(depth) => halved(context, &composite, *depth).at(Argument::Depth),
        Cuts::Flatness(tolerance) => {
            flat(context, &composite, *tolerance, metric).at(Argument::Tolerance)
        }
    };
    let pieces = pieces.at(Argument::Cuts)?;
    let segments = pieces.iter().map(|piece| Segment {
        origin: composite.local(piece.segment).origin,
        points: &piece.points,
    });
    let cut = Composite::from_segments(context, breaks(context, &composite, &pieces)?, segments)?;
    cut.check_joined(metric).at(Argument::Curve)?;
    let (in_family, (pieces_curve, condition)) = assemble(context, curve, &cut, &pieces, form)?;
    let (split_parameters, split_points) = match cuts {
        Cuts::Parameters(_) => {
            let points = context.collect(settled.iter().map(|&t| point_at(&composite, t)))?;
            (settled, points)
        }
        _ => new_joints(&composite, &cut),
    };
    Ok(Subdivision { curve: pieces_curve, split_parameters, split_points, in_family, condition })
}

fn breaks<const D: usize>(
    context: &Context,
    composite: &Composite<D>,
    pieces: &[Piece<D>],
) -> Result<Breaks, Error> {
    let start = composite.breaks().domain().0;
    Breaks::new(
        context,
        std::iter::once(start).chain(pieces.iter().map(|piece| piece.end)).collect(),
    )
}

fn point_at<const D: usize>(composite: &Composite<D>, t: f64) -> Point<D> {
    let segment = composite.breaks().segment_at(t);
    let Segment { origin, points } = composite.local(segment);
    origin + evaluate(points, composite.breaks().local(segment, t).0)
}

/// The joints of `cut` that `composite` does not have, with their points.
fn new_joints<const D: usize>(
    composite: &Composite<D>,
    cut: &Composite<D>,
) -> (Vec<f64>, Vec<Point<D>>) {
    let old = composite.breaks().as_slice();
    let is_new = |t: f64| old.binary_search_by(|knot| knot.total_cmp(&t)).is_err();
    let ends = cut.breaks().as_slice()[1..].iter().zip(cut.locals());
    ends.filter(|&(&t, _)| is_new(t)).map(|(&t, piece)| (t, piece.last())).unzip()
}

/// Cuts each segment at the parameters inside it, from left to right; all are inside the domain.
fn cut_at<const D: usize>(
    context: &Context,
    composite: &Composite<D>,
    values: &[f64],
) -> Result<Vec<Piece<D>>, Error> {
    increasing("split parameters", values, true)?;
    let most = context.limits.segments.saturating_sub(composite.breaks().segments());
    at_most("cuts", values.len(), most, "Cut the curve in parts")?;
    let mut pieces = Vec::with_capacity(values.len() + composite.breaks().segments());
    let mut pace = context.pace();
    for (segment, Segment { points, .. }) in composite.locals().enumerate() {
        pace.step()?;
        let (mut start, end) = composite.breaks().interval(segment);
        let mut rest = points.to_vec();
        let inside =
            values.iter().skip(values.partition_point(|&t| t <= start)).take_while(|&&t| t < end);
        for &t in inside {
            pace.step()?;
            let (left, right) = split(&rest, (t - start) / (end - start));
            pieces.push(Piece { segment, end: t, points: left });
            (start, rest) = (t, right);
        }
        pieces.push(Piece { segment, end, points: rest });
    }
    Ok(pieces)
}

fn halved<const D: usize>(
    context: &Context,
    composite: &Composite<D>,
    depth: usize,
) -> Result<Vec<Piece<D>>, Error> {
    const ADVICE: &str = "Choose a smaller depth: every step doubles the pieces";
    let per_segment =
        1usize.checked_shl(depth.min(usize::BITS as usize) as u32).unwrap_or(usize::MAX);
    let pieces = per_segment.saturating_mul(composite.breaks().segments());
    at_most("pieces", pieces, context.limits.segments, ADVICE)?;
    let breaks = composite.breaks();
    let whole = composite.locals().enumerate().map(|(segment, Segment { points, .. })| {
        let (start, end) = breaks.interval(segment);
        (start, Piece { segment, end, points: points.to_vec() })
    });
    let whole = context.collect(whole)?;
    let too_short = |i: usize| {
        let (a, b) = breaks.interval(i);
        let step = (b - a) / per_segment as f64;
        // So far apart that neighbours differ after rounding, wherever they lie.
        step <= 2.0 * f64::EPSILON * a.abs().max(b.abs()) || step < f64::MIN_POSITIVE
    };
    if let Some(i) = (0..breaks.segments()).find(|&i| depth > 0 && too_short(i)) {
        let (a, b) = breaks.interval(i);
        let why = format!(
            "the interval from {a:?} to {b:?} is too short to be halved {depth} times in double precision"
        );
        return Err(Fault::UnsuitableCurve(why).into());
    }
    let halve = |pieces: Vec<(f64, Piece<D>)>| {
        let halves = |(start, piece): (f64, Piece<D>)| {
            let middle = start + 0.5 * (piece.end - start);
            let (left, right) = split(&piece.points, 0.5);
            let first = Piece { segment: piece.segment, end: middle, points: left };
            [(start, first), (middle, Piece { points: right, ..piece })]
        };
        context.collect(pieces.into_iter().flat_map(halves))
    };
    let pieces = (0..depth).try_fold(whole, |pieces, _| halve(pieces))?;
    Ok(pieces.into_iter().map(|(_, piece)| piece).collect())
}

fn flat<const D: usize>(
    context: &Context,
    composite: &Composite<D>,
    tolerance: f64,
    metric: &impl Metric<D>,
) -> Result<Vec<Piece<D>>, Error> {
    check_tolerance(tolerance, composite.magnitude_in(metric))?;
    flat_pieces(context, composite, tolerance, context.limits.segments, metric)
}

/// The pieces as a piecewise curve: in the family if asked for and possible, else as Bezier curves.
fn assemble<const D: usize>(
    context: &Context,
    curve: &Curve<D>,
    cut: &Composite<D>,
    pieces: &[Piece<D>],
    form: Form,
) -> Result<(bool, (Piecewise<D>, f64)), Error> {
    if form != Form::Bezier {
        match in_family(context, curve, cut, pieces) {
            Ok(family) => return Ok((true, family)),
            Err(error) if form == Form::Family => {
                return Err(Error::from(error.fault).at(Argument::Form));
            }
            Err(_) => context.checkpoint()?,
        }
    }
    let bases = Bases::Common(Basis::Bezier(Bezier));
    Ok((
        false,
        Piecewise::from_composite(context, bases, cut.degree(), cut, cut.closes(curve.closed()))?,
    ))
}

fn in_family<const D: usize>(
    context: &Context,
    curve: &Curve<D>,
    cut: &Composite<D>,
    pieces: &[Piece<D>],
) -> Result<(Piecewise<D>, f64), Error> {
    let (bases, order) = match curve {
        Curve::Single(single) => (Bases::Common(single.basis().clone()), single.order()),
        Curve::Piecewise(piecewise) => (inherited(piecewise.bases(), pieces), piecewise.order()),
        Curve::BSpline(_) => {
            return Err(Fault::UnsuitableCurve(
                "the pieces of a bspline are bezier curves; ask for the form bezier or auto".into(),
            )
            .into());
        }
    };
    Piecewise::from_composite(context, bases, order, cut, cut.closes(curve.closed()))
}

/// Each piece has the basis of the segment it was cut from.
fn inherited<const D: usize>(bases: &Bases, pieces: &[Piece<D>]) -> Bases {
    match bases {
        Bases::Common(basis) => Bases::Common(basis.clone()),
        Bases::PerSegment(bases) => {
            Bases::PerSegment(pieces.iter().map(|piece| bases[piece.segment].clone()).collect())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::curve::{BSpline, Single};

    fn bezier(points: &[[f64; 2]]) -> Curve<2> {
        let points = points.iter().map(|&p| Point(p)).collect();
        Curve::Single(Single::new(&Context::default(), Basis::Bezier(Bezier), points).unwrap())
    }

    fn cut(curve: &Curve<2>, cuts: &Cuts) -> Subdivision<Piecewise<2>, 2> {
        subdivide(&Context::default(), curve, cuts, Form::Auto).unwrap()
    }

    #[test]
    fn a_cubic_is_cut_as_by_hand() {
        let curve = bezier(&[[0.0, 0.0], [8.0, 16.0], [16.0, -8.0], [24.0, 8.0]]);
        let halves = cut(&curve, &Cuts::Parameters(vec![0.5]));
        let (left, right) = ([[0.0, 0.0], [4.0, 8.0], [8.0, 6.0]], [[16.0, 2.0], [20.0, 0.0]]);
        let expected = [&left[..], &[[12.0, 4.0]], &right[..], &[[24.0, 8.0]]].concat();
        assert_eq!(
            halves.curve.control_points(),
            expected.into_iter().map(Point).collect::<Vec<_>>()
        );
        assert_eq!(halves.split_points, [Point([12.0, 4.0])]);
    }

    #[test]
    fn halving_twice_is_cutting_in_quarters() {
        let curve = bezier(&[[0.0, 0.0], [1.0, 7.0], [5.0, -3.0], [2.0, 2.0], [6.0, 4.0]]);
        let quarters = cut(&curve, &Cuts::Parameters(vec![0.25, 0.5, 0.75]));
        let halved = cut(&curve, &Cuts::Depth(2));
        assert_eq!(halved.split_parameters, quarters.split_parameters);
        let pairs = halved.curve.control_points().iter().zip(quarters.curve.control_points());
        let apart = pairs.map(|(p, q)| p.distance(*q)).fold(0.0, f64::max);
        assert!(apart <= 1e-15, "{apart:e}");
    }

    /// Over an interval `h`, the parabola `y = t^2` is `h^2 / 4` from its chord.
    #[test]
    fn a_parabola_has_as_many_flat_pieces_as_its_formula_says() {
        let parabola = bezier(&[[0.0, 0.0], [0.5, 0.0], [1.0, 1.0]]);
        let pieces =
            |tolerance| cut(&parabola, &Cuts::Flatness(tolerance)).curve.breaks().segments();
        assert_eq!((pieces(0.25), pieces(0.0625)), (1, 2));
        assert_eq!((pieces(0.25 - 1e-15), pieces(0.0625 - 1e-15)), (2, 4));
    }

    #[test]
    fn a_refused_cut_is_placed() {
        let place = |curve: &Curve<2>, cuts, form| {
            subdivide(&Context::default(), curve, &cuts, form).unwrap_err().place.to_string()
        };
        let curve = bezier(&[[0.0, 0.0], [1.0, 1.0]]);
        let backwards = Cuts::Parameters(vec![0.5, 0.25]);
        assert_eq!(place(&curve, backwards, Form::Auto), "/cuts/parameters/1");
        assert_eq!(place(&curve, Cuts::Depth(60), Form::Auto), "/cuts/depth");
        let (knots, points) = (vec![0.0, 0.0, 1.0, 1.0], curve.control_points().to_vec());
        let spline = BSpline::new(&Context::default(), 1, knots, points, false).unwrap();
        assert_eq!(place(&Curve::BSpline(spline), Cuts::Depth(1), Form::Family), "/form");
    }
}
