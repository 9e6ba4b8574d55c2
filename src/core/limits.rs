//! Every size the core accepts, in one table. The specification names the constants; they are the
//! ceilings of what an operator may allow, and checks and their messages read those of the
//! [`Context`](super::context::Context).

/// The largest request body: what 100,000 interpolated 3D points become fits.
pub const BODY_BYTES: usize = 32 * 1024 * 1024;
/// The highest polynomial degree of a segment, and the highest order of a derivative.
pub const DEGREE: usize = 64;
/// Control points of one curve: what interpolating [`DATA_POINTS`] points returns still fits.
pub const CONTROL_POINTS: usize = 400_000;
/// Points to interpolate or to fit.
pub const DATA_POINTS: usize = 100_000;
/// Samples in one answer.
pub const SAMPLES: usize = 200_000;
/// Points and vectors in one answer: samples times what is asked of each.
pub const ANSWER_POINTS: usize = 1_000_000;
/// The largest weight of a curve or surface, as a multiple of the smallest.
pub const WEIGHT_RATIO: f64 = 1e12;
/// Segments a subdivision or a fit may produce.
pub const SEGMENTS: usize = 100_000;

/// The sizes that an operator may lower.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// At most [`DEGREE`].
    pub degree: usize,
    /// At most [`CONTROL_POINTS`].
    pub control_points: usize,
    /// At most [`DATA_POINTS`].
    pub data_points: usize,
    /// At most [`SAMPLES`].
    pub samples: usize,
    /// At most [`ANSWER_POINTS`].
    pub answer_points: usize,
    /// At most [`SEGMENTS`].
    pub segments: usize,
}

/// What holds unless it was lowered.
pub const CEILING: Limits = Limits {
    degree: DEGREE,
    control_points: CONTROL_POINTS,
    data_points: DATA_POINTS,
    samples: SAMPLES,
    answer_points: ANSWER_POINTS,
    segments: SEGMENTS,
};

impl Default for Limits {
    fn default() -> Self {
        CEILING
    }
}

/// Curves in one picture.
pub const PICTURE_CURVES: usize = 64;
/// Surfaces in one picture.
pub const PICTURE_SURFACES: usize = 16;
/// Segments of all curves in one picture.
pub const PICTURE_SEGMENTS: usize = 20_000;
/// Control points of one surface in a picture.
pub const PICTURE_NET: usize = 4_225;
/// Characters of a label.
pub const LABEL: usize = 60;
/// Characters of a title.
pub const TITLE: usize = 200;
/// Pixels along one side of a picture, at least and at most.
pub const PIXELS: (usize, usize) = (120, 4_000);

/// Rows of a shape matrix must sum to 1 within this.
pub const ROW_SUM_TOLERANCE: f64 = 1e-12;
/// A basis with a larger condition number cannot be solved back to control points with 8 digits.
pub const CONDITION: f64 = 1e8;
/// Continuity is measured with this tolerance, relative to the derivatives compared, unless another
/// is given.
pub const CONTINUITY_TOLERANCE: f64 = 1e-9;
