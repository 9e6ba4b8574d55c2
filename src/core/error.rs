//! Faults and their places: what is wrong with which argument.

use std::fmt;

use super::argument::Argument;
use super::fault::Fault;

/// One step on the way to a value: a name, or a position in a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step<N> {
    /// An argument, or whatever the floor above calls it.
    Name(N),
    /// A position, counted from 0.
    Index(usize),
}

impl From<Argument> for Step<Argument> {
    fn from(argument: Argument) -> Self {
        Step::Name(argument)
    }
}

impl<N> From<usize> for Step<N> {
    fn from(index: usize) -> Self {
        Step::Index(index)
    }
}

/// Where a fault is, from the outermost value inwards; printed as a path: `/curve/knots/3`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place<N> {
    /// Innermost step first, so that callers can add their own step on the way out.
    steps: Vec<Step<N>>,
}

impl<N> Place<N> {
    /// The value itself.
    pub const fn here() -> Self {
        Place { steps: Vec::new() }
    }

    /// The same place, seen from one level further out.
    pub fn within(mut self, step: impl Into<Step<N>>) -> Self {
        self.steps.push(step.into());
        self
    }

    /// The steps, outermost first.
    pub fn steps(&self) -> impl Iterator<Item = &Step<N>> {
        self.steps.iter().rev()
    }

    /// The same place in other names.
    pub fn renamed<M>(self, rename: impl Fn(N) -> M) -> Place<M> {
        let step = |step| match step {
            Step::Name(name) => Step::Name(rename(name)),
            Step::Index(index) => Step::Index(index),
        };
        Place { steps: self.steps.into_iter().map(step).collect() }
    }
}

impl<N: fmt::Display> fmt::Display for Place<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.steps().try_for_each(|step| match step {
            Step::Name(name) => write!(f, "/{name}"),
            Step::Index(index) => write!(f, "/{index}"),
        })
    }
}

/// One fault at its place, or several that do not depend on each other. The core names its
/// arguments; a floor above may name places and know faults of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Error<N = Argument, F = Fault> {
    /// Where the first fault is.
    pub place: Place<N>,
    /// What it is.
    pub fault: F,
    /// The other faults, each alone.
    others: Vec<Error<N, F>>,
}

/// Faults that are gathered: as many as anybody wants to read at once, and one more to know that
/// there were more.
pub const GATHERED: usize = 21;

impl<N, F> Error<N, F> {
    /// The same faults, seen from one level further out.
    pub fn at(mut self, step: impl Into<Step<N>>) -> Self
    where
        N: Clone,
    {
        let step = step.into();
        for other in &mut self.others {
            other.place.steps.push(step.clone());
        }
        self.place.steps.push(step);
        self
    }

    /// The same faults; where the outermost step of a place is a name, it is another one.
    pub fn outermost(mut self, rename: impl Fn(N) -> N + Copy) -> Self
    where
        N: Copy,
    {
        if let Some(Step::Name(name)) = self.place.steps.last_mut() {
            *name = rename(*name);
        }
        let others = std::mem::take(&mut self.others);
        self.others = others.into_iter().map(|other| other.outermost(rename)).collect();
        self
    }

    /// Every fault alone, at its own place.
    pub fn each(mut self) -> Vec<Self> {
        let others = std::mem::take(&mut self.others);
        std::iter::once(self).chain(others).collect()
    }

    /// The same faults in other words, at places with other names.
    pub fn translated<M, G>(
        self,
        fault: impl Fn(F) -> G + Copy,
        name: impl Fn(N) -> M + Copy,
    ) -> Error<M, G> {
        let others = self.others.into_iter().map(|other| other.translated(fault, name)).collect();
        Error { place: self.place.renamed(name), fault: fault(self.fault), others }
    }
}

impl<N: Clone + PartialEq, F: From<Fault> + PartialEq> Error<N, F> {
    /// Both errors in one. What nobody waits for any more says nothing else, and what is said is
    /// not said again.
    pub fn and(self, other: Self) -> Self {
        let mut all = self.each();
        let others = other.each().into_iter();
        for error in others {
            if error.is_cancelled() || (all.len() < GATHERED && !all.contains(&error)) {
                all.push(error);
            }
        }
        Error::of_all(all)
    }

    fn is_cancelled(&self) -> bool {
        self.fault == Fault::Cancelled.into()
    }

