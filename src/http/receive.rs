//! The body of a request, read within the limits of size, time and memory.

use std::pin::pin;
use std::time::Duration;

use axum::body::{Body, HttpBody};
use axum::extract::Request;
use axum::http::header;
use bytes::Bytes;
use futures_util::future::poll_immediate;
use http_body_util::BodyExt;
use tokio::time::timeout;

use super::metrics::Reason;
use super::refusal::refused;
use super::service::Service;
use crate::api::cost::Cost;
use crate::api::memory::{NoRoom, Reservation};
use crate::api::problem::{Problem, Status};

/// A body up to this size is read without being counted against the budget, and parsed where it
/// arrives.
pub const SMALL: usize = 16 * 1024;

/// A body up to this size is read and thrown away when its request is refused, if it arrives within
/// the time, so that the next request can come on the same connection: to open another costs more
/// than that.
const DISCARDED: u64 = 256 * 1024;
const DISCARDING: Duration = Duration::from_millis(5);

/// A body and the memory reserved for it.
pub struct Received {
    /// All of it.
    pub bytes: Bytes,
    _reservation: Reservation,
}

/// Reads the body of a request to an operation.
///
/// # Errors
/// Status 413, 408, 400 where it breaks off, 503 where there is no room for it or for what it asks.
pub async fn receive(request: Request, service: &Service) -> Result<Received, Problem> {
    let declared = request.body().size_hint().exact();
    if declared.is_some_and(|bytes| bytes > service.max_body as u64) {
        return Err(too_large(service));
    }
    // A long body that would find no worker is refused before it is read.
    if declared.is_none_or(|bytes| bytes > SMALL as u64) {
        let cost = Cost::of_body(request.uri().path(), declared.unwrap_or(SMALL as u64) as usize);
        if !service.pool.has_room(&cost) {
            discard(request, declared).await;
            return Err(refused(service, Reason::queue));
        }
    }
    // Most bodies have come with their head: only the others are timed.
    let mut receiving = pin!(collect(request.into_body(), declared, service));
    match poll_immediate(&mut receiving).await {
        Some(body) => body,
        None => timeout(service.body_time, receiving).await.map_err(|_| too_slow(service))?,
    }
}

/// Reads a body that nobody wants, if that is soon done and the client does not wait to be asked
/// for it.
async fn discard(request: Request, declared: Option<u64>) {
    if declared.is_some_and(|bytes| bytes <= DISCARDED)
        && !request.headers().contains_key(header::EXPECT)
    {
        let mut body = request.into_body();
        let reading = async { while let Some(Ok(_)) = body.frame().await {} };
        let _ = timeout(DISCARDING, reading).await;
    }
}

async fn collect(
    mut body: Body,
    declared: Option<u64>,
    service: &Service,
) -> Result<Received, Problem> {
    let mut reservation = Reservation::of(&service.memory);
    let mut reserve = |bytes: usize| match bytes {
        ..=SMALL => Ok(()),
        _ => reservation.grow_to(bytes).map_err(|NoRoom| refused(service, Reason::memory)),
    };
    // The length is checked by now, and the budget keeps what is only promised.
    let expected = declared.unwrap_or(0) as usize;
    reserve(expected)?;
    let mut collected: Option<Vec<u8>> = None;
    while let Some(frame) = body.frame().await {
        let Ok(data) = frame.map_err(|_| incomplete())?.into_data() else { continue };
        if collected.is_none() && data.len() as u64 == declared.unwrap_or(u64::MAX) {
            return Ok(Received { bytes: data, _reservation: reservation });
        }
        let collected = collected.get_or_insert_with(|| Vec::with_capacity(expected));
        let needed = collected.len() + data.len();
        if needed > service.max_body {
            return Err(too_large(service));
        }
        if needed > collected.capacity() {
            let capacity = (2 * collected.capacity()).max(needed).max(SMALL).min(service.max_body);
            reserve(capacity)?;
            collected.reserve_exact(capacity - collected.len());
        }
        collected.extend_from_slice(&data);
    }
    Ok(Received { bytes: collected.unwrap_or_default().into(), _reservation: reservation })
}

pub(super) fn incomplete() -> Problem {
    Problem::new(
        Status::BAD_REQUEST,
        "unreadable_body",
        "The body could not be read",
        "the body ended before all of it arrived",
    )
}

pub(super) fn too_large(service: &Service) -> Problem {
    let detail = format!("the body exceeds {} bytes; send the data in parts", service.max_body);
    Problem::new(Status::PAYLOAD_TOO_LARGE, "too_large", "Beyond a limit", detail)
}

pub(super) fn too_slow(service: &Service) -> Problem {
    let detail = format!(
        "the body did not arrive within {} s; send it faster, or in parts",
        service.body_time.as_secs_f64()
    );
    Problem::new(Status::REQUEST_TIMEOUT, "body_timeout", "The body took too long", detail)
}
