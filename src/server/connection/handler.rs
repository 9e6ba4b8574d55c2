//! The app behind a connection, told of its phases.

use std::convert::Infallible;
use std::pin::Pin;
use std::task::{Context, Poll};

use axum::body::Body;
use axum::http::{HeaderValue, Request, Response, header};
use bytes::Bytes;
use http_body::{Body as _, Frame, SizeHint};
use hyper::body::Incoming;
use hyper::service::Service;
use tokio::sync::watch;
use tower::ServiceExt;

use super::App;
use super::progress::{Phase, Progress};
use crate::http::batch::Streaming;
use crate::http::request_id::{REQUEST_ID, RequestId};
use crate::server::Stage;

/// The app, told of the phases.
pub(super) struct Handler<A> {
    pub(super) app: A,
    pub(super) progress: Progress,
    pub(super) stage: watch::Receiver<Stage>,
}

impl<A: App> Service<Request<Incoming>> for Handler<A> {
    type Response = Response<Sent>;
    type Error = Infallible;
    type Future = Pin<Box<dyn Future<Output = Result<Self::Response, Infallible>> + Send>>;

    fn call(&self, request: Request<Incoming>) -> Self::Future {
        self.progress.enter(Phase::Request);
        {
            let mut state = self.progress.state();
            (state.unread, state.answered) = (!request.body().is_end_stream(), None);
        }
        let (app, progress, stage) = (self.app.clone(), self.progress.clone(), self.stage.clone());
        Box::pin(async move {
            let arriving = |body| Body::new(Arriving { body, progress: progress.clone() });
            let mut response = app.oneshot(request.map(arriving)).await?;
            let is_stream = response.extensions().get::<Streaming>().is_some();
            progress.enter(if is_stream { Phase::Stream } else { Phase::Answer });
            progress.state().answered = response.headers().get(&REQUEST_ID).cloned().map(RequestId);
            // After a body that nobody reads, no further request can be told from its rest.
            if *stage.borrow() != Stage::Serving || progress.state().unread {
                response
                    .headers_mut()
                    .insert(header::CONNECTION, HeaderValue::from_static("close"));
            }
            Ok(response.map(|body| Sent { body, progress }))
        })
    }
}

/// The body of a request; notes when it is read.
struct Arriving {
    body: Incoming,
    progress: Progress,
}

impl http_body::Body for Arriving {
    type Data = Bytes;
    type Error = hyper::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, hyper::Error>>> {
        let polled = Pin::new(&mut self.body).poll_frame(context);
        if self.body.is_end_stream() || matches!(polled, Poll::Ready(None)) {
            self.progress.state().unread = false;
        }
        polled
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

/// The body of an answer; notes when the connection has all of it.
pub(super) struct Sent {
    body: Body,
    progress: Progress,
}

impl Drop for Sent {
    fn drop(&mut self) {
        self.progress.state().handed = true;
    }
}

impl http_body::Body for Sent {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        Pin::new(&mut self.body).poll_frame(context)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}