    /// One error for all of these.
    fn of_all(mut all: Vec<Self>) -> Self {
        if all.is_empty() || all.iter().any(Self::is_cancelled) {
            return F::from(Fault::Cancelled).into();
        }
        let others = all.split_off(1);
        all.pop()
            .map_or_else(|| F::from(Fault::Cancelled).into(), |first| Error { others, ..first })
    }
}

/// Two values that do not depend on each other, or what is wrong with each.
///
/// # Errors
/// Those of both.
pub fn both<A, B, N, F>(
    a: Result<A, Error<N, F>>,
    b: Result<B, Error<N, F>>,
) -> Result<(A, B), Error<N, F>>
where
    N: Clone + PartialEq,
    F: From<Fault> + PartialEq,
{
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
pub fn every<T, N, F>(
    results: impl IntoIterator<Item = Result<T, Error<N, F>>>,
) -> Result<Vec<T>, Error<N, F>>
where
    N: Clone + PartialEq,
    F: From<Fault> + PartialEq,
{
    let mut results = results.into_iter();
    let mut values = Vec::with_capacity(results.size_hint().0);
    while let Some(result) = results.next() {
        match result {
            Ok(value) => values.push(value),
            Err(error) => return Err(with_the_rest(error, results.filter_map(Result::err))),
        }
    }
    Ok(values)
}

/// The first error and those that follow it.
fn with_the_rest<N: Clone + PartialEq, F: From<Fault> + PartialEq>(
    first: Error<N, F>,
    rest: impl Iterator<Item = Error<N, F>>,
) -> Error<N, F> {
    let mut all = first.each();
    for error in rest {
        let last = error.is_cancelled();
        all.extend(error.each());
        if last || all.len() >= GATHERED {
            break;
        }
    }
    if !all.iter().any(Error::is_cancelled) {
        all.truncate(GATHERED);
    }
    Error::of_all(all)
}

impl<N, F> From<F> for Error<N, F> {
    fn from(fault: F) -> Self {
        Error { place: Place::here(), fault, others: Vec::new() }
    }
}

impl<N: fmt::Display, F: fmt::Display> fmt::Display for Error<N, F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.fault)
    }
}

impl<N: fmt::Debug + fmt::Display, F: fmt::Debug + fmt::Display> std::error::Error for Error<N, F> {}

impl Fault {
    /// The fault at a step of its own object; callers further out add theirs with
    /// [`Error::at`].
    pub fn at(self, step: impl Into<Step<Argument>>) -> Error {
        Error::from(self).at(step)
    }
}

impl Error {
    /// The same error where what was refused is no argument but computed from arguments.
    pub(crate) fn of_result(self) -> Self {
        let computed = |fault| if fault == Fault::NotFinite { Fault::Overflow } else { fault };
        self.translated(computed, |argument| argument)
    }
}

/// Adds a step to the place of an error on its way out.
pub(crate) trait Locate<T> {
    /// The same result, its error seen from one level further out.
    fn at(self, step: impl Into<Step<Argument>>) -> Result<T, Error>;

    /// The same result; what it refuses is no argument but computed from arguments.
    fn of_result(self) -> Result<T, Error>;
}

impl<T, E: Into<Error>> Locate<T> for Result<T, E> {
    fn at(self, step: impl Into<Step<Argument>>) -> Result<T, Error> {
        self.map_err(|error| error.into().at(step))
    }

    fn of_result(self) -> Result<T, Error> {
        self.map_err(|error| error.into().of_result())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_read_from_the_outside_in() {
        let error = Fault::Overflow.at(2).at(Argument::ControlPoints).at(Argument::Curve);
        assert_eq!(error.place.to_string(), "/curve/control points/2");
    }

    #[test]
    fn several_faults_keep_their_places_and_are_said_once() {
        let at = |step: usize| Fault::Overflow.at(step);
        let inner: Error = at(1).and(at(2)).at(Argument::Knots);
        let all = inner.clone().and(inner).and(at(3)).at(Argument::Curve);
        let places: Vec<String> = all.each().iter().map(|error| error.place.to_string()).collect();
        assert_eq!(places, ["/curve/knots/1", "/curve/knots/2", "/curve/3"]);
        let cancelled = at(1).and(Fault::Cancelled.into());
        assert_eq!(cancelled, Fault::Cancelled.into());
        let many = every((0..1_000_000).map(|i| if i < 3 { Ok(i) } else { Err(at(i)) }));
        assert_eq!(many.unwrap_err().each().len(), GATHERED);
        assert_eq!(both(Ok(1), Err::<(), _>(at(7))).unwrap_err(), at(7));
    }
}
