//! Traces: the W3C trace context of requests, and one span for each request, sent by OTLP over
//! HTTP.

use std::fmt;
use std::time::Duration;

use bytes::Bytes;
use http::{HeaderMap, Request, Response, Uri};
use opentelemetry::trace::{
    Span as _, SpanContext, SpanId, SpanKind, Status, TraceContextExt, TraceFlags, TraceId,
    TraceState, Tracer, TracerProvider,
};
use opentelemetry::{Context, KeyValue};
use opentelemetry_http::hyper::HyperClient;
use opentelemetry_http::{HttpClient, HttpError};
use opentelemetry_otlp::{SpanExporter, WithExportConfig, WithHttpConfig};
use opentelemetry_sdk::Resource;
use opentelemetry_sdk::trace::{Sampler, SdkTracer, SdkTracerProvider};
use tokio::runtime::Handle;

/// How long sending a batch may take.
const PATIENCE: Duration = Duration::from_secs(5);

/// The span a request comes from: the header `traceparent` (W3C Trace Context, section 3.2).
#[derive(Debug, Clone)]
pub struct Parent {
    /// The trace, 32 hexadecimal digits.
    pub trace_id: String,
    context: SpanContext,
}

impl Parent {
    /// The parent named by these headers, if they name one well.
    pub fn of(headers: &HeaderMap) -> Option<Self> {
        let text = headers.get("traceparent")?.to_str().ok()?;
        let mut parts = text.split('-');
        let (version, trace, span, flags) =
            (parts.next()?, parts.next()?, parts.next()?, parts.next()?);
        // Later versions may add parts; the first may not.
        let known =
            is_hex(version, 2) && version != "ff" && (version != "00" || parts.next().is_none());
        if !(known && is_hex(trace, 32) && is_hex(span, 16) && is_hex(flags, 2)) {
            return None;
        }
        let flags =
            TraceFlags::new(u8::from_str_radix(flags, 16).ok()? & TraceFlags::SAMPLED.to_u8());
        let state = headers.get("tracestate").and_then(|value| value.to_str().ok()?.parse().ok());
        let (trace_id, span_id) = (TraceId::from_hex(trace).ok()?, SpanId::from_hex(span).ok()?);
        let context =
            SpanContext::new(trace_id, span_id, flags, true, state.unwrap_or(TraceState::NONE));
        context.is_valid().then(|| Parent { trace_id: trace.to_owned(), context })
    }
}

fn is_hex(text: &str, length: usize) -> bool {
    text.len() == length && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
}

/// Sends spans.
pub struct Traces {
    provider: SdkTracerProvider,
    tracer: SdkTracer,
}

impl fmt::Debug for Traces {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Traces")
    }
}

/// The span of one request.
pub struct Span(opentelemetry_sdk::trace::Span);

impl Traces {
    /// Starts the exporter, which sends batches to `/v1/traces` at this address. To be called on
    /// the runtime.
    ///
    /// # Errors
    /// An endpoint that is no `http://` address.
    pub fn start(endpoint: &str) -> Result<Self, String> {
        let uri: Uri =
            endpoint.parse().map_err(|error| format!("the setting `otlp-endpoint`: {error}"))?;
        if uri.scheme_str() != Some("http") || uri.authority().is_none() {
            return Err("the setting `otlp-endpoint`: write http://host:port".into());
        }
        let client = OnRuntime {
            runtime: Handle::current(),
            client: HyperClient::with_default_connector(PATIENCE, None),
        };
        let url = format!("{}/v1/traces", endpoint.trim_end_matches('/'));
        let exporter = SpanExporter::builder()
            .with_http()
            .with_http_client(client)
            .with_endpoint(url)
            .with_timeout(PATIENCE)
            .build();
        let exporter = exporter.map_err(|error| format!("the setting `otlp-endpoint`: {error}"))?;
        let resource = Resource::builder()
            .with_service_name("springline")
            .with_attribute(KeyValue::new("service.version", env!("CARGO_PKG_VERSION")));
        let sampler = Sampler::ParentBased(Box::new(Sampler::AlwaysOn));
        let provider = SdkTracerProvider::builder()
            .with_batch_exporter(exporter)
            .with_sampler(sampler)
            .with_resource(resource.build())
            .build();
        Ok(Traces { tracer: provider.tracer("springline"), provider })
    }

    /// Begins the span of a request.
    pub fn span(&self, method: &'static str, route: &str, parent: Option<&Parent>) -> Span {
        let context = parent.map_or_else(Context::new, |parent| {
            Context::new().with_remote_span_context(parent.context.clone())
        });
        let attributes = [
            KeyValue::new("http.request.method", method),
            KeyValue::new("http.route", route.to_owned()),
        ];
        let builder = self
            .tracer
            .span_builder(format!("{method} {route}"))
            .with_kind(SpanKind::Server)
            .with_attributes(attributes);
        Span(self.tracer.build_with_context(builder, &context))
    }

    /// Sends what has not been sent. Blocks for as long as sending a batch may take.
    pub fn flush(&self) {
        if let Err(error) = self.provider.shutdown_with_timeout(PATIENCE) {
            tracing::warn!(%error, "the last spans were not sent");
        }
    }
}

impl Span {
    /// The trace it belongs to, 32 hexadecimal digits.
    pub fn trace_id(&self) -> String {
        self.0.span_context().trace_id().to_string()
    }

    /// Ends it.
    pub fn end(&mut self, status: u16) {
        self.0.set_attribute(KeyValue::new("http.response.status_code", i64::from(status)));
        if status >= 500 {
            self.0.set_status(Status::error(""));
        }
        self.0.end();
    }
}

/// A client that works on the runtime whichever thread asks: the exporter has a thread of its own.
#[derive(Debug)]
struct OnRuntime {
    runtime: Handle,
    client: HyperClient,
}

#[async_trait::async_trait]
impl HttpClient for OnRuntime {
    async fn send_bytes(&self, request: Request<Bytes>) -> Result<Response<Bytes>, HttpError> {
        let client = self.client.clone();
        self.runtime.spawn(async move { client.send_bytes(request).await }).await?
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parent(text: &str) -> Option<String> {
        let headers = HeaderMap::from_iter([(
            http::HeaderName::from_static("traceparent"),
            text.parse().unwrap(),
        )]);
        Parent::of(&headers).map(|parent| parent.trace_id)
    }

    #[test]
    fn only_well_formed_parents_count() {
        let trace = "4bf92f3577b34da6a3ce929d0e0e4736";
        assert_eq!(parent(&format!("00-{trace}-00f067aa0ba902b7-01")).as_deref(), Some(trace));
        assert_eq!(
            parent(&format!("42-{trace}-00f067aa0ba902b7-01-later")).as_deref(),
            Some(trace)
        );
        for text in [
            format!("00-{trace}-00f067aa0ba902b7-01-more"),
            format!("ff-{trace}-00f067aa0ba902b7-01"),
            format!("00-{trace}-0000000000000000-01"),
            format!("00-{}-00f067aa0ba902b7-01", "0".repeat(32)),
            format!("00-{}-00f067aa0ba902b7-01", trace.to_uppercase()),
            format!("00-{trace}-00f067aa0ba902b7"),
            "nonsense".into(),
        ] {
            assert_eq!(parent(&text), None, "{text}");
        }
    }
}
