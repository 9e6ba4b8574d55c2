//! What answers the requests to each operation.

use std::pin::Pin;
use std::sync::Arc;

use axum::Router;
use axum::extract::{Request, State};
use axum::response::Response;
use axum::routing::post;

use super::call;
use super::service::Service;
use crate::api::operations::{self, Operation, Visitor};

/// Answers a request.
pub type Handler = fn(Arc<Service>, Request) -> Pin<Box<dyn Future<Output = Response> + Send>>;

/// What answers the requests to each operation, by its path.
pub struct Handlers(Vec<(&'static str, Handler)>);

struct ToHandler;

impl Visitor for ToHandler {
    type Made = (&'static str, Handler);

    fn visit<O: Operation>(&self) -> Self::Made {
        (O::PATH, |service, request| Box::pin(call::answer::<O>(service, request)))
    }
}

impl Handlers {
    /// Of every operation.
    pub fn all() -> Self {
        Handlers(operations::each(&ToHandler))
    }

    /// What answers at this path, if it is that of an operation: the router would find the same
    /// with more detours.
    pub fn at(&self, path: &str) -> Option<Handler> {
        self.0.iter().find(|(known, _)| *known == path).map(|(_, handler)| *handler)
    }

    /// The same as routes, so that the router knows what else is allowed where.
    pub fn routes(self, service: &Arc<Service>) -> Router {
        let route = |router: Router<Arc<Service>>, (path, handler): (&'static str, Handler)| {
            router.route(path, post(move |State(service), request| handler(service, request)))
        };
        self.0.into_iter().fold(Router::new(), route).with_state(service.clone())
    }
}
