//! Memory for bodies and answers on their way, reserved before it is spent.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::api::chunks::CHUNK;
use crate::api::memory::{Limited, Memory, NoRoom};
use crate::core::context::Context;
use crate::http::metrics::Metrics;

/// How long a computation that is about to have a long answer waits for others to be sent.
const PATIENCE: Duration = Duration::from_secs(1);
/// How often it looks whether it is still wanted.
const LOOK: Duration = Duration::from_millis(10);

/// So many bytes at once, and no more.
#[derive(Debug)]
pub struct Budget {
    bytes: Limited,
    metrics: Arc<Metrics>,
    /// Computations that wait for room.
    waiting: AtomicUsize,
    /// Whether one has waited in vain, and nothing has been given back since.
    stuck: AtomicBool,
    changed: (Mutex<()>, Condvar),
}

impl Budget {
    /// A budget of this many bytes.
    pub fn new(most: usize, metrics: Arc<Metrics>) -> Arc<Self> {
        let (waiting, stuck) = (AtomicUsize::new(0), AtomicBool::new(false));
        Arc::new(Budget {
            bytes: Limited::to(most),
            metrics,
            waiting,
            stuck,
            changed: Default::default(),
        })
    }

    fn has_room(&self, bytes: usize) -> bool {
        self.bytes.has_room(bytes)
    }

    /// Blocks a worker that is about to write a long answer while those before it are being sent,
    /// for a second at most: clients that read more slowly than the workers write slow these down,
    /// and are not refused. Where a wait was in vain nobody else waits until something has been
    /// sent.
    pub fn await_room(&self, context: &Context, bytes: usize) {
        let no_need = || {
            bytes <= CHUNK
                || bytes > self.bytes.most()
                || self.has_room(bytes)
                || self.stuck.load(Ordering::Relaxed)
        };
        if no_need() {
            return;
        }
        self.waiting.fetch_add(1, Ordering::Relaxed);
        let until = Instant::now() + PATIENCE;
        let mut lock = self.changed.0.lock().unwrap_or_else(PoisonError::into_inner);
        while !no_need() && context.checkpoint().is_ok() {
            if Instant::now() >= until {
                self.stuck.store(true, Ordering::Relaxed);
            }
            lock =
                self.changed.1.wait_timeout(lock, LOOK).unwrap_or_else(PoisonError::into_inner).0;
        }
        drop(lock);
        self.waiting.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Memory for Budget {
    fn lend(&self, bytes: usize) -> Result<(), NoRoom> {
        self.bytes.lend(bytes)?;
        self.metrics.held_bytes.inc_by(bytes as i64);
        Ok(())
    }

    fn take_back(&self, bytes: usize) {
        self.bytes.take_back(bytes);
        self.metrics.held_bytes.dec_by(bytes as i64);
        if bytes == 0 {
            return;
        }
        self.stuck.store(false, Ordering::Relaxed);
        if self.waiting.load(Ordering::Relaxed) > 0 {
            self.changed.1.notify_all();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::memory::Reservation;

    #[test]
    fn what_is_dropped_is_free_again() {
        let budget: Arc<dyn Memory> = Budget::new(100, Arc::default());
        let (mut first, mut second) = (Reservation::of(&budget), Reservation::of(&budget));
        assert_eq!(first.grow_to(60), Ok(()));
        assert_eq!(first.grow_to(50), Ok(()), "less is held already");
        assert_eq!(second.grow_to(41), Err(NoRoom));
        assert_eq!(second.grow_to(40), Ok(()));
        drop(first);
        assert_eq!(second.grow_to(100), Ok(()));
        second.shrink_to(70);
        second.shrink_to(80);
        let mut third = Reservation::of(&budget);
        assert_eq!((third.grow_to(31), third.grow_to(30)), (Err(NoRoom), Ok(())));
    }

    #[test]
    fn a_long_answer_waits_for_those_before_it_to_be_sent() {
        let budget = Budget::new(4 * CHUNK, Arc::default());
        let memory: Arc<dyn Memory> = budget.clone();
        let mut before = Reservation::of(&memory);
        before.grow_to(3 * CHUNK).unwrap();
        budget.await_room(&Context::default(), CHUNK);
        budget.await_room(&Context::default(), 5 * CHUNK);
        let waits = budget.clone();
        let waiting = std::thread::spawn(move || {
            while !waits.has_room(2 * CHUNK) {
                waits.await_room(&Context::default(), 2 * CHUNK);
            }
        });
        drop(before);
        waiting.join().unwrap();
    }
}
