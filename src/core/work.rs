//! Whether the result of a computation is still wanted.
//!
//! A computation that can take long asks now and then, and stops when nobody waits for it any more. The question is
//! put to the thread, not passed through every signature: it changes no result, only whether there is one.

use std::cell::RefCell;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::error::{Error, Fault};

/// Says from any thread that a computation is no longer wanted.
#[derive(Debug, Clone, Default)]
pub struct Cancel(Arc<Wish>);

/// Called at every checkpoint; whether to cancel there.
type Watch = Box<dyn Fn() -> bool + Send + Sync>;

#[derive(Default)]
struct Wish {
    cancelled: AtomicBool,
    watch: Option<Watch>,
}

impl fmt::Debug for Wish {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.cancelled.fmt(f)
    }
}

impl Cancel {
    /// Cancelled at the first checkpoint where this is true. It is called at every checkpoint, also at those after, so that it can
    /// count them: where a computation asks does not depend on the machine, when it asks does.
    pub fn when(watch: impl Fn() -> bool + Send + Sync + 'static) -> Self {
        Cancel(Arc::new(Wish { cancelled: AtomicBool::new(false), watch: Some(Box::new(watch)) }))
    }

    /// From now on the result is not wanted. Not to be taken back.
    pub fn cancel(&self) {
        self.0.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether it is not wanted.
    pub fn is_cancelled(&self) -> bool {
        self.0.cancelled.load(Ordering::Relaxed)
    }

    /// Whether it is not wanted at this checkpoint.
    fn ends_here(&self) -> bool {
        if self.0.watch.as_ref().is_some_and(|watch| watch()) {
            self.cancel();
        }
        self.is_cancelled()
    }
}

thread_local! {
    static CURRENT: RefCell<Option<Cancel>> = const { RefCell::new(None) };
}

/// Runs a computation on this thread that ends early, with [`Fault::Cancelled`], once it is cancelled.
pub fn run<T>(cancel: &Cancel, computation: impl FnOnce() -> T) -> T {
    /// Puts back what was there, after a panic too.
    struct Restore(Option<Cancel>);
    impl Drop for Restore {
        fn drop(&mut self) {
            CURRENT.replace(self.0.take());
        }
    }
    let _restore = Restore(CURRENT.replace(Some(cancel.clone())));
    computation()
}

/// What ends the computation on this thread; for the threads that help it.
pub fn current() -> Cancel {
    CURRENT.with_borrow(|current| current.clone().unwrap_or_default())
}

/// Ends a computation that nobody waits for; a few nanoseconds otherwise.
///
/// # Errors
/// [`Fault::Cancelled`].
pub fn checkpoint() -> Result<(), Error> {
    let cancelled = CURRENT.with_borrow(|current| current.as_ref().is_some_and(Cancel::ends_here));
    if cancelled { Err(Fault::Cancelled.into()) } else { Ok(()) }
}

/// Asks at the first and then at every 64th of many short steps, so that asking costs nothing next to them.
#[derive(Debug, Clone, Default)]
pub struct Pace(u8);

impl Pace {
    /// One step.
    ///
    /// # Errors
    /// [`Fault::Cancelled`].
    pub fn step(&mut self) -> Result<(), Error> {
        let asks = self.0.is_multiple_of(64);
        self.0 = self.0.wrapping_add(1);
        if asks { checkpoint() } else { Ok(()) }
    }
}

/// All items of an iterator that takes long.
///
/// # Errors
/// [`Fault::Cancelled`].
pub fn collect<T>(items: impl IntoIterator<Item = T>) -> Result<Vec<T>, Error> {
    let items = items.into_iter();
    let mut all = Vec::with_capacity(items.size_hint().0);
    let mut pace = Pace::default();
    for item in items {
        pace.step()?;
        all.push(item);
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;

    use super::*;

    #[test]
    fn only_the_cancelled_computation_ends() {
        let (wanted, unwanted) = (Cancel::default(), Cancel::default());
        unwanted.cancel();
        assert!(checkpoint().is_ok());
        run(&wanted, || {
            assert!(checkpoint().is_ok());
            assert_eq!(run(&unwanted, checkpoint), Err(Fault::Cancelled.into()));
            assert!(checkpoint().is_ok());
        });
    }

    #[test]
    fn a_long_loop_asks_within_64_steps() {
        let cancel = Cancel::default();
        let mut taken = 0;
        let steps = (0..1000).inspect(|&i| {
            taken = i;
            if i == 100 {
                cancel.cancel();
            }
        });
        assert_eq!(run(&cancel, || collect(steps)), Err(Fault::Cancelled.into()));
        assert!((100..=164).contains(&taken), "{taken}");
    }

    #[test]
    fn a_watch_cancels_at_its_checkpoint_and_sees_those_after() {
        let passed = Arc::new(AtomicUsize::new(0));
        let counted = passed.clone();
        let cancel = Cancel::when(move || counted.fetch_add(1, Ordering::Relaxed) == 2);
        let outcomes = run(&cancel, || [(); 5].map(|()| checkpoint().is_ok()));
        assert_eq!(outcomes, [true, true, false, false, false]);
        assert_eq!(passed.load(Ordering::Relaxed), 5);
    }

    #[test]
    fn another_thread_cancels() {
        let cancel = Cancel::default();
        let other = cancel.clone();
        run(&cancel, || {
            std::thread::spawn(move || other.cancel()).join().unwrap();
            assert_eq!(checkpoint(), Err(Fault::Cancelled.into()));
        });
    }
}
