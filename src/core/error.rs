//! What can be wrong with an input, and where.

use std::fmt;

/// One step on the way to a value: the name of a field, or a position in a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// A field, in the field's own terms: `knots`, `control_points`.
    Name(&'static str),
    /// A position, counted from 0.
    Index(usize),
}

impl From<&'static str> for Step {
    fn from(name: &'static str) -> Self {
        Step::Name(name)
    }
}

impl From<usize> for Step {
    fn from(index: usize) -> Self {
        Step::Index(index)
    }
}

/// Where a fault is, from the outermost object inwards; printed as a JSON Pointer (RFC 6901).
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Place {
    /// Innermost step first, so that callers can add their own step on the way out.
    steps: Vec<Step>,
}

impl Place {
    /// The same place, seen from one level further out.
    pub fn within(mut self, step: impl Into<Step>) -> Self {
        self.steps.push(step.into());
        self
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.steps.iter().rev().try_for_each(|step| match step {
            Step::Name(name) => write!(f, "/{name}"),
            Step::Index(index) => write!(f, "/{index}"),
        })
    }
}

/// A fault at a place.
#[derive(Debug, Clone, PartialEq)]
pub struct Error {
    /// Where.
    pub place: Place,
    /// What.
    pub fault: Fault,
}

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
    /// A part that the object needs is not there.
    #[error("the field `{field}` is missing")]
    Missing {
        /// Its name, or the names of those of which one is needed, with "` or `" between them.
        field: &'static str,
    },
    /// The part that says which variant of the object is meant is not there.
    #[error("the field `{field}` is missing; it is one of {values}")]
    MissingTag {
        /// Its name.
        field: &'static str,
        /// The variants.
        values: String,
    },
    /// A part that belongs to another variant of the object.
    #[error("the field `{field}` does not belong to {of}, only to {owners}")]
    ForeignField {
        /// Its name.
        field: &'static str,
        /// The variant given.
        of: &'static str,
        /// The variants that have it.
        owners: String,
    },
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
    /// A result beyond the range of double precision.
    #[error(
        "the result exceeds the range of double precision; scale the coordinates, the knots or the order of derivatives down"
    )]
    Overflow,
    /// Several faults that do not depend on each other, each at its place within this one.
    #[error("{}", .0.first().map(Error::to_string).unwrap_or_default())]
    Several(Vec<Error>),
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

impl Fault {
    /// The fault at a step of its own object; callers further out add theirs with [`At::at`].
    pub fn at(self, step: impl Into<Step>) -> Error {
        Error::from(self).at(step)
    }
}

impl Error {
    /// The same error, seen from one level further out.
    pub fn at(mut self, step: impl Into<Step>) -> Self {
        self.place = self.place.within(step);
        self
    }
}

/// Faults that are gathered: as many as anybody wants to read at once, and one more to know that
/// there were more.
pub const GATHERED: usize = 21;

impl Error {
    /// Both errors in one. What nobody waits for any more says nothing else, and what is said is
    /// not said again.
    pub fn and(self, other: Error) -> Error {
        if [&self.fault, &other.fault].contains(&&Fault::Cancelled) {
            return Fault::Cancelled.into();
        }
        let mut all = self.each();
        for error in other.each() {
            if all.len() < GATHERED && !all.contains(&error) {
                all.push(error);
            }
        }
        Error::of_all(all).unwrap_or_else(|| Fault::Cancelled.into())
    }

    /// Every fault at its own place.
    pub fn each(self) -> Vec<Error> {
        let Fault::Several(errors) = self.fault else { return vec![self] };
        let around = self.place.steps;
        let placed = |mut error: Error| {
            error.place.steps.extend(around.iter().copied());
            error.each()
        };
        errors.into_iter().flat_map(placed).collect()
    }

    /// One error for all of these; none where there are none.
    fn of_all(mut errors: Vec<Error>) -> Option<Error> {
        if errors.len() > 1 { Some(Fault::Several(errors).into()) } else { errors.pop() }
    }
}

/// Two values that do not depend on each other, or what is wrong with each.
///
/// # Errors
/// Those of both.
pub fn both<A, B>(a: Result<A, Error>, b: Result<B, Error>) -> Result<(A, B), Error> {
    match (a, b) {
        (Ok(a), Ok(b)) => Ok((a, b)),
        (Err(error), Ok(_)) | (Ok(_), Err(error)) => Err(error),
        (Err(a), Err(b)) => Err(a.and(b)),
    }
}

