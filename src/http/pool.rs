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
    use std::time::Duration;

    use tokio::task::yield_now;
    use tokio::time;

    use super::*;

    fn pool(workers: usize, queue: usize) -> Pool {
        Pool::start(workers, queue, Arc::default()).unwrap()
    }

    fn in_an_hour() -> Instant {
        Instant::now() + Duration::from_secs(3_600)
    }

    /// Runs until it is cancelled; says that it has started.
    fn endless() -> (oneshot::Receiver<()>, impl FnOnce() + Send) {
        let (says, started) = oneshot::channel();
        let job = move || {
            says.send(()).unwrap();
            while work::checkpoint().is_ok() {
                std::thread::yield_now();
            }
        };
        (started, job)
    }

    async fn until_free(pool: &Pool) {
        while pool.idle() < pool.workers() {
            yield_now().await;
        }
    }

    /// The clock stands still until nothing but time can go on: an hour is over at once.
    #[tokio::test(start_paused = true)]
    async fn the_deadline_frees_the_thread() {
        let pool = pool(1, 0);
        let (_started, job) = endless();
        assert_eq!(pool.run(in_an_hour(), job).await, Err(Failure::Deadline));
        until_free(&pool).await;
        time::resume();
        assert_eq!(pool.run(in_an_hour(), || 7).await, Ok(7));
    }

    #[tokio::test]
    async fn a_client_that_leaves_frees_the_thread() {
        let pool = pool(1, 0);
        let (started, job) = endless();
        tokio::select! {
            _ = pool.run(in_an_hour(), job) => panic!("it has no end"),
            started = started => started.unwrap(),
        }
        until_free(&pool).await;
    }

    #[tokio::test]
    async fn beyond_the_queue_is_refused_and_the_queue_is_served() {
        let pool = Arc::new(pool(1, 1));
        let (started, job) = endless();
        let first = pool.clone();
        let running = tokio::spawn(async move { first.run(in_an_hour(), job).await });
        started.await.unwrap();
        let second = pool.clone();
        let waiting = tokio::spawn(async move { second.run(in_an_hour(), || 2).await });
        while pool.has_room() {
            yield_now().await;
        }
        assert_eq!(pool.run(in_an_hour(), || 3).await, Err(Failure::Full));
        running.abort();
        assert_eq!(waiting.await.unwrap(), Ok(2));
    }

    #[tokio::test]
    async fn a_panic_is_a_failure_and_costs_no_thread() {
        let pool = pool(1, 0);
        assert_eq!(pool.run(in_an_hour(), || panic!("on purpose")).await, Err::<(), _>(Failure::Panicked));
        until_free(&pool).await;
        assert_eq!(pool.run(in_an_hour(), || 7).await, Ok(7));
    }
}
