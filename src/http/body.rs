//! An answer as the body of a response.

use std::convert::Infallible;
use std::pin::Pin;
use std::task::{Context, Poll};

use axum::body::Body;
use axum::http::{HeaderValue, header};
use axum::response::{IntoResponse, Response};
use bytes::Bytes;
use http_body::{Frame, SizeHint};

use crate::api::chunks::Chunks;
use crate::api::json;
use crate::api::writer::Written;

/// An answer of JSON.
#[derive(Debug)]
pub struct Json<T>(pub T);

impl<T: Written> IntoResponse for Json<T> {
    fn into_response(self) -> Response {
        let kind = HeaderValue::from_static("application/json");
        json::to_bytes(&self.0).map(|text| ([(header::CONTENT_TYPE, kind)], text)).into_response()
    }
}

impl From<Chunks> for Body {
    fn from(mut chunks: Chunks) -> Self {
        if chunks.is_single() {
            chunks.pop().map_or_else(Body::empty, Body::from)
        } else {
            Body::new(chunks)
        }
    }
}

impl http_body::Body for Chunks {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        _: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        Poll::Ready(self.pop().map(|chunk| Ok(Frame::data(chunk))))
    }

    fn is_end_stream(&self) -> bool {
        self.is_at_end()
    }

    fn size_hint(&self) -> SizeHint {
        SizeHint::with_exact(self.len())
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::sync::Arc;

    use http_body_util::BodyExt;

    use super::*;
    use crate::api::chunks::{Buffer, CHUNK};
    use crate::api::memory::{self, Memory, Reservation};

    fn budget(chunks: usize) -> Arc<dyn Memory> {
        memory::limited(chunks * CHUNK)
    }

    #[tokio::test]
    async fn a_long_text_arrives_whole_and_frees_its_chunks() {
        let budget = budget(3);
        let mut buffer = Buffer::new(&crate::core::context::Context::default(), &budget);
        let line = [b'x'; 1000];
        (0..1000).for_each(|_| buffer.write_all(&line).unwrap());
        let chunks = buffer.finish();
        assert_eq!(chunks.len(), 1_000_000);
        let body = Body::from(chunks);
        assert_eq!(http_body::Body::size_hint(&body).exact(), Some(1_000_000));
        let whole = body.collect().await.unwrap().to_bytes();
        assert_eq!(whole.len(), 1_000_000);
        let mut all = Reservation::of(&budget);
        assert!(all.grow_to(3 * CHUNK).is_ok(), "everything is given back");
    }
}
