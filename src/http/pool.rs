//! Where computations run: threads of their own, a queue that ends, a deadline.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use tokio::sync::oneshot;
use tokio::time::{Instant, timeout_at};

use crate::core::work::{self, Cancel};
use crate::metrics::{Because, Metrics, Reason};

/// Threads for computations, and how many computations they take on.
#[derive(Debug)]
pub struct Pool {
    threads: rayon::ThreadPool,
    admitted: Arc<AtomicUsize>,
    /// Computations admitted at once: running and waiting.
    most: usize,
    metrics: Arc<Metrics>,
}

/// Why there is no result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    /// All threads are busy and the queue is full.
    Full,
    /// The deadline passed.
    Deadline,
    /// The computation panicked.
    Panicked,
}

/// The right to run, owned by the computation and not by whoever waits for it: capacity is free when the core is.
struct Permit(Arc<AtomicUsize>);

impl Drop for Permit {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Cancels the computation of a client that has left.
struct CancelOnDrop<'a> {
    cancel: Cancel,
    metrics: &'a Metrics,
    reason: Option<Reason>,
}

impl Drop for CancelOnDrop<'_> {
    fn drop(&mut self) {
        if let Some(reason) = self.reason {
            self.cancel.cancel();
            self.metrics.cancelled.get_or_create(&Because { reason }).inc();
        }
    }
}

impl Pool {
    /// Starts the threads.
    ///
    /// # Errors
    /// The system has none to give.
    pub fn start(workers: usize, queue: usize, metrics: Arc<Metrics>) -> Result<Self, rayon::ThreadPoolBuildError> {
        let threads = rayon::ThreadPoolBuilder::new().num_threads(workers).thread_name(|i| format!("compute-{i}")).build()?;
        Ok(Pool { threads, admitted: Arc::default(), most: workers + queue, metrics })
    }

    /// How many computations run at once.
    pub fn workers(&self) -> usize {
        self.threads.current_num_threads()
    }

    /// How many workers have nothing to do now.
    pub fn idle(&self) -> usize {
        self.workers().saturating_sub(self.admitted.load(Ordering::Relaxed))
    }

    /// Whether one more computation would be admitted now.
    pub fn has_room(&self) -> bool {
        self.admitted.load(Ordering::Relaxed) < self.most
    }

    fn admit(&self) -> Option<Permit> {
        let one_more = |admitted| (admitted < self.most).then_some(admitted + 1);
        self.admitted.fetch_update(Ordering::Relaxed, Ordering::Relaxed, one_more).ok()?;
        Some(Permit(self.admitted.clone()))
    }

    /// Runs a computation on a thread of the pool. It is cancelled at the deadline, and when the future is dropped.
    ///
    /// # Errors
    /// No room, too late, or a panic.
    pub async fn run<T: Send + 'static>(&self, deadline: Instant, job: impl FnOnce() -> T + Send + 'static) -> Result<T, Failure> {
        let permit = self.admit().ok_or(Failure::Full)?;
        let cancel = Cancel::default();
        let mut guard = CancelOnDrop { cancel: cancel.clone(), metrics: &self.metrics, reason: Some(Reason::client) };
        let (send, receive) = oneshot::channel();
        let metrics = self.metrics.clone();
        metrics.queued.inc();
        self.threads.spawn(move || {
            metrics.queued.dec();
            if cancel.is_cancelled() {
                return;
            }
            metrics.running.inc();
            let result = catch_unwind(AssertUnwindSafe(|| work::run(&cancel, job)));
            metrics.running.dec();
            drop(permit);
            // Nobody listens if the client has left.
            let _ = send.send(result);
        });
        let received = timeout_at(deadline, receive).await;
        guard.reason = if received.is_err() { Some(Reason::deadline) } else { None };
        match received {
            Err(_) => Err(Failure::Deadline),
            Ok(Ok(Ok(result))) => Ok(result),
            Ok(_) => Err(Failure::Panicked),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;
    use std::time::Duration;

    use super::*;

    fn pool(workers: usize, queue: usize) -> Pool {
        Pool::start(workers, queue, Arc::default()).unwrap()
    }

    fn soon(milliseconds: u64) -> Instant {
        Instant::now() + Duration::from_millis(milliseconds)
    }

    /// Runs until it is cancelled; says that it has started.
    fn endless(started: Arc<AtomicBool>) -> impl FnOnce() + Send {
        move || {
            started.store(true, Ordering::SeqCst);
            while work::checkpoint().is_ok() {
                std::thread::sleep(Duration::from_millis(1));
            }
        }
    }

    async fn until(what: impl Fn() -> bool) {
        while !what() {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    }

    #[tokio::test]
    async fn the_deadline_frees_the_thread() {
        let pool = pool(1, 0);
        assert_eq!(pool.run(soon(20), endless(Arc::default())).await, Err(Failure::Deadline));
        until(|| pool.has_room()).await;
        assert_eq!(pool.run(soon(10_000), || 7).await, Ok(7));
    }

    #[tokio::test]
    async fn a_client_that_leaves_frees_the_thread() {
        let pool = pool(1, 0);
        let started = Arc::new(AtomicBool::new(false));
        let run = pool.run(soon(60_000), endless(started.clone()));
        tokio::select! {
            _ = run => panic!("it has no end"),
            () = until(|| started.load(Ordering::SeqCst)) => {}
        }
        until(|| pool.has_room()).await;
    }

    #[tokio::test]
    async fn beyond_the_queue_is_refused_and_the_queue_is_served() {
        let pool = Arc::new(pool(1, 1));
        let started = Arc::new(AtomicBool::new(false));
        let (first, flag) = (pool.clone(), started.clone());
        let running = tokio::spawn(async move { first.run(soon(60_000), endless(flag)).await });
        until(|| started.load(Ordering::SeqCst)).await;
        let second = pool.clone();
        let waiting = tokio::spawn(async move { second.run(soon(60_000), || 2).await });
        until(|| !pool.has_room()).await;
        assert_eq!(pool.run(soon(60_000), || 3).await, Err(Failure::Full));
        running.abort();
        assert_eq!(waiting.await.unwrap(), Ok(2));
    }

    #[tokio::test]
    async fn a_panic_is_a_failure_and_costs_no_thread() {
        let pool = pool(1, 0);
        assert_eq!(pool.run(soon(10_000), || panic!("on purpose")).await, Err::<(), _>(Failure::Panicked));
        assert_eq!(pool.run(soon(10_000), || 7).await, Ok(7));
    }
}
