//! The curvature comb: lines from the curve, against its normal, as long as it is curved.

use crate::core::context::Context;
use crate::core::error::Error;
use crate::core::point::Point;
use crate::draw::canvas::Canvas;
use crate::draw::frame::{Bounds, Frame};
use crate::draw::{Mark, palette};

/// One line of the comb.
#[derive(Debug, Clone, Copy)]
pub struct Tooth {
    base: Point<2>,
    /// The curvature times the unit vector away from the centre of curvature, projected.
    bend: Point<2>,
    /// Whether a segment starts here.
    first: bool,
}

impl Tooth {
    /// The end of the line for a scale.
    pub fn end(&self, scale: CombScale) -> Point<2> {
        let line = self.bend * scale.reach;
        let cut = scale.longest / line.norm();
        self.base + if cut < 1.0 { line * cut } else { line }
    }
}

/// Lines of a segment; fewer for a curve of many segments.
fn per_segment(segments: usize) -> usize {
    (2_000 / segments).clamp(2, 32)
}

/// The comb of a curve of so many segments, given its point and two derivatives at the parameters
/// `u` and `1 - u` of each. Places without speed have no normal, and no line.
///
/// # Errors
/// [`Fault::Cancelled`](crate::core::fault::Fault).
pub fn teeth<const D: usize>(
    context: &Context,
    count: usize,
    jet: impl Fn(usize, f64, f64) -> [Point<D>; 3],
    view: fn(Point<D>) -> Point<2>,
) -> Result<Vec<Tooth>, Error> {
    let steps = per_segment(count);
    let places = (0..count).flat_map(|segment| (0..=steps).map(move |i| (segment, i)));
    let tooth = |(segment, i): (usize, usize)| {
        let (u, v) = (i as f64 / steps as f64, (steps - i) as f64 / steps as f64);
        let [place, first, second] = jet(segment, u, v);
        Some(Tooth { base: view(place), bend: view(bend(first, second)?), first: i == 0 })
    };
    context.collect(places.filter_map(tooth).filter(|tooth| tooth.bend.is_finite()))
}

/// Minus the curvature vector.
fn bend<const D: usize>(velocity: Point<D>, acceleration: Point<D>) -> Option<Point<D>> {
    let tangent = velocity.unit()?;
    let speed = velocity.norm();
    Some(acceleration.across(tangent).map(|x| -x / speed / speed))
}

/// How long the lines of a comb are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CombScale {
    /// The length of a line for curvature 1.
    reach: f64,
    /// No line is longer.
    longest: f64,
}

/// Lines this many times as long as nine in ten are may be cut.
const OUTLIER: f64 = 5.0;

/// The scale with which the longest line is a fifth of the picture. Where a few are far longer than
/// the others, a near-cusp's, they would leave nothing of the rest: then the longest of those that
/// are not is a fifth, and what is longer is cut there.
pub fn scale<'a>(
    teeth: impl Iterator<Item = &'a Tooth>,
    bounds: &Bounds,
    given: Option<f64>,
) -> CombScale {
    if let Some(reach) = given {
        return CombScale { reach, longest: f64::INFINITY };
    }
    let mut bends: Vec<f64> = teeth.map(|tooth| tooth.bend.norm()).collect();
    bends.sort_by(f64::total_cmp);
    let most = bends.last().copied().unwrap_or(0.0);
    let usual = OUTLIER * bends.get(bends.len() * 9 / 10).copied().unwrap_or(0.0);
    let longest = 0.2 * bounds.size();
    let reach = longest / if usual > 0.0 { most.min(usual) } else { most };
    if reach.is_finite() { CombScale { reach, longest } } else { CombScale { reach: 0.0, longest } }
}

/// The lines, and one line along their ends.
pub fn draw<'a>(
    context: &Context,
    canvas: &mut Canvas,
    combs: impl Iterator<Item = (&'a [Tooth], &'a Mark)>,
    frame: &Frame,
    scale: CombScale,
) {
    canvas.open("comb", "fill=\"none\" stroke-width=\"0.8\" opacity=\"0.7\"");
    for (teeth, mark) in combs {
        let lines: Vec<[Point<2>; 2]> =
            teeth.iter().map(|tooth| [tooth.base, tooth.end(scale)]).collect();
        canvas.lines(context, &lines, frame, palette::color(mark.color));
        let ends: Vec<Vec<Point<2>>> = teeth
            .chunk_by(|_, next| !next.first)
            .map(|part| part.iter().map(|tooth| tooth.end(scale)).collect())
            .collect();
        ends.iter()
            .for_each(|part| canvas.polyline(context, part, frame, palette::color(mark.color)));
    }
    canvas.close();
}
