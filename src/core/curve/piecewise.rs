//! Segments joined end to end, sharing a control point at each joint.

use super::composite::Composite;
use super::valid_points;
use crate::core::argument::Argument;
use crate::core::basis::{Basis, ShapeMatrix, WayBack};
use crate::core::bezier_form::elevate;
use crate::core::check::at_most;
use crate::core::check::within_degrees;
use crate::core::context::Context;
use crate::core::error::{Error, Locate};
use crate::core::fault::Fault;
use crate::core::knots::Breaks;
use crate::core::local::{localized, placed};
use crate::core::point::Point;

/// One basis for all segments, or one for each.
#[derive(Debug, Clone, PartialEq)]
pub enum Bases {
    /// The same for every segment.
    Common(Basis),
    /// As many as there are segments.
    PerSegment(Vec<Basis>),
}

impl Bases {
    /// The basis of one segment.
    pub fn of(&self, segment: usize) -> &Basis {
        match self {
            Bases::Common(basis) => basis,
            Bases::PerSegment(bases) => &bases[segment],
        }
    }

    /// The bases that occur, each once in the first case, in order of the segments in the second.
    pub fn as_slice(&self) -> &[Basis] {
        match self {
            Bases::Common(basis) => std::slice::from_ref(basis),
            Bases::PerSegment(bases) => bases,
        }
    }

    /// Whether Bezier points are control points in every segment.
    pub fn are_identity(&self) -> bool {
        self.as_slice().iter().all(Basis::is_identity)
    }

    /// Whether there is a basis for each of this many segments.
    ///
    /// # Errors
    /// [`Fault::WrongCount`].
    pub fn check_count(&self, segments: usize) -> Result<(), Fault> {
        match self {
            Bases::PerSegment(bases) if bases.len() != segments => Err(Fault::WrongCount {
                what: "bases",
                count: bases.len(),
                expected: segments,
                rule: "one for each segment, or one for all",
            }),
            _ => Ok(()),
        }
    }

    /// Checks each basis, with faults placed at `basis` where all segments share it, else at its
    /// place in `bases`.
    ///
    /// # Errors
    /// The first fault that `check` finds.
    pub(crate) fn check_each(
        &self,
        context: &Context,
        check: impl Fn(&Basis) -> Result<(), Fault>,
    ) -> Result<(), Error> {
        match self {
            Bases::Common(basis) => check(basis).at(Argument::Basis),
            Bases::PerSegment(bases) => bases.iter().enumerate().try_for_each(|(i, basis)| {
                context.checkpoint()?;
                check(basis).at(i).at(Argument::Bases)
            }),
        }
    }

    /// What `make` gives for the basis of each segment in turn, computed once where neighbours
    /// share it.
    pub(crate) fn map<T>(
        &self,
        context: &Context,
        mut make: impl FnMut(usize, &Basis) -> Result<T, Error>,
    ) -> Result<PerSegment<T>, Error> {
        let bases = self.as_slice();
        let (mut made, mut index) = (Vec::new(), Vec::with_capacity(bases.len()));
        for (i, basis) in bases.iter().enumerate() {
            if i == 0 || bases[i - 1] != *basis {
                context.checkpoint()?;
                made.push(make(i, basis)?);
            }
            index.push(made.len() - 1);
        }
        Ok(PerSegment { made, index })
    }
}

/// A value for all segments, or one for each.
pub(crate) struct PerSegment<T> {
    made: Vec<T>,
    /// Which of them each segment has; one entry where all segments share it.
    index: Vec<usize>,
}

impl<T> PerSegment<T> {
    pub(crate) fn of(&self, segment: usize) -> &T {
        &self.made[if self.index.len() == 1 { 0 } else { self.index[segment] }]
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &T> {
        self.made.iter()
    }
}

/// A piecewise curve: `segments * order + 1` control points, every `order`-th of them a joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Piecewise<const D: usize> {
    bases: Bases,
    order: usize,
    breaks: Breaks,
    closed: bool,
    points: Vec<Point<D>>,
}

impl<const D: usize> Piecewise<D> {
    /// Checks and joins the parts.
    ///
    /// # Errors
    /// At `bases`, `order` or `control_points`: counts that do not match, a basis that does not
    /// suit the order or does not start and end at its control points, a closed curve whose end
    /// points differ.
    pub fn new(
        context: &Context,
        bases: Bases,
        order: usize,
        breaks: Breaks,
        closed: bool,
        points: Vec<Point<D>>,
    ) -> Result<Self, Error> {
        let segments = breaks.segments();
        within_degrees(context, "order", order).at(Argument::Order)?;
        bases.check_count(segments).at(Argument::Bases)?;
        bases.map(context, |i, basis| basis.joinable(context, order).at(i).at(Argument::Bases))?;
        valid_points(context, &points, 2).at(Argument::ControlPoints)?;
        let expected = segments * order + 1;
        if points.len() != expected {
            let rule = "segments * order + 1, as neighbouring segments share the control point at their joint";
            return Err(Fault::WrongCount {
                what: "control points",
                count: points.len(),
                expected,
                rule,
            }
            .at(Argument::ControlPoints));
        }
        let last = points.len() - 1;
        if closed && points[0] != points[last] {
            let why = "a closed curve ends at its first control point; repeat it here, or leave \"closed\" out";
            return Err(Fault::UnsuitableCurve(why.into()).at(last).at(Argument::ControlPoints));
        }
        Ok(Piecewise { bases, order, breaks, closed, points })
    }

