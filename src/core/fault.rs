//! What can be wrong with the arguments of the core.

use std::fmt;

/// What the mathematics, or a limit, forbids. The text says what is wrong, what is allowed and what
/// to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Fault {
    /// Fewer of something than the operation needs.
    #[error("the number of {what} is {count}; at least {least} are needed")]
    TooFew {
        /// What is counted.
        what: &'static str,
        /// How many there are.
        count: usize,
        /// How many are needed.
        least: usize,
    },
    /// More of something than the documented limit, given or asked for.
    #[error("the number of {what} is {count}; the limit is {most}. {advice}")]
    TooLarge {
        /// What is counted.
        what: &'static str,
        /// How many there are, or would be.
        count: usize,
        /// The limit.
        most: usize,
        /// What to do.
        advice: &'static str,
    },
    /// Two counts that must agree do not.
    #[error("the number of {what} is {count}; expected is {expected}: {rule}")]
    WrongCount {
        /// What is counted.
        what: &'static str,
        /// How many there are.
        count: usize,
        /// How many there must be.
        expected: usize,
        /// Why.
        rule: &'static str,
    },
    /// A number outside its range.
    #[error("{what} is {}; allowed is {allowed}", Shown(*.value))]
    OutOfRange {
        /// What the number is.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The range, in words.
        allowed: String,
    },
    /// A list that must increase does not.
    #[error("{what} must {}: {value:?} follows {previous:?}", if *.strictly { "increase strictly" } else { "not decrease" })]
    NotIncreasing {
        /// What the list holds.
        what: &'static str,
        /// The value before.
        previous: f64,
        /// The value that is too small.
        value: f64,
        /// Whether equal neighbours are refused too.
        strictly: bool,
    },
    /// Two neighbouring points coincide where their distance is needed.
    #[error(
        "this point repeats the one before it, so the {parameterization} parameterization gives both the same parameter; \
         remove it, or use the uniform parameterization or given knots{}",
        if *.closing { " (a closed curve does not repeat its first point at the end)" } else { "" }
    )]
    RepeatedPoint {
        /// The parameterization that divides by the distance.
        parameterization: &'static str,
        /// Whether the two are the last and the first point of a closed curve.
        closing: bool,
    },
    /// The basis cannot be used this way.
    #[error("{0}")]
    UnsuitableBasis(String),
    /// The curve cannot be used this way.
    #[error("{0}")]
    UnsuitableCurve(String),
    /// Text that cannot be drawn.
    #[error("{0}")]
    UnsuitableText(String),
    /// Options that exclude each other.
    #[error("{0}")]
    Contradiction(String),
    /// A shape matrix without full rank.
    #[error(
        "the shape matrix has rank {rank}, but {columns} control points need rank {columns}: \
         some control points cannot be told apart on the curve"
    )]
    ShapeRank {
        /// The numerical rank.
        rank: usize,
        /// Columns of the matrix.
        columns: usize,
    },
    /// A row of a shape matrix that does not sum to 1.
    #[error(
        "this row sums to {sum:?}; every row of a shape matrix sums to 1 (within 1e-12), so that the curve moves with its points"
    )]
    RowSum {
        /// The sum found.
        sum: f64,
    },
    /// The basis is too ill-conditioned to solve for control points.
    #[error(
        "the shape matrix has condition number {condition:.1e}; above {:.0e} its control points cannot be computed to 8 digits. \
         Use the bezier form or basis, or a shape parameter closer to the Bezier case",
        super::limits::CONDITION
    )]
    IllConditioned {
        /// The 2-norm condition number of the shape matrix.
        condition: f64,
    },
    /// A least-squares problem with more than one solution.
    #[error("{0}")]
    RankDeficient(String),
    /// A tolerance that rounding errors alone exceed.
    #[error(
        "tolerance {tolerance:?} is below what double precision can show for coordinates this large; use at least {least:.1e}"
    )]
    ToleranceTooSmall {
        /// The tolerance asked for.
        tolerance: f64,
        /// The smallest that can be proved.
        least: f64,
    },
    /// No curve of the wanted kind comes within the tolerance.
    #[error(
        "no curve of this kind meets the tolerance {tolerance:?}: the best found, with {segments} segments, has error {best:?}. {advice}"
    )]
    ToleranceNotMet {
        /// The tolerance asked for.
        tolerance: f64,
        /// The smallest maximum error reached.
        best: f64,
        /// Segments of that curve.
        segments: usize,
        /// What to do.
        advice: &'static str,
    },
    /// A number that is infinite or not a number.
    #[error("this is not a finite number; every number must be finite")]
    NotFinite,
    /// A result beyond the range of double precision.
    #[error(
        "the result exceeds the range of double precision; scale the coordinates, the knots or the order of derivatives down"
    )]
    Overflow,
    /// Nobody waits for the result: see [`Context`](super::context::Context).
    #[error("the computation was stopped before its end, because nobody waited for it any more")]
    Cancelled,
}

/// A number as a client would write it: whole numbers without a fraction, small and large ones with
/// an exponent.
struct Shown(f64);

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = format!("{:?}", self.0);
        f.write_str(text.strip_suffix(".0").unwrap_or(&text))
    }
}
