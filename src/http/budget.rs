//! Memory for bodies and answers on their way, reserved before it is spent.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::metrics::Metrics;

/// So many bytes at once, and no more.
#[derive(Debug)]
pub struct Budget {
    held: AtomicUsize,
    most: usize,
    metrics: Arc<Metrics>,
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
        Arc::new(Budget { held: AtomicUsize::new(0), most, metrics })
    }

    /// One without end, for whoever serves nobody.
    pub fn unlimited() -> Arc<Self> {
        Budget::new(usize::MAX, Arc::default())
    }

    fn give_back(&self, bytes: usize) {
        self.held.fetch_sub(bytes, Ordering::Relaxed);
        self.metrics.held_bytes.dec_by(bytes as i64);
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
}
