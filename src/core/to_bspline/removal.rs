//! Taking knots out of a B-spline, one copy at a time.

use super::smooth::Knot;
use super::spline::Spline;
use crate::core::context::Context;
use crate::core::error::Error;
use crate::core::local::localized;
use crate::core::point::Point;

impl<const D: usize> Spline<D> {
    /// The curve with each knot repeated as often as its continuity needs, at least `least` times:
    /// copies go one by one, until one would move a control point further than `allowed`. O(knots *
    /// degree^2).
    pub(super) fn lowered(
        self,
        context: &Context,
        found: &[Knot],
        least: usize,
        allowed: f64,
    ) -> Result<Self, Error> {
        let degree = self.degree;
        let mut done = Removal {
            knots: Vec::with_capacity(self.knots.len()),
            points: Vec::with_capacity(self.points.len()),
            old: self,
            gone: 0,
        };
        let mut pace = context.pace();
        for knot in found {
            let needed = (degree as i32 - knot.continuity).max(least as i32) as usize;
            let mut copies = knot.last - knot.first + 1;
            if copies > needed {
                done.take_knots(knot.last);
            }
            while copies > needed {
                pace.step()?;
                done.take_points(copies);
                if !done.remove(copies, allowed) {
                    break;
                }
                copies -= 1;
            }
        }
        Ok(done.finish())
    }
}

/// The knots and points that are done, up to those of the knot in hand, and the old ones, of which
/// the rest still follow.
struct Removal<const D: usize> {
    old: Spline<D>,
    knots: Vec<f64>,
    points: Vec<Point<D>>,
    /// How many copies are gone, and as many points.
    gone: usize,
}

impl<const D: usize> Removal<D> {
    fn take_knots(&mut self, through: usize) {
        self.knots.extend_from_slice(&self.old.knots[self.knots.len() + self.gone..=through]);
    }

    /// Those that the last knot depends on when it has so many copies.
    fn take_points(&mut self, copies: usize) {
        let through = self.knots.len() - copies + self.gone;
        self.points.extend_from_slice(&self.old.points[self.points.len() + self.gone..=through]);
    }

    fn knot(&self, i: usize) -> f64 {
        self.knots.get(i).copied().unwrap_or_else(|| self.old.knots[i + self.gone])
    }

    /// Takes out one of so many copies of the last knot, if that moves no point of the curve by
    /// more than allowed.
    fn remove(&mut self, copies: usize, allowed: f64) -> bool {
        let degree = self.old.degree;
        let start = self.knots.len() - degree - 2;
        let (origin, old) = localized(&self.points[start..]);
        let (new, moved) = if copies > degree {
            (old[..1].to_vec(), old[0].distance(old[1]))
        } else {
            self.without(start, &old)
        };
        if moved.is_nan() || moved > allowed {
            return false;
        }
        self.points.truncate(start);
        self.points.extend(new.into_iter().map(|p| origin + p));
        self.knots.pop();
        self.gone += 1;
        true
    }

    /// The points of which insertion of the last knot makes these: one less, and how far that is
    /// from true.
    ///
    /// Boehm 1980: `old[j] = a[j] new[j] + (1 - a[j]) new[j - 1]` (Tiller
    /// 1992). Solved from both ends, from each as long as its
    /// factor is the larger: then no step amplifies the error of the one before. The two solutions
    /// meet in one point, where they differ as far as the knot is needed.
    fn without(&self, start: usize, old: &[Point<D>]) -> (Vec<Point<D>>, f64) {
        let (degree, last) = (self.old.degree, old.len() - 2);
        let t = self.knots[self.knots.len() - 1];
        let factors = |j: usize| {
            let (low, high) = (self.knot(start + j), self.knot(start + j + degree + 1));
            ((t - low) / (high - low), (high - t) / (high - low))
        };
        let solved = |p: Point<D>, known: Point<D>, own: f64, other: f64| {
            (p - known * other).map(|x| x / own)
        };
        let mut new = vec![old[0]];
        for j in 1..=last {
            let (own, other) = factors(j);
            if own < other {
                break;
            }
            new.push(solved(old[j], new[j - 1], own, other));
        }
        let meeting = new.len() - 1;
        let mut from_end = vec![old[last + 1]];
        for j in (meeting + 1..=last).rev() {
            let (other, own) = factors(j);
            from_end.push(solved(old[j], from_end[last - j], own, other));
        }
        let (left, right) = (new[meeting], from_end[last - meeting]);
        new[meeting] = match meeting {
            0 => left,
            _ if meeting == last => right,
            _ => left.lerp(right, 0.5),
        };
        new.extend(from_end[..last - meeting].iter().rev());
        (new, left.distance(right))
    }

    fn finish(mut self) -> Spline<D> {
        self.knots.extend_from_slice(&self.old.knots[self.knots.len() + self.gone..]);
        self.points.extend_from_slice(&self.old.points[self.points.len() + self.gone..]);
        Spline { degree: self.old.degree, knots: self.knots, points: self.points }
    }
}
