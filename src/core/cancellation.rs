//! Says from any thread that a computation is no longer wanted.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Says from any thread that a computation is no longer wanted.
#[derive(Debug, Clone, Default)]
pub struct Cancellation(Arc<Wish>);

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

impl Cancellation {
    /// Cancelled at the first checkpoint where this is true. It is called at every checkpoint, also
    /// at those after, so that it can count them: where a computation asks does not depend on the
    /// machine, when it asks does.
    pub fn when(watch: impl Fn() -> bool + Send + Sync + 'static) -> Self {
        Cancellation(Arc::new(Wish {
            cancelled: AtomicBool::new(false),
            watch: Some(Box::new(watch)),
        }))
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
    pub(super) fn ends_here(&self) -> bool {
        if self.0.watch.as_ref().is_some_and(|watch| watch()) {
            self.cancel();
        }
        self.is_cancelled()
    }
}
