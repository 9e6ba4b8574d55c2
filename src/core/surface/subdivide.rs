//! Cutting a surface into patches that together are the same surface.

use super::{Direction, Patch, Shape, Surface};
use crate::core::argument::Argument;
use crate::core::basis::{Basis, Bezier};
use crate::core::check::{at_most, increasing};
use crate::core::context::Context;
use crate::core::domain::Domain;
use crate::core::error::{Error, Locate, both};
use crate::core::fault::Fault;
use crate::core::limits;
use crate::core::point::Point;
use crate::core::subdivide::Form;

/// A piece with the rectangle of the whole surface's parameters that it covers.
#[derive(Debug, Clone, PartialEq)]
pub struct PatchPiece {
    /// The ranges of `u` and `v`.
    pub domain: [(f64, f64); 2],
    /// The piece as a surface over the native domains of its bases.
    pub surface: Surface,
}

/// A surface cut into pieces.
#[derive(Debug, Clone, PartialEq)]
pub struct Pieces {
    /// The pieces, `u` changing slowest.
    pub pieces: Vec<PatchPiece>,
    /// Whether they are in their own families.
    pub in_family: bool,
    /// The product of the 2-norm condition numbers of the two shape matrices; 1 for Bezier pieces.
    pub condition: f64,
}

/// Cuts along lines of constant `u` and `v`. O(pieces * degree^3).
///
/// # Errors
/// At `at/u` or `at/v`: parameters outside the domain or not increasing. At `form`: bases without a
/// way back. More points than [`limits::CONTROL_POINTS`].
pub fn subdivide(
    context: &Context,
    surface: &Surface,
    us: &[f64],
    vs: &[f64],
    form: Form,
) -> Result<Pieces, Error> {
    match surface.shape() {
        Shape::Polynomial(patch) => {
            // A fault has no place in the request: the net is not the one given.
            let make = |[u, v]: [Basis; 2], net| {
                Surface::new(context, u, v, net).map_err(|error| error.of_result().fault)
            };
            pieces(context, surface, &patch, [us, vs], form, make)
        }
        Shape::Rational(rational) => {
            let make = |bases, net: Vec<Vec<_>>| rational.surface(context, bases, &net);
            pieces(context, surface, &rational.patch, [us, vs], form, make)
        }
    }
}

/// The pieces of a patch, in the bases of its surface or as Bezier patches; `make` makes surfaces of
/// nets like those of the patch.
fn pieces<const D: usize>(
    context: &Context,
    surface: &Surface,
    whole: &Patch<D>,
    [us, vs]: [&[f64]; 2],
    form: Form,
    make: impl Fn([Basis; 2], Vec<Vec<Point<D>>>) -> Result<Surface, Fault>,
) -> Result<Pieces, Error> {
    let [of_u, of_v] = super::domains(whole.domain());
    let cuts = |domain: Domain, values: &[f64]| {
        let settled = domain.settle_all(values)?;
        increasing("split parameters", &settled, true).map(|()| settled)
    };
    let (us, vs) =
        both(cuts(of_u, us).at(Argument::U), cuts(of_v, vs).at(Argument::V)).at(Argument::Cuts)?;
    let [m, n] = whole.degrees();
    let points = (us.len() + 1).saturating_mul(vs.len() + 1).saturating_mul((m + 1) * (n + 1));
    at_most(
        "control points in the answer",
        points,
        context.limits.control_points,
        "Cut the surface in parts",
    )
    .at(Argument::Cuts)?;
    let mut patches = Vec::with_capacity((us.len() + 1) * (vs.len() + 1));
    for strip in cut(context, whole, Direction::U, &us)? {
        patches.extend(cut(context, &strip, Direction::V, &vs)?);
    }
    if form != Form::Bezier {
        match in_family(context, surface, &patches, &make) {
            Ok((pieces, condition)) => return Ok(Pieces { pieces, in_family: true, condition }),
            Err(fault) if form == Form::Family => return Err(fault.at(Argument::Form)),
            Err(_) => context.checkpoint()?,
        }
    }
    let bezier = || Basis::Bezier(Bezier);
    let piece = |patch: &Patch<D>| {
        context.checkpoint().map_err(|error| error.fault)?;
        let net = patch.rows().map(<[_]>::to_vec).collect();
        Ok(PatchPiece { domain: patch.domain(), surface: make([bezier(), bezier()], net)? })
    };
    Ok(Pieces {
        pieces: patches.iter().map(piece).collect::<Result<_, Fault>>()?,
        in_family: false,
        condition: 1.0,
    })
}

/// The parts of a patch between cuts; a cut at an end of the domain is none.
fn cut<const D: usize>(
    context: &Context,
    patch: &Patch<D>,
    direction: Direction,
    values: &[f64],
) -> Result<Vec<Patch<D>>, Error> {
    let (start, end) = patch.domain()[direction as usize];
    let mut parts = Vec::with_capacity(values.len() + 1);
    let mut rest = patch.clone();
    for &t in values.iter().filter(|&&t| t > start && t < end) {
        context.checkpoint()?;
        let (part, after) = rest.split(direction, t);
        parts.push(part);
        rest = after;
    }
    parts.push(rest);
    Ok(parts)
}

fn in_family<const D: usize>(
    context: &Context,
    surface: &Surface,
    patches: &[Patch<D>],
    make: &impl Fn([Basis; 2], Vec<Vec<Point<D>>>) -> Result<Surface, Fault>,
) -> Result<(Vec<PatchPiece>, f64), Fault> {
    let [order_u, order_v] = surface.orders();
    let [u, v] = surface.bases();
    let (way_u, way_v) = (u.way_back(context, order_u)?, v.way_back(context, order_v)?);
    let condition = way_u.condition * way_v.condition;
    if condition > limits::CONDITION {
        return Err(Fault::IllConditioned { condition });
    }
    let piece = |patch: &Patch<D>| {
        context.checkpoint().map_err(|error| error.fault)?;
        let rows: Vec<Vec<Point<D>>> = patch.rows().map(|row| way_v.control_points(row)).collect();
        let columns: Vec<_> =
            (0..=order_v).map(|j| way_u.control_points(&super::column(&rows, j))).collect();
        let net = (0..=order_u).map(|i| columns.iter().map(|column| column[i]).collect()).collect();
        Ok(PatchPiece { domain: patch.domain(), surface: make([u.clone(), v.clone()], net)? })
    };
    let pieces = patches.iter().map(piece).collect::<Result<_, Fault>>()?;
    Ok((pieces, condition))
}
