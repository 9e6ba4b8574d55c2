//! What a computation is held to.
//!
//! A computation that can take long asks now and then whether its result is still wanted, and stops
//! when it is not. That changes no result, only whether there is one.

use super::cancellation::Cancellation;
use super::error::Error;
use super::fault::Fault;
use super::limits::Limits;

/// The limits of a computation, and whether its result is still wanted.
///
/// ```
/// use springline::core::basis::{Basis, Bezier};
/// use springline::core::context::Context;
/// use springline::core::curve::Single;
/// use springline::core::limits::Limits;
/// use springline::core::point::Point;
///
/// let wide = Context::default();
/// let narrow = Context::within(Limits { degree: 3, ..Limits::default() });
/// let points = vec![Point([0.0, 0.0]); 5];
/// assert!(Single::new(&wide, Basis::Bezier(Bezier), points.clone()).is_ok());
/// let error = Single::new(&narrow, Basis::Bezier(Bezier), points).unwrap_err();
/// assert_eq!(error.place.to_string(), "/control points");
/// ```
#[derive(Debug, Clone, Default)]
pub struct Context {
    /// How large input and result may be.
    pub limits: Limits,
    /// Ends it early.
    pub cancellation: Cancellation,
}

impl Context {
    /// With these limits, never cancelled.
    pub fn within(limits: Limits) -> Self {
        Context { limits, ..Context::default() }
    }

    /// With the widest limits, ended by this.
    pub fn until(cancellation: &Cancellation) -> Self {
        Context { cancellation: cancellation.clone(), ..Context::default() }
    }

    /// Ends a computation that nobody waits for; a few nanoseconds otherwise.
    ///
    /// # Errors
    /// [`Fault::Cancelled`].
    pub fn checkpoint(&self) -> Result<(), Error> {
        if self.cancellation.ends_here() { Err(Fault::Cancelled.into()) } else { Ok(()) }
    }

    /// Many short steps, at some of which it asks.
    pub fn pace(&self) -> Pace<'_> {
        Pace { context: self, steps: 0 }
    }

    /// All items of an iterator that takes long.
    ///
    /// # Errors
    /// [`Fault::Cancelled`].
    pub fn collect<T>(&self, items: impl IntoIterator<Item = T>) -> Result<Vec<T>, Error> {
        let items = items.into_iter();
        let mut all = Vec::with_capacity(items.size_hint().0);
        let mut pace = self.pace();
        for item in items {
            pace.step()?;
            all.push(item);
        }
        Ok(all)
    }
}

/// Asks at the first and then at every 64th of many short steps, so that asking costs nothing next
/// to them.
#[derive(Debug, Clone)]
pub struct Pace<'a> {
    context: &'a Context,
    steps: u8,
}

impl Pace<'_> {
    /// One step.
    ///
    /// # Errors
    /// [`Fault::Cancelled`].
    pub fn step(&mut self) -> Result<(), Error> {
        let asks = self.steps.is_multiple_of(64);
        self.steps = self.steps.wrapping_add(1);
        if asks { self.context.checkpoint() } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn a_long_loop_asks_within_64_steps() {
        let context = Context::default();
        let mut taken = 0;
        let steps = (0..1000).inspect(|&i| {
            taken = i;
            if i == 100 {
                context.cancellation.cancel();
            }
        });
        assert_eq!(context.collect(steps), Err(Fault::Cancelled.into()));
        assert!((100..=164).contains(&taken), "{taken}");
    }

    #[test]
    fn a_watch_cancels_at_its_checkpoint_and_sees_those_after() {
        let passed = Arc::new(AtomicUsize::new(0));
        let counted = passed.clone();
        let context = Context::until(&Cancellation::when(move || {
            counted.fetch_add(1, Ordering::Relaxed) == 2
        }));
        let outcomes = [(); 5].map(|()| context.checkpoint().is_ok());
        assert_eq!(outcomes, [true, true, false, false, false]);
        assert_eq!(passed.load(Ordering::Relaxed), 5);
    }

    #[test]
    fn another_thread_cancels() {
        let context = Context::default();
        let other = context.cancellation.clone();
        std::thread::spawn(move || other.cancel()).join().unwrap();
        assert_eq!(context.checkpoint(), Err(Fault::Cancelled.into()));
    }
}
