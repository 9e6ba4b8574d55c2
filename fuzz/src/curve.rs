//! Bytes to any curve the core can be asked for, valid or not.

use springline::core::basis::{AlphaBeta, Basis, Beta, Bezier, Quasi, ShapeParameters};
use springline::core::context::Context;
use springline::core::continuity::Tolerance;
use springline::core::curve::{BSpline, Bases, Curve, Piecewise, Single};
use springline::core::error::Error;
use springline::core::evaluate::{Quantities, Samples, Sampling, evaluate};
use springline::core::fault::Fault;
use springline::core::knots::Breaks;
use springline::core::point::Point;
use springline::core::rational::{self, AnyCurve, Rational};
use springline::core::subdivide::{Cuts, Form, subdivide};
use springline::core::to_bspline::{KnotStyle, to_bspline};

/// A curve of the plane or of space; whether it is one. If it is, every operation on it comes to an
/// end, and it stays among its control points.
pub fn curve(bytes: &[u8]) -> bool {
    let mut source = Source(bytes);
    if source.below(2) == 0 { works::<2, 3>(source) } else { works::<3, 4>(source) }
}

fn works<const D: usize, const H: usize>(mut source: Source) -> bool {
    let Ok(curve) = source.curve::<D>() else { return false };
    let all =
        Quantities { tangent: true, normal: true, curvature: true, torsion: D == 3, speed: true };
    for sampling in [Sampling::Count(2 + source.below(30)), Sampling::Parameters(source.numbers(3))]
    {
        match evaluate(&Context::default(), &curve, &sampling, source.below(5), all) {
            Ok(samples) => stays_inside(&curve, &samples),
            Err(error) => {
                assert!(
                    error.clone().each().iter().all(|error| is_expected(&error.fault)),
                    "{error:?}"
                );
            }
        }
    }
    // These refuse what they cannot do; they must not panic.
    let _ = subdivide(&Context::default(), &curve, &Cuts::Depth(1), Form::Auto);
    let _ = to_bspline(&Context::default(), &curve, KnotStyle::Clamped, 1e-9);
    works_with_weights::<D, H>(curve, source);
    true
}

/// The same with weights over twelve decades.
fn works_with_weights<const D: usize, const H: usize>(curve: Curve<D>, mut source: Source) {
    let context = Context::default();
    let weights = curve.control_points().iter().map(|_| 10f64.powi(source.below(13) as i32 - 6));
    let weights = weights.collect();
    let Ok(rational) = Rational::<D, H>::new(&context, curve.clone(), weights) else { return };
    let all =
        Quantities { tangent: true, normal: true, curvature: true, torsion: D == 3, speed: true };
    let sampling = Sampling::Count(2 + source.below(30));
    match rational::evaluate(&context, &rational, &sampling, source.below(5), all) {
        Ok(samples) => stays_inside(&curve, &samples),
        Err(error) => {
            let each = error.clone().each();
            assert!(each.iter().all(|error| is_expected(&error.fault)), "{error:?}");
        }
    }
    let _ = rational::subdivide(&context, &rational, &Cuts::Depth(1), Form::Auto);
    let _ = rational::to_bspline(&context, &rational, KnotStyle::Clamped, 1e-9);
    let any = AnyCurve::Rational(rational);
    let _ = rational::continuity(&context, &any, Tolerance::default());
}

/// A parameter outside the domain, or a result beyond the largest double.
fn is_expected(fault: &Fault) -> bool {
    matches!(fault, Fault::OutOfRange { .. } | Fault::Overflow)
}

/// A curve lies in the hull of its control points, and directions have length 1 or, where there is
/// none, 0. Beyond 1e100 the numbers on the way may overflow; what then comes out is not finite,
/// which the edge names.
fn stays_inside<const D: usize>(curve: &Curve<D>, samples: &Samples<D>) {
    let reach = |points: &[Point<D>]| {
        points
            .iter()
            .flat_map(|p| p.0)
            .fold(0.0_f64, |most, x| if x.is_nan() { x } else { most.max(x.abs()) })
    };
    let size = reach(curve.control_points());
    if size > 1e100 {
        return;
    }
    assert!(reach(&samples.points) <= size * (1.0 + 1e-9), "{samples:?} of {curve:?}");
    for direction in samples.frames.tangents.iter().chain(&samples.frames.normals) {
        let length = direction.norm();
        assert!(
            length == 0.0 || (length - 1.0).abs() < 1e-9 || !length.is_finite(),
            "{direction:?} of {curve:?}"
        );
    }
}

/// Bytes read from the front; zeros after their end.
struct Source<'a>(&'a [u8]);

