//! How long work really takes here, learnt from the computations that have ended.

use std::time::Duration;

use crate::api::cost::{Cost, KINDS};

/// An observation counts for as much as the last few together.
const WEIGHT: f64 = 1.0 / 8.0;

/// For each kind the time that a nanosecond of the formula takes: an average that forgets.
#[derive(Debug)]
pub struct Rates([Rate; KINDS]);

#[derive(Debug, Clone, Copy)]
struct Rate {
    factor: f64,
    seen: u32,
}

impl Default for Rates {
    fn default() -> Self {
        Rates([Rate { factor: 1.0, seen: 0 }; KINDS])
    }
}

impl Rates {
    /// How long it is expected to take.
    pub fn expected(&self, cost: &Cost) -> Duration {
        Duration::try_from_secs_f64(cost.work * self.0[cost.kind as usize].factor * 1e-9)
            .unwrap_or(Duration::MAX / 1_000_000)
    }

    /// How long it took. What was cut off took longer than that, and tells something only where it
    /// should have ended before.
    pub fn learn(&mut self, cost: &Cost, took: Duration, is_whole: bool) {
        if !is_whole && took <= self.expected(cost) {
            return;
        }
        let rate = &mut self.0[cost.kind as usize];
        // The first count for more, as nothing is known yet.
        let weight = WEIGHT.max(1.0 / f64::from(rate.seen + 2));
        rate.factor += weight * (took.as_secs_f64() * 1e9 / cost.work - rate.factor);
        rate.seen = rate.seen.saturating_add(1).min(1_000);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_seen_is_expected_before_long_and_what_was_cut_off_is_not_taken_for_fast() {
        let (mut rates, cost) = (Rates::default(), Cost::other());
        let second = Duration::from_secs(1);
        rates.learn(&cost, Duration::from_nanos(1), false);
        assert_eq!(rates.expected(&cost), Duration::from_millis(1));
        (0..40).for_each(|_| rates.learn(&cost, second, true));
        let expected = rates.expected(&cost);
        assert!(expected > second * 9 / 10 && expected <= second, "{expected:?}");
        rates.learn(&cost, 10 * second, false);
        assert!(rates.expected(&cost) > 2 * second);
        assert_eq!(
            rates.expected(&Cost::of_batch(20_000)),
            Duration::from_millis(1),
            "another kind"
        );
    }
}
