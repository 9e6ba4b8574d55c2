//! Memory for bodies and answers, reserved before it is spent.

use std::fmt::Debug;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Whoever lends memory.
pub trait Memory: Debug + Send + Sync {
    /// Lends so many bytes.
    ///
    /// # Errors
    /// [`NoRoom`]; nothing is lent.
    fn lend(&self, bytes: usize) -> Result<(), NoRoom>;

    /// Takes so many bytes back.
    fn take_back(&self, bytes: usize);
}

/// There is no room.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoRoom;

/// Lends whatever is asked for: for a program that serves itself alone.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unlimited;

impl Memory for Unlimited {
    fn lend(&self, _: usize) -> Result<(), NoRoom> {
        Ok(())
    }

    fn take_back(&self, _: usize) {}
}

/// So many bytes at once, and no more.
#[derive(Debug)]
pub struct Limited {
    lent: AtomicUsize,
    most: usize,
}

impl Limited {
    /// This many bytes.
    pub fn to(most: usize) -> Self {
        Limited { lent: AtomicUsize::new(0), most }
    }

    /// As much as there is in all.
    pub fn most(&self) -> usize {
        self.most
    }

    /// Whether so many bytes could be lent now.
    pub fn has_room(&self, bytes: usize) -> bool {
        self.lent.load(Ordering::Relaxed).saturating_add(bytes) <= self.most
    }
}

impl Memory for Limited {
    fn lend(&self, bytes: usize) -> Result<(), NoRoom> {
        let room = |lent: usize| lent.checked_add(bytes).filter(|lent| *lent <= self.most);
        self.lent
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, room)
            .map(drop)
            .map_err(|_| NoRoom)
    }

    fn take_back(&self, bytes: usize) {
        self.lent.fetch_sub(bytes, Ordering::Relaxed);
    }
}

/// Memory with a limit.
pub fn limited(bytes: usize) -> Arc<dyn Memory> {
    Arc::new(Limited::to(bytes))
}

/// Memory without a limit.
pub fn unlimited() -> Arc<dyn Memory> {
    Arc::new(Unlimited)
}

/// Bytes reserved, given back on drop.
#[derive(Debug)]
pub struct Reservation {
    memory: Arc<dyn Memory>,
    bytes: usize,
}

impl Reservation {
    /// Nothing yet.
    pub fn of(memory: &Arc<dyn Memory>) -> Self {
        Reservation { memory: memory.clone(), bytes: 0 }
    }

    /// Reserves more, until this many bytes are held.
    ///
    /// # Errors
    /// [`NoRoom`]; what is held stays held.
    pub fn grow_to(&mut self, bytes: usize) -> Result<(), NoRoom> {
        let more = bytes.saturating_sub(self.bytes);
        self.memory.lend(more)?;
        self.bytes += more;
        Ok(())
    }

    /// Gives back what is held beyond this many bytes.
    pub fn shrink_to(&mut self, bytes: usize) {
        let less = self.bytes.saturating_sub(bytes);
        self.bytes -= less;
        self.memory.take_back(less);
    }
}

impl Drop for Reservation {
    fn drop(&mut self) {
        self.memory.take_back(self.bytes);
    }
}
