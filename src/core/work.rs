//! Whether the result of a computation is still wanted.
//!
//! A computation that can take long asks now and then, and stops when nobody waits for it any more. The question is
//! put to the thread, not passed through every signature: it changes no result, only whether there is one.

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::error::{Error, Fault};

/// Says from any thread that a computation is no longer wanted.
#[derive(Debug, Clone, Default)]
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// From now on the result is not wanted. Not to be taken back.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether it is not wanted.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
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

/// Ends a computation that nobody waits for; a few nanoseconds otherwise.
///
/// # Errors
/// [`Fault::Cancelled`].
pub fn checkpoint() -> Result<(), Error> {
    let cancelled = CURRENT.with_borrow(|current| current.as_ref().is_some_and(Cancel::is_cancelled));
    if cancelled { Err(Fault::Cancelled.into()) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
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
    fn another_thread_cancels() {
        let cancel = Cancel::default();
        let other = cancel.clone();
        run(&cancel, || {
            std::thread::spawn(move || other.cancel()).join().unwrap();
            assert_eq!(checkpoint(), Err(Fault::Cancelled.into()));
        });
    }
}
