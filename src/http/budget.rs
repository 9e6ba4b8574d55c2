//! Memory for bodies and answers on their way, reserved before it is spent.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::paper::SHEET;
use crate::core::work;
use crate::metrics::Metrics;

/// How long a computation that is about to have a long answer waits for others to be sent.
const PATIENCE: Duration = Duration::from_secs(1);
/// How often it looks whether it is still wanted.
const LOOK: Duration = Duration::from_millis(10);

/// So many bytes at once, and no more.
#[derive(Debug)]
pub struct Budget {
    held: AtomicUsize,
    most: usize,
    metrics: Arc<Metrics>,
    /// Computations that wait for room.
    waiting: AtomicUsize,
    /// Whether one has waited in vain, and nothing has been given back since.
    stuck: AtomicBool,
    changed: (Mutex<()>, Condvar),
}

/// Bytes reserved, given back on drop.
#[derive(Debug)]
pub struct Reservation {
    budget: Arc<Budget>,
    bytes: usize,
}

/// There is no room.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoRoom;

impl Budget {
    /// A budget of this many bytes.
    pub fn new(most: usize, metrics: Arc<Metrics>) -> Arc<Self> {
        let (held, waiting, stuck) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicBool::new(false));
        Arc::new(Budget { held, most, metrics, waiting, stuck, changed: Default::default() })
    }

    /// One without end, for whoever serves nobody.
    pub fn unlimited() -> Arc<Self> {
        Budget::new(usize::MAX, Arc::default())
    }

    fn has_room(&self, bytes: usize) -> bool {
        self.held.load(Ordering::Relaxed).saturating_add(bytes) <= self.most
    }

    /// Blocks a worker that is about to write a long answer while those before it are being sent, for a second at most: clients that
    /// read more slowly than the workers write slow these down, and are not refused. Where a wait was in vain nobody else waits until
    /// something has been sent.
    pub fn await_room(&self, bytes: usize) {
        let no_need = || bytes <= SHEET || bytes > self.most || self.has_room(bytes) || self.stuck.load(Ordering::Relaxed);
        if no_need() {
            return;
        }
        self.waiting.fetch_add(1, Ordering::Relaxed);
        let until = Instant::now() + PATIENCE;
        let mut lock = self.changed.0.lock().unwrap_or_else(PoisonError::into_inner);
        while !no_need() && work::checkpoint().is_ok() {
            if Instant::now() >= until {
                self.stuck.store(true, Ordering::Relaxed);
            }
            lock = self.changed.1.wait_timeout(lock, LOOK).unwrap_or_else(PoisonError::into_inner).0;
        }
        drop(lock);
        self.waiting.fetch_sub(1, Ordering::Relaxed);
    }

    fn give_back(&self, bytes: usize) {
        self.held.fetch_sub(bytes, Ordering::Relaxed);
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

impl Reservation {
    /// Nothing yet.
    pub fn of(budget: &Arc<Budget>) -> Self {
        Reservation { budget: budget.clone(), bytes: 0 }
    }

    /// Reserves more, until this many bytes are held.
    ///
    /// # Errors
    /// [`NoRoom`]; what is held stays held.
    pub fn grow_to(&mut self, bytes: usize) -> Result<(), NoRoom> {
        let more = bytes.saturating_sub(self.bytes);
        let room = |held: usize| held.checked_add(more).filter(|held| *held <= self.budget.most);
        self.budget.held.fetch_update(Ordering::Relaxed, Ordering::Relaxed, room).map_err(|_| NoRoom)?;
        self.budget.metrics.held_bytes.inc_by(more as i64);
        self.bytes += more;
        Ok(())
    }

    /// Gives back what is held beyond this many bytes.
    pub fn shrink_to(&mut self, bytes: usize) {
        let less = self.bytes.saturating_sub(bytes);
        self.bytes -= less;
        self.budget.give_back(less);
    }
}

impl Drop for Reservation {
    fn drop(&mut self) {
        self.budget.give_back(self.bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_dropped_is_free_again() {
        let budget = Budget::new(100, Arc::default());
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
        let budget = Budget::new(4 * SHEET, Arc::default());
        let mut before = Reservation::of(&budget);
        before.grow_to(3 * SHEET).unwrap();
        budget.await_room(SHEET);
        budget.await_room(5 * SHEET);
        let waits = budget.clone();
        let waiting = std::thread::spawn(move || {
            while !waits.has_room(2 * SHEET) {
                waits.await_room(2 * SHEET);
            }
        });
        drop(before);
        waiting.join().unwrap();
    }
}
