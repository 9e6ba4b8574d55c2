//! Continuity reports on the wire.

use crate::api::wire::field::number;
use crate::core::continuity as core;
use crate::core::smoothness::Smoothness;

crate::names! {
    /// How much of a report is wanted.
    pub enum ReportStyle {
        /// Every joint.
        Full = "full",
        /// The overall class and the largest values only.
        Summary = "summary",
    }
}

crate::names! {
    /// A class of smoothness.
    pub enum Class {
        /// The segments do not meet.
        Discontinuous = "discontinuous",
        /// They meet.
        C0 = "C0",
        /// Their tangents agree.
        G1 = "G1",
        /// Their first derivatives agree.
        C1 = "C1",
        /// Their tangents and curvatures agree.
        G2 = "G2",
        /// Their first and second derivatives agree.
        C2 = "C2",
    }
}

crate::answer! {
    /// What was measured at one joint.
    pub struct Joint {
        /// The parameter of the joint.
        optional parameter: f64,
        /// The highest class met, in the order discontinuous, C0, G1, C1, G2, C2.
        required class: Class,
        /// The highest of discontinuous, C0, C1, C2 met: derivatives with respect to the parameter.
        required parametric: Class,
        /// G1 or G2 where met, else C0 or discontinuous: the shape alone.
        required geometric: Class,
        /// The distance between the two ends.
        required position_gap: f64 = number().minimum(Some(0.0)),
        /// The angle between the tangents in radians, 0 to pi; left out where a speed vanishes.
        optional tangent_angle: f64 = number().minimum(Some(0.0)).maximum(Some(std::f64::consts::PI)),
        /// The length of the difference of the first derivatives.
        required first_derivative_jump: f64 = number().minimum(Some(0.0)),
        /// The length of the difference of the second derivatives.
        required second_derivative_jump: f64 = number().minimum(Some(0.0)),
        /// The length of the difference of the curvature vectors; left out where a speed vanishes.
        optional curvature_jump: f64 = number().minimum(Some(0.0)),
    }
}
crate::nested!(answer Joint);

crate::answer! {
    /// How smoothly the segments join, measured on the curve returned.
    pub struct Continuity {
        /// The class that every joint meets; C2 for a single segment.
        required class: Class,
        /// The tolerance used: a jump of a derivative counts from this fraction of the derivative's
        /// largest control vector on the two segments, a gap from this fraction of their extent,
        /// rounding errors aside.
        required tolerance: f64,
        /// A gap allowed besides, in the unit of the coordinates, where one was given.
        optional gap_tolerance: f64,
        /// The largest value of each measure over all joints, with the lowest classes; left out for
        /// a single segment.
        optional worst: Joint,
        /// Every joint in order; for a closed curve the last is the seam, at the end parameter.
        /// Left out of a summary.
        optional joints: Vec<Joint>,
    }
}
crate::nested!(answer Continuity);

impl From<Smoothness> for Class {
    fn from(class: Smoothness) -> Self {
        match class {
            Smoothness::Discontinuous => Class::Discontinuous,
            Smoothness::C0 => Class::C0,
            Smoothness::G1 => Class::G1,
            Smoothness::C1 => Class::C1,
            Smoothness::G2 => Class::G2,
            Smoothness::C2 => Class::C2,
        }
    }
}

impl From<&core::Joint> for Joint {
    fn from(joint: &core::Joint) -> Self {
        Joint {
            parameter: Some(joint.parameter),
            class: joint.class.into(),
            parametric: joint.parametric.into(),
            geometric: joint.geometric.into(),
            position_gap: joint.position_gap,
            tangent_angle: joint.tangent_angle,
            first_derivative_jump: joint.first_derivative_jump,
            second_derivative_jump: joint.second_derivative_jump,
            curvature_jump: joint.curvature_jump,
        }
    }
}

impl Continuity {
    /// The report of an answer.
    pub fn of_core(report: &core::Report, style: ReportStyle) -> Self {
        Continuity {
            class: report.class.into(),
            tolerance: report.tolerance.relative,
            gap_tolerance: (report.tolerance.gap > 0.0).then_some(report.tolerance.gap),
            worst: report.worst().map(|joint| Joint { parameter: None, ..Joint::from(&joint) }),
            joints: (style == ReportStyle::Full)
                .then(|| report.joints.iter().map(Joint::from).collect()),
        }
    }
}
