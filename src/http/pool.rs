//! Where computations run: threads of their own, a queue that ends, a deadline.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::sync::oneshot;
use tokio::time::{Instant, timeout_at};

use super::queue::Queue;
use crate::api::cost::Cost;
use crate::core::cancellation::Cancellation;
use crate::core::context::Context;
use crate::core::limits::Limits;
use crate::http::metrics::{Because, Metrics, Reason};

/// Threads for computations, and the queue before them.
#[derive(Debug)]
pub struct Pool {
    threads: rayon::ThreadPool,
    limits: Limits,
    line: Arc<Line>,
}

/// Why there is no result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    /// All threads are busy, and what waits is too much.
    Full,
    /// The deadline passed.
    Deadline,
    /// The computation panicked.
    Panicked,
}

/// A computation: it calls what it is given when it is done, and only then tells whoever waits.
/// Capacity is free when the core is.
struct Task(Box<Run>);

/// What a worker calls, with what is to be called at the end of the computation.
type Run = dyn FnOnce(&dyn Fn()) + Send;

/// The queue as threads share it.
#[derive(Debug)]
struct Line {
    queue: Mutex<Queue<Task>>,
    /// What times in the queue count from. Of the system's clock, which measures how long
    /// computations really take.
    begun: std::time::Instant,
    metrics: Arc<Metrics>,
}

impl std::fmt::Debug for Task {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Task")
    }
}

/// Cancels the computation of a client that has left.
struct CancelOnDrop<'a> {
    cancel: Cancellation,
    line: &'a Line,
    reason: Option<Reason>,
}

impl Drop for CancelOnDrop<'_> {
    fn drop(&mut self) {
        if let Some(reason) = self.reason {
            self.cancel.cancel();
            self.line.clear();
            self.line.metrics.cancelled.get_or_create(&Because { reason }).inc();
        }
    }
}

impl Line {
    fn now(&self) -> Duration {
        self.begun.elapsed()
    }

    fn queue(&self) -> MutexGuard<'_, Queue<Task>> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Looks at the queue or changes it, and counts what is in it.
    fn with<R>(&self, action: impl FnOnce(&mut Queue<Task>, Duration) -> R) -> R {
        let mut queue = self.queue();
        let result = action(&mut queue, self.now());
        self.metrics.queued.set(queue.waiting() as i64);
        self.metrics.running.set(queue.running() as i64);
        result
    }

    /// Computes what is due first, if anything is left: every computation let in comes with one
    /// such call.
    fn work(&self) {
        let Some((ticket, cancel, Task(task))) = self.with(Queue::next) else { return };
        let done = || self.with(|queue, now| queue.done(ticket, !cancel.is_cancelled(), now));
        task(&done);
    }

    /// Forgets what nobody waits for, and frees what it holds.
    fn clear(&self) {
        let gone = self.with(|queue, _| queue.clear());
        drop(gone);
    }
}

impl Pool {
    /// Starts the threads. At most `queue` computations wait, and where others wait one is let in
    /// only if it is expected to be done within `patience`.
    ///
    /// # Errors
    /// The system has no threads to give.
    pub fn start(
        workers: usize,
        queue: usize,
        patience: Duration,
        limits: Limits,
        metrics: Arc<Metrics>,
    ) -> Result<Self, rayon::ThreadPoolBuildError> {
        let threads = rayon::ThreadPoolBuilder::new()
            .num_threads(workers)
            .thread_name(|i| format!("compute-{i}"))
            .build()?;
        let queue = Mutex::new(Queue::new(threads.current_num_threads(), queue, patience));
        Ok(Pool {
            threads,
            limits,
            line: Arc::new(Line { queue, begun: std::time::Instant::now(), metrics }),
        })
    }

    /// What a computation on this thread is held to: the limits, and nothing ends it.
    pub fn context(&self) -> Context {
        Context::within(self.limits)
    }