/// Values that do not depend on each other, or what is wrong with each.
///
/// # Errors
/// Those of all, up to [`GATHERED`].
pub fn every<T, E: Into<Error>>(
    results: impl IntoIterator<Item = Result<T, E>>,
) -> Result<Vec<T>, Error> {
    let mut results = results.into_iter();
    let mut values = Vec::with_capacity(results.size_hint().0);
    while let Some(result) = results.next() {
        match result {
            Ok(value) => values.push(value),
            Err(error) => {
                return Err(with_the_rest(
                    error.into(),
                    results.filter_map(|result| result.err().map(E::into)),
                ));
            }
        }
    }
    Ok(values)
}

/// The first error and those that follow it.
fn with_the_rest(first: Error, rest: impl Iterator<Item = Error>) -> Error {
    let mut all = first.each();
    for error in rest {
        let cancelled = error.fault == Fault::Cancelled;
        all.extend(error.each());
        if cancelled || all.len() >= GATHERED {
            break;
        }
    }
    if all.iter().any(|error| error.fault == Fault::Cancelled) {
        return Fault::Cancelled.into();
    }
    all.truncate(GATHERED);
    Error::of_all(all).unwrap_or_else(|| Fault::Cancelled.into())
}

impl From<Fault> for Error {
    fn from(fault: Fault) -> Self {
        Error { place: Place::default(), fault }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.fault)
    }
}

impl std::error::Error for Error {}

/// Adds a step to the place of an error on its way out.
pub trait At<T> {
    /// The same result, its error seen from one level further out.
    fn at(self, step: impl Into<Step>) -> Result<T, Error>;
}

impl<T, E: Into<Error>> At<T> for Result<T, E> {
    fn at(self, step: impl Into<Step>) -> Result<T, Error> {
        self.map_err(|error| error.into().at(step))
    }
}

/// Refuses a count above a limit.
pub(crate) fn at_most(
    what: &'static str,
    count: usize,
    most: usize,
    advice: &'static str,
) -> Result<(), Fault> {
    if count > most { Err(Fault::TooLarge { what, count, most, advice }) } else { Ok(()) }
}

/// Refuses a count below a minimum.
pub(crate) fn at_least(what: &'static str, count: usize, least: usize) -> Result<(), Fault> {
    if count < least { Err(Fault::TooFew { what, count, least }) } else { Ok(()) }
}

/// Refuses a list that does not increase, with the position of the first value that breaks the
/// rule.
pub(crate) fn increasing(what: &'static str, values: &[f64], strictly: bool) -> Result<(), Error> {
    for (i, pair) in values.windows(2).enumerate() {
        let (previous, value) = (pair[0], pair[1]);
        // NaN breaks the rule too, whichever side it is on.
        let in_order = if strictly { value > previous } else { value >= previous };
        if !in_order {
            return Err(Fault::NotIncreasing { what, previous, value, strictly }.at(i + 1));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_read_from_the_outside_in() {
        let error = Fault::Overflow.at(2).at("control_points").at("curve");
        assert_eq!(error.place.to_string(), "/curve/control_points/2");
    }

    #[test]
    fn several_faults_keep_their_places_and_are_said_once() {
        let at = |step: usize| Fault::Overflow.at(step);
        let inner: Error = at(1).and(at(2)).at("knots");
        let all = inner.clone().and(inner).and(at(3)).at("curve");
        let places: Vec<String> = all.each().iter().map(|error| error.place.to_string()).collect();
        assert_eq!(places, ["/curve/knots/1", "/curve/knots/2", "/curve/3"]);
        let cancelled = at(1).and(Fault::Cancelled.into());
        assert_eq!(cancelled, Fault::Cancelled.into());
        let many = every((0..1_000_000).map(|i| if i < 3 { Ok(i) } else { Err(at(i)) }));
        assert_eq!(many.unwrap_err().each().len(), GATHERED);
        assert_eq!(both(Ok(1), Err::<(), _>(at(7))).unwrap_err(), at(7));
    }

    #[test]
    fn increasing_names_the_first_offender() {
        let error = increasing("knots", &[0.0, 1.0, 1.0, 0.5], true).unwrap_err();
        assert_eq!(error.place.to_string(), "/2");
        let error = increasing("knots", &[0.0, 1.0, 1.0, 0.5], false).unwrap_err();
        assert_eq!(error.place.to_string(), "/3");
    }
}
