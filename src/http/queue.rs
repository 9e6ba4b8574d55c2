//! Who is computed next, and who is let in: by expected time, not by heads.
//!
//! A computation is due when it has arrived plus `AGEING` times what it is expected to take, and
//! the one due first is computed first: a short one passes long ones that came a little before it,
//! and no one waits for those that come much later. One that finds all workers busy is let in where
//! waiting and computing are expected to take a share of the deadline; the rest of it is room for
//! those that pass and for what takes longer than expected.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::time::Duration;

use super::rates::Rates;
use crate::api::cost::Cost;
use crate::core::cancellation::Cancellation;

/// How much later than itself a computation may be passed, in its own expected time.
const AGEING: u32 = 4;

/// What waits and what runs. Times are since some beginning.
#[derive(Debug)]
pub struct Queue<T> {
    workers: usize,
    /// The most that wait.
    most: usize,
    /// The longest that waiting and computing may be expected to take.
    patience: Duration,
    waiting: BinaryHeap<Waiting<T>>,
    running: Vec<Running>,
    rates: Rates,
    number: u64,
}

#[derive(Debug)]
struct Waiting<T> {
    due: Duration,
    /// In the order of arrival.
    number: u64,
    cost: Cost,
    cancel: Cancellation,
    task: T,
}

#[derive(Debug)]
struct Running {
    number: u64,
    since: Duration,
    cost: Cost,
}

/// What a worker takes, and gives back when it is done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ticket(u64);

impl<T> PartialEq for Waiting<T> {
    fn eq(&self, other: &Self) -> bool {
        self.number == other.number
    }
}

impl<T> Eq for Waiting<T> {}

impl<T> PartialOrd for Waiting<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The heap has its largest on top: who is due first.
impl<T> Ord for Waiting<T> {
    fn cmp(&self, other: &Self) -> Ordering {
        (other.due, other.number).cmp(&(self.due, self.number))
    }
}

impl<T> Queue<T> {
    /// For so many workers.
    pub fn new(workers: usize, most: usize, patience: Duration) -> Self {
        Queue {
            workers,
            most,
            patience,
            waiting: BinaryHeap::new(),
            running: Vec::new(),
            rates: Rates::default(),
            number: 0,
        }
    }

    /// How many wait.
    pub fn waiting(&self) -> usize {
        self.waiting.len()
    }

    /// How many run.
    pub fn running(&self) -> usize {
        self.running.len()
    }

    /// How many workers have nothing to do.
    pub fn idle(&self) -> usize {
        self.workers.saturating_sub(self.running.len() + self.waiting.len())
    }

    fn due(&self, cost: &Cost, now: Duration) -> Duration {
        now.saturating_add(self.rates.expected(cost).saturating_mul(AGEING))
    }

    /// What is expected to be left of what runs. What takes longer than expected is expected to
    /// take as long again as it is late.
    fn left(&self, running: &Running, now: Duration) -> Duration {
        self.rates.expected(&running.cost).abs_diff(now.saturating_sub(running.since))
    }

    /// How long until a worker takes what is due then.
    fn wait(&self, due: Duration, now: Duration) -> Duration {
        let running = self.running.iter().map(|running| self.left(running, now));
        let before = self
            .waiting
            .iter()
            .filter(|waiting| waiting.due <= due)
            .map(|waiting| self.rates.expected(&waiting.cost));
        let all = running.chain(before).fold(Duration::ZERO, Duration::saturating_add);
        all / self.workers.max(1) as u32
    }

    /// How long until all that is here is computed.
    pub fn expected_wait(&self, now: Duration) -> Duration {
        self.wait(Duration::MAX, now)
    }

    /// Whether one more of this cost would be let in.
    pub fn has_room(&self, cost: &Cost, now: Duration) -> bool {
        let in_time = || {
            self.wait(self.due(cost, now), now).saturating_add(self.rates.expected(cost))
                <= self.patience
        };
        self.idle() > 0 || (self.waiting.len() < self.most && in_time())
    }

    /// Lets a computation in.
    ///
    /// # Errors
    /// No room: the task comes back.
    pub fn admit(
        &mut self,
        cost: Cost,
        cancel: Cancellation,
        task: T,
        now: Duration,
    ) -> Result<(), T> {
        if !self.has_room(&cost, now) {
            return Err(task);
        }
        self.number += 1;
        self.waiting.push(Waiting {
            due: self.due(&cost, now),
            number: self.number,
            cost,
            cancel,
            task,
        });
        Ok(())
    }

    /// Takes the next.
    pub fn next(&mut self, now: Duration) -> Option<(Ticket, Cancellation, T)> {
        let Waiting { number, cost, cancel, task, .. } = self.waiting.pop()?;
        self.running.push(Running { number, since: now, cost });
        Some((Ticket(number), cancel, task))
    }