    /// How many computations run at once.
    pub fn workers(&self) -> usize {
        self.threads.current_num_threads()
    }

    /// How many workers have nothing to do now.
    pub fn idle(&self) -> usize {
        self.line.queue().idle()
    }

    /// Whether one more computation of this cost would be let in now.
    pub fn has_room(&self, cost: &Cost) -> bool {
        self.line.queue().has_room(cost, self.line.now())
    }

    /// How long until all that is here now is computed.
    pub fn expected_wait(&self) -> Duration {
        self.line.queue().expected_wait(self.line.now())
    }

    /// After how long it is worth asking again.
    pub fn retry(&self) -> Duration {
        self.line.queue().retry(self.line.now())
    }

    /// Runs something of which nothing is known, as [`Pool::compute`] does.
    ///
    /// # Errors
    /// As [`Pool::compute`].
    pub async fn run<T: Send + 'static>(
        &self,
        deadline: Instant,
        job: impl FnOnce(&Context) -> T + Send + 'static,
    ) -> Result<T, Failure> {
        self.compute(Cost::other(), deadline, job).await
    }

    /// Runs a computation on a thread of the pool. It is cancelled at the deadline, and when the
    /// future is dropped.
    ///
    /// # Errors
    /// No room, too late, or a panic.
    pub async fn compute<T: Send + 'static>(
        &self,
        cost: Cost,
        deadline: Instant,
        job: impl FnOnce(&Context) -> T + Send + 'static,
    ) -> Result<T, Failure> {
        let cancel = Cancellation::default();
        let (send, receive) = oneshot::channel();
        let context = Context { limits: self.limits, cancellation: cancel.clone() };
        let task = Task(Box::new(move |done| {
            let result = catch_unwind(AssertUnwindSafe(|| job(&context)));
            done();
            // Nobody listens if the client has left.
            let _ = send.send(result);
        }));
        self.line
            .with(|queue, now| queue.admit(cost, cancel.clone(), task, now))
            .map_err(|_| Failure::Full)?;
        let mut guard = CancelOnDrop { cancel, line: &self.line, reason: Some(Reason::client) };
        let line = self.line.clone();
        self.threads.spawn(move || line.work());
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
    use tokio::task::yield_now;
    use tokio::time;

    use super::*;

    fn pool(workers: usize, queue: usize) -> Pool {
        Pool::start(workers, queue, Duration::from_secs(60), Limits::default(), Arc::default())
            .unwrap()
    }

    fn in_an_hour() -> Instant {
        Instant::now() + Duration::from_secs(3_600)
    }

    /// Runs until it is cancelled; says that it has started.
    fn endless() -> (oneshot::Receiver<()>, impl FnOnce(&Context) + Send) {
        let (says, started) = oneshot::channel();
        let job = move |context: &Context| {
            says.send(()).unwrap();
            while context.checkpoint().is_ok() {
                std::thread::yield_now();
            }
        };
        (started, job)
    }

    /// Waits until no worker has anything to do.
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
        assert_eq!(pool.run(in_an_hour(), |_| 7).await, Ok(7));
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
        let waiting = tokio::spawn(async move { second.run(in_an_hour(), |_| 2).await });
        while pool.has_room(&Cost::other()) {
            yield_now().await;
        }
        assert_eq!(pool.run(in_an_hour(), |_| 3).await, Err(Failure::Full));
        running.abort();
        assert_eq!(waiting.await.unwrap(), Ok(2));
    }

    #[tokio::test]
    async fn a_panic_is_a_failure_and_costs_no_thread() {
        let pool = pool(1, 0);
        assert_eq!(
            pool.run(in_an_hour(), |_| panic!("on purpose")).await,
            Err::<(), _>(Failure::Panicked)
        );
        until_free(&pool).await;
        assert_eq!(pool.run(in_an_hour(), |_| 7).await, Ok(7));
    }
}
