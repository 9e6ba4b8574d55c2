//! An answer as the body of a response.

use std::convert::Infallible;
use std::pin::Pin;
use std::task::{Context, Poll};

use axum::body::Body;
use bytes::Bytes;
use http_body::{Frame, SizeHint};

use crate::api::chunks::Sheets;

impl From<Sheets> for Body {
    fn from(mut sheets: Sheets) -> Self {
        if sheets.is_single() { sheets.pop().map_or_else(Body::empty, Body::from) } else { Body::new(sheets) }
    }
}

impl http_body::Body for Sheets {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(mut self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        Poll::Ready(self.pop().map(|sheet| Ok(Frame::data(sheet))))
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
    use crate::api::chunks::{Paper, SHEET};
    use crate::api::memory::{self, Memory, Reservation};

    fn budget(sheets: usize) -> Arc<dyn Memory> {
        memory::limited(sheets * SHEET)
    }

    #[tokio::test]
    async fn a_long_text_arrives_whole_and_frees_its_sheets() {
        let budget = budget(3);
        let mut paper = Paper::new(&budget);
        let line = [b'x'; 1000];
        (0..1000).for_each(|_| paper.write_all(&line).unwrap());
        let sheets = paper.finish();
        assert_eq!(sheets.len(), 1_000_000);
        let body = Body::from(sheets);
        assert_eq!(http_body::Body::size_hint(&body).exact(), Some(1_000_000));
        let whole = body.collect().await.unwrap().to_bytes();
        assert_eq!(whole.len(), 1_000_000);
        let mut all = Reservation::of(&budget);
        assert!(all.grow_to(3 * SHEET).is_ok(), "everything is given back");
    }
}