impl Source<'_> {
    fn byte(&mut self) -> u8 {
        let Some((&first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        first
    }

    fn below(&mut self, limit: usize) -> usize {
        usize::from(self.byte()) % limit
    }

    fn number(&mut self) -> f64 {
        const HOSTILE: [f64; 12] = [
            -0.0,
            5e-324,
            1e-308,
            1e-17,
            0.1,
            1.0,
            3.0,
            9_007_199_254_740_993.0,
            1e17,
            1e150,
            1e308,
            -1.797_693_134_862_315_7e308,
        ];
        match self.below(8) {
            0 => f64::from_bits((0..8).fold(0, |bits, _| bits << 8 | u64::from(self.byte()))),
            1 => HOSTILE[self.below(HOSTILE.len())],
            2 | 3 => f64::from(self.byte()) / 255.0,
            _ => f64::from(self.byte()) - 128.0,
        }
    }

    fn numbers(&mut self, count: usize) -> Vec<f64> {
        (0..count).map(|_| self.number()).collect()
    }

    /// Mostly in order.
    fn increasing(&mut self, count: usize) -> Vec<f64> {
        let mut numbers = self.numbers(count);
        if self.below(8) > 0 {
            numbers.sort_by(f64::total_cmp);
        }
        numbers
    }

    fn points<const D: usize>(&mut self, count: usize) -> Vec<Point<D>> {
        (0..count).map(|_| Point(std::array::from_fn(|_| self.number()))).collect()
    }

    fn basis(&mut self) -> Result<Basis, Error> {
        Ok(match self.below(6) {
            0 => Basis::Bezier(Bezier),
            1 => Basis::Beta(Beta::from_beta(self.number())?),
            2 => Basis::Beta(Beta::from_lambda(self.number())?),
            3 => Basis::AlphaBeta(AlphaBeta::new(self.number(), self.number())?),
            _ => Basis::Quasi(Quasi::new(&Context::default(), self.shape())?),
        })
    }

    fn shape(&mut self) -> ShapeParameters {
        let (count, width) = (1 + self.below(5), 2 + self.below(4));
        let more = self.below(2);
        match self.below(4) {
            0 => ShapeParameters::Matrix { rows: self.rows(width + more, width) },
            1 => ShapeParameters::Symmetric {
                degree: 2 * count + more,
                upper_rows: self.rows(count, width),
            },
            2 => ShapeParameters::Recursive { seed: self.rows(width + more, width) },
            _ => ShapeParameters::Elevation { lambdas: self.numbers(count) },
        }
    }

    /// Rows that mostly sum to 1; the first and the last mostly of one entry.
    fn rows(&mut self, count: usize, width: usize) -> Vec<Vec<f64>> {
        let unit = |place: usize| (0..width).map(|j| f64::from(u8::from(j == place))).collect();
        let plain = self.below(8) > 0;
        let row = |i: usize| match i {
            0 if plain => unit(0),
            i if plain && i + 1 == count => unit(width - 1),
            _ => self.row(width),
        };
        (0..count).map(row).collect()
    }

    fn row(&mut self, width: usize) -> Vec<f64> {
        let mut row = self.numbers(width);
        if self.below(8) > 0 {
            let sum: f64 = row.iter().map(|x| x.abs()).sum();
            row.iter_mut().for_each(|x| *x = x.abs() / sum);
        }
        row
    }

    fn curve<const D: usize>(&mut self) -> Result<Curve<D>, Error> {
        match self.below(3) {
            0 => {
                let count = self.below(12);
                Ok(Curve::Single(Single::new(
                    &Context::default(),
                    self.basis()?,
                    self.points(count),
                )?))
            }
            1 => self.piecewise().map(Curve::Piecewise),
            _ => {
                let (degree, spare) = (self.below(6), self.below(6));
                let count = degree + 1 + spare;
                let knots = self.increasing(count + degree + 1);
                Ok(Curve::BSpline(BSpline::new(
                    &Context::default(),
                    degree,
                    knots,
                    self.points(count),
                    self.below(4) == 0,
                )?))
            }
        }
    }

    fn piecewise<const D: usize>(&mut self) -> Result<Piecewise<D>, Error> {
        let (segments, order) = (1 + self.below(4), self.below(5));
        let bases = match self.below(2) {
            0 => Bases::Common(self.basis()?),
            _ => Bases::PerSegment((0..segments).map(|_| self.basis()).collect::<Result<_, _>>()?),
        };
        let breaks = Breaks::new(&Context::default(), self.increasing(segments + 1))?;
        Piecewise::new(
            &Context::default(),
            bases,
            order,
            breaks,
            self.below(4) == 0,
            self.points(segments * order + 1),
        )
    }
}
