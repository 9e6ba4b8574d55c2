//! Why a request has no result.

use super::metrics::Reason;
use super::pool::Failure;
use super::service::Service;
use crate::api::problem::{Problem, Status};

/// There is no room now; counts it.
pub(super) fn refused(service: &Service, reason: Reason) -> Problem {
    service.metrics.shed(reason);
    match reason {
        Reason::memory => Problem::overloaded("the memory for bodies and answers is in use"),
        _ => Problem::overloaded("all workers are busy, and what waits for them is too much")
            .for_about(service.pool.retry()),
    }
}

/// The problem of a computation without a result; counts it.
pub(super) fn failed(service: &Service, failure: Failure) -> Problem {
    match failure {
        Failure::Full => refused(service, Reason::queue),
        Failure::Deadline => {
            let detail = format!(
                "the answer was not ready within {} s; ask for less at once, or try again later",
                service.deadline.as_secs_f64()
            );
            Problem::new(Status::GATEWAY_TIMEOUT, "deadline", "The deadline has passed", detail)
        }
        Failure::Panicked => {
            service.metrics.panics.inc();
            Problem::internal()
        }
    }
}
