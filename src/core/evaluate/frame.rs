//! The moving frame: tangent, normal, curvature, torsion and speed.

use super::Quantities;
use crate::core::point::Point;

/// The quantities of [`Quantities`], each empty unless asked for, and where they do not exist.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Frames<const D: usize> {
    /// Unit tangents; zero where undefined.
    pub tangents: Vec<Point<D>>,
    /// Unit normals; zero where undefined.
    pub normals: Vec<Point<D>>,
    /// Curvatures; 0 where undefined.
    pub curvatures: Vec<f64>,
    /// Torsions; 0 where undefined.
    pub torsions: Vec<f64>,
    /// Speeds.
    pub speeds: Vec<f64>,
    /// The samples at which a quantity asked for does not exist.
    pub degenerate: Vec<Degenerate>,
}

/// A sample at which the frame is not defined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Degenerate {
    /// Position in the list of parameters.
    pub index: usize,
    /// Whether the speed is zero, within rounding: then only the speed exists. Otherwise the curve
    /// is straight there to second order: a curve in space has no normal and no torsion.
    pub zero_speed: bool,
}

/// The moving frame at one parameter; what does not exist is `None`.
pub(super) struct MovingFrame<const D: usize> {
    speed: f64,
    tangent: Option<Point<D>>,
    normal: Option<Point<D>>,
    curvature: Option<f64>,
    torsion: Option<f64>,
}

impl<const D: usize> MovingFrame<D> {
    /// From the first three derivatives and the rounding errors of the first two.
    pub(super) fn new([first, second, third]: [Point<D>; 3], rounding: [f64; 2]) -> Self {
        let speed = first.norm();
        let tangent = if speed > rounding[0] { first.unit() } else { None };
        let Some(t) = tangent else {
            return MovingFrame {
                speed,
                tangent: None,
                normal: None,
                curvature: None,
                torsion: None,
            };
        };
        // The part of the second derivative across the tangent: curvature times speed squared.
        let across = second.across(t);
        let bend = across.norm();
        if D == 2 {
            let left = Self::left_of(t);
            let curvature = left.dot(second) / speed / speed;
            return MovingFrame {
                speed,
                tangent,
                normal: Some(left),
                curvature: Some(curvature),
                torsion: None,
            };
        }
        let normal = if bend > rounding[1] { across.unit() } else { None };
        let torsion = normal.map(|n| triple(t, n, third) / bend / speed);
        MovingFrame { speed, tangent, normal, curvature: Some(bend / speed / speed), torsion }
    }

    /// A vector of the plane turned left by 90 degrees.
    fn left_of(vector: Point<D>) -> Point<D> {
        let mut left = Point::ZERO;
        left[0] = -vector[1];
        left[1] = vector[0];
        left
    }
}

/// The determinant of three vectors of space; 0 in the plane.
fn triple<const D: usize>(a: Point<D>, b: Point<D>, c: Point<D>) -> f64 {
    if D != 3 {
        return 0.0;
    }
    a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

impl<const D: usize> Frames<D> {
    pub(super) fn push(&mut self, index: usize, frame: MovingFrame<D>, wanted: Quantities) {
        let vector = |list: &mut Vec<Point<D>>, asked: bool, value: Option<Point<D>>| {
            if asked {
                list.push(value.unwrap_or(Point::ZERO));
            }
            asked && value.is_none()
        };
        let number = |list: &mut Vec<f64>, asked: bool, value: Option<f64>| {
            if asked {
                list.push(value.unwrap_or(0.0));
            }
            asked && value.is_none()
        };
        let missing = [
            vector(&mut self.tangents, wanted.tangent, frame.tangent),
            vector(&mut self.normals, wanted.normal, frame.normal),
            number(&mut self.curvatures, wanted.curvature, frame.curvature),
            number(&mut self.torsions, wanted.torsion, frame.torsion),
            number(&mut self.speeds, wanted.speed, Some(frame.speed)),
        ];
        if missing.contains(&true) {
            self.degenerate.push(Degenerate { index, zero_speed: frame.tangent.is_none() });
        }
    }
}