    /// What was taken is done, or was cut off.
    pub fn done(&mut self, ticket: Ticket, is_whole: bool, now: Duration) {
        if let Some(place) = self.running.iter().position(|running| running.number == ticket.0) {
            let Running { since, cost, .. } = self.running.swap_remove(place);
            self.rates.learn(&cost, now.saturating_sub(since), is_whole);
        }
    }

    /// Takes out what nobody waits for any more.
    pub fn clear(&mut self) -> Vec<T> {
        let all = std::mem::take(&mut self.waiting).into_vec();
        let (gone, kept): (Vec<_>, Vec<_>) =
            all.into_iter().partition(|waiting| waiting.cancel.is_cancelled());
        self.waiting = kept.into();
        gone.into_iter().map(|waiting| waiting.task).collect()
    }

    /// After how long it is worth asking again: when what is expected is within the share of the
    /// deadline.
    pub fn retry(&self, now: Duration) -> Duration {
        self.expected_wait(now).saturating_sub(self.patience)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    /// Expected to take so many milliseconds.
    fn cost(milliseconds: f64) -> Cost {
        Cost { work: 1e6 * milliseconds, ..Cost::other() }
    }

    fn admit(
        queue: &mut Queue<&'static str>,
        milliseconds: f64,
        name: &'static str,
        now: Duration,
    ) -> bool {
        queue.admit(cost(milliseconds), Cancellation::default(), name, now).is_ok()
    }

    #[test]
    fn what_can_be_done_in_time_is_let_in_and_the_rest_is_not() {
        let mut queue = Queue::new(1, 1_000, SECOND);
        // A free worker tries anything.
        assert!(admit(&mut queue, 5_000.0, "long", Duration::ZERO));
        assert!(queue.next(Duration::ZERO).is_some());
        assert!(!admit(&mut queue, 1.0, "while it runs", Duration::ZERO));
        assert_eq!(queue.retry(Duration::ZERO), 4 * SECOND);
        let late = Duration::from_millis(4_500);
        let count = (0..1_000).take_while(|_| admit(&mut queue, 10.0, "short", late)).count();
        assert_eq!(count, 50, "half a second is left of the first");
        assert_eq!(queue.expected_wait(late), SECOND);
    }

    #[test]
    fn heads_are_counted_too() {
        let mut queue = Queue::new(1, 2, SECOND);
        let count = (0..10).take_while(|_| admit(&mut queue, 1.0, "short", Duration::ZERO)).count();
        assert_eq!(count, 2);
        assert!(queue.next(Duration::ZERO).is_some());
        assert!(admit(&mut queue, 1.0, "short", Duration::ZERO));
    }

    #[test]
    fn short_ones_pass_long_ones_and_long_ones_are_not_passed_for_ever() {
        let mut queue = Queue::new(1, 100, 100 * SECOND);
        admit(&mut queue, 1_000.0, "long", Duration::ZERO);
        admit(&mut queue, 1.0, "soon after", SECOND);
        admit(&mut queue, 1.0, "after that", SECOND);
        admit(&mut queue, 1.0, "much later", 5 * SECOND);
        let order: Vec<_> =
            std::iter::from_fn(|| queue.next(5 * SECOND)).map(|(.., name)| name).collect();
        assert_eq!(order, ["soon after", "after that", "long", "much later"]);
    }

    #[test]
    fn a_short_one_is_let_in_past_long_ones_that_fill_the_queue() {
        let mut queue = Queue::new(1, 100, SECOND);
        admit(&mut queue, 1.0, "running", Duration::ZERO);
        queue.next(Duration::ZERO);
        while admit(&mut queue, 300.0, "long", Duration::ZERO) {}
        assert!(admit(&mut queue, 1.0, "short", Duration::ZERO));
        assert_eq!(queue.next(Duration::ZERO).unwrap().2, "short");
    }

    #[test]
    fn what_is_measured_counts() {
        let mut queue = Queue::new(1, 1_000, SECOND);
        let mut now = Duration::ZERO;
        for _ in 0..100 {
            assert!(admit(&mut queue, 1.0, "slower than thought", now));
            let (ticket, ..) = queue.next(now).unwrap();
            now += 100 * Duration::from_millis(1);
            queue.done(ticket, true, now);
        }
        let count =
            (0..1_000).take_while(|_| admit(&mut queue, 1.0, "slower than thought", now)).count();
        assert!((10..=11).contains(&count), "{count} of a tenth of a second each in a second");
    }

    #[test]
    fn what_nobody_waits_for_makes_room() {
        let mut queue = Queue::new(1, 2, SECOND);
        let cancel = Cancellation::default();
        assert!(queue.admit(cost(1.0), cancel.clone(), "gone", Duration::ZERO).is_ok());
        assert!(
            admit(&mut queue, 1.0, "stays", Duration::ZERO)
                && !admit(&mut queue, 1.0, "refused", Duration::ZERO)
        );
        cancel.cancel();
        assert_eq!(queue.clear(), ["gone"]);
        assert_eq!(queue.next(Duration::ZERO).unwrap().2, "stays");
        assert!(queue.next(Duration::ZERO).is_none());
    }
}