    /// Segments in these bases that run over a composite curve whose segments meet; lower degrees
    /// are elevated to `order`. Also the largest condition number met: the factor by which control
    /// points may amplify relative errors. O(segments).
    ///
    /// # Errors
    /// At `bases`: a basis without a way back from Bezier points (see [`Basis::way_back`]).
    pub fn from_composite(
        context: &Context,
        bases: Bases,
        order: usize,
        composite: &Composite<D>,
        closed: bool,
    ) -> Result<(Self, f64), Error> {
        bases.check_count(composite.breaks().segments()).at(Argument::Bases)?;
        let count = composite.breaks().segments() * order + 1;
        at_most("control points", count, context.limits.control_points, "Take the curve in parts")
            .at(Argument::ControlPoints)?;
        let ways = bases
            .map(context, |i, basis| basis.way_back(context, order).at(i).at(Argument::Bases))?;
        Self::by_ways(context, bases, &ways, order, composite, closed)
    }

    /// The same where the ways back are known.
    pub(crate) fn by_ways(
        context: &Context,
        bases: Bases,
        ways: &PerSegment<WayBack>,
        order: usize,
        composite: &Composite<D>,
        closed: bool,
    ) -> Result<(Self, f64), Error> {
        let condition = ways.iter().map(|way| way.condition).fold(1.0, f64::max);
        let mut points = Vec::with_capacity(composite.breaks().segments() * order + 1);
        points.push(composite.local(0).first());
        let mut pace = context.pace();
        for (i, segment) in composite.locals().enumerate() {
            pace.step()?;
            let (way, from_origin) = (ways.of(i), |&p: &Point<D>| placed(segment.origin, p));
            if way.is_identity() && segment.points.len() > order {
                points.extend(segment.points[1..order].iter().map(from_origin));
            } else {
                points.extend(
                    way.control_points(&elevate(segment.points, order))[1..order]
                        .iter()
                        .map(from_origin),
                );
            }
            // The bases interpolate end points: take the joint itself, not its rounded image.
            points.push(segment.last());
        }
        if closed {
            let last = points.len() - 1;
            points[last] = points[0];
        }
        Ok((
            Piecewise::new(context, bases, order, composite.breaks().clone(), closed, points)
                .of_result()?,
            condition,
        ))
    }

    /// The basis or bases.
    pub fn bases(&self) -> &Bases {
        &self.bases
    }

    /// Control points per segment, less one.
    pub fn order(&self) -> usize {
        self.order
    }

    /// The joints.
    pub fn breaks(&self) -> &Breaks {
        &self.breaks
    }

    /// The control points, taken out.
    pub fn into_control_points(self) -> Vec<Point<D>> {
        self.points
    }

    /// Whether the last segment joins the first.
    pub fn closed(&self) -> bool {
        self.closed
    }

    /// All control points; every `order`-th is a joint.
    pub fn control_points(&self) -> &[Point<D>] {
        &self.points
    }

    /// The control points of one segment, both joints included.
    pub fn polygon(&self, segment: usize) -> &[Point<D>] {
        &self.points[segment * self.order..=(segment + 1) * self.order]
    }

    /// The Bezier segments of the same curve. O(points), the shape matrices aside.
    ///
    /// # Errors
    /// [`Fault::Cancelled`].
    pub fn composite(&self, context: &Context) -> Result<Composite<D>, Error> {
        let matrices = self.bases.map(context, |_, basis| {
            Ok((!basis.is_identity()).then(|| basis.shape_matrix(self.order)))
        })?;
        let degree =
            |matrix: &Option<ShapeMatrix>| matrix.as_ref().map_or(self.order, ShapeMatrix::degree);
        let highest = matrices.iter().map(degree).max().unwrap_or(self.order);
        let mut composite = Composite::with_room(self.breaks.clone(), highest);
        let mut pace = context.pace();
        for i in 0..self.breaks.segments() {
            pace.step()?;
            match matrices.of(i) {
                None => composite.push_absolute(self.polygon(i)),
                Some(matrix) => {
                    let (origin, points) = localized(self.polygon(i));
                    composite.push(origin, &matrix.apply(&points));
                }
            }
        }
        Ok(composite)
    }
}
