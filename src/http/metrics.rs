//! What the service counts, in the text format of OpenMetrics.

use std::sync::OnceLock;
use std::sync::atomic::AtomicU64;

use prometheus_client::encoding::text::encode;
use prometheus_client::encoding::{EncodeLabelSet, EncodeLabelValue};
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::{Family, MetricConstructor};
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::metrics::info::Info;
use prometheus_client::registry::{Registry, Unit};

/// The media type of [`Metrics::text`].
pub const MEDIA_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// Route, method and status of an answer; the route as the specification writes it, or `none`.
#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub struct Answered {
    /// The path.
    pub route: String,
    /// The method.
    pub method: String,
    /// The status.
    pub status: u16,
}

/// A route.
#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub struct Route {
    /// The path.
    pub route: String,
}

/// The route of what no route is for.
pub const UNKNOWN: &str = "none";

/// The metrics of one route, at hand.
#[derive(Debug)]
pub struct OfRoute {
    route: Route,
    duration: Histogram,
    /// Bytes received and sent, of operations.
    sizes: Option<[Histogram; 2]>,
    /// What nearly every answer counts into: POST and 200.
    good: OnceLock<Counter>,
}

/// Why something was refused or ended.
#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub struct Because {
    /// The reason.
    pub reason: Reason,
}

/// The reasons.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, EncodeLabelValue)]
#[allow(non_camel_case_types, reason = "the names are the label values")]
pub enum Reason {
    /// What waits for the workers is too much, by heads or by expected time.
    queue,
    /// The memory for bodies and answers is in use.
    memory,
    /// Too many connections.
    connections,
    /// The head of a request took too long.
    head,
    /// A connection without a request for too long.
    idle,
    /// The client took too long to take the answer.
    answer,
    /// The service stops.
    stop,
    /// The deadline passed.
    deadline,
    /// The client left.
    client,
    /// A panic while the answer was sent.
    panic,
}

/// The bounds of a histogram.
#[derive(Debug, Clone)]
pub struct Buckets(&'static [f64]);

impl MetricConstructor<Histogram> for Buckets {
    fn new_metric(&self) -> Histogram {
        Histogram::new(self.0.iter().copied())
    }
}

const SECONDS: Buckets = Buckets(&[
    0.000_1, 0.000_25, 0.000_5, 0.001, 0.002_5, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5,
    5.0, 10.0, 30.0,
]);
const BYTES: Buckets = Buckets(&[
    256.0,
    1024.0,
    4096.0,
    16384.0,
    65536.0,
    262_144.0,
    1_048_576.0,
    4_194_304.0,
    16_777_216.0,
    67_108_864.0,
]);

type Histograms = Family<Route, Histogram, Buckets>;

/// Every metric.
#[derive(Debug)]
pub struct Metrics {
    registry: Registry,
    /// Answers by route, method and status.
    pub requests: Family<Answered, Counter>,
    /// From the head of the request to the head of the answer.
    pub duration: Histograms,
    /// Requests being answered.
    pub in_flight: Gauge,
    /// Work size: bytes of the bodies received.
    pub request_bytes: Histograms,
    /// Work size: bytes of the answers.
    pub answer_bytes: Histograms,
    /// Computations waiting for a worker.
    pub queued: Gauge,
    /// Seconds until what waits and runs is expected to be computed; set when it is asked for.
    pub expected_wait: Gauge<f64, AtomicU64>,
    /// Computations running.
    pub running: Gauge,
    /// Requests and connections refused because the service is full.
    pub shed: Family<Because, Counter>,
    /// Computations stopped before their end.
    pub cancelled: Family<Because, Counter>,
    /// Panics.
    pub panics: Counter<u64, AtomicU64>,
    /// Open connections.
    pub connections: Gauge,
    /// Connections closed by the service.
    pub closed: Family<Because, Counter>,
    /// Bytes held for bodies and answers on their way.
    pub held_bytes: Gauge,
}

impl Default for Metrics {
    fn default() -> Self {
        let seconds = || Histograms::new_with_constructor(SECONDS);
        let bytes = || Histograms::new_with_constructor(BYTES);
        let mut metrics = Metrics {
            registry: Registry::with_prefix("springline"),
            requests: Family::default(),
            duration: seconds(),
            in_flight: Gauge::default(),
            request_bytes: bytes(),
            answer_bytes: bytes(),
            queued: Gauge::default(),
            expected_wait: Gauge::default(),
            running: Gauge::default(),
            shed: Family::default(),
            cancelled: Family::default(),
            panics: Counter::default(),
            connections: Gauge::default(),
            closed: Family::default(),
            held_bytes: Gauge::default(),
        };
        metrics.register();
        metrics
    }
}

impl OfRoute {
    /// One more answer.
    pub fn answered(
        &self,
        metrics: &Metrics,
        method: &'static str,
        status: u16,
        seconds: f64,
        bytes: [u64; 2],
    ) {
        let counter = || {
            let answered =
                Answered { route: self.route.route.clone(), method: method.into(), status };
            metrics.requests.get_or_create(&answered).clone()
        };
        if (method, status) == ("POST", 200) {
            self.good.get_or_init(counter).inc();
        } else {
            counter().inc();
        }
        self.duration.observe(seconds);
        for (histogram, bytes) in self.sizes.iter().flatten().zip(bytes) {
            histogram.observe(bytes as f64);
        }
    }
}

impl Metrics {
    fn register(&mut self) {
        self.register_requests();
        self.register_computations();
        self.register_connections();
        let build = Info::new([
            ("version", env!("CARGO_PKG_VERSION")),
            ("target_arch", std::env::consts::ARCH),
            ("target_os", std::env::consts::OS),
        ]);
        self.registry.register("build", "What is running", build);
    }

    /// What is counted of requests and answers.
    fn register_requests(&mut self) {
        let registry = &mut self.registry;
        registry.register("requests", "Answers by route, method and status", self.requests.clone());
        let help = "From the head of the request to the head of the answer";
        registry.register_with_unit("request_duration", help, Unit::Seconds, self.duration.clone());
        registry.register("requests_in_flight", "Requests being answered", self.in_flight.clone());
        let sizes = [
            ("request_size", "Bodies received", &self.request_bytes),
            ("answer_size", "Answers", &self.answer_bytes),
        ];
        for (name, help, sizes) in sizes {
            registry.register_with_unit(name, help, Unit::Bytes, sizes.clone());
        }
    }

    /// What is counted of computations: those that wait, run and end early.
    fn register_computations(&mut self) {
        let registry = &mut self.registry;
        registry.register("queue_depth", "Computations waiting for a worker", self.queued.clone());
        let help = "Until what waits and runs is expected to be computed";
        let wait = self.expected_wait.clone();
        registry.register_with_unit("expected_wait", help, Unit::Seconds, wait);
        registry.register("computations_running", "Computations running", self.running.clone());
        let help = "Requests and connections refused because the service is full";
        registry.register("shed", help, self.shed.clone());
        let help = "Computations stopped before their end";
        registry.register("computations_cancelled", help, self.cancelled.clone());
        let help = "Panics; each costs its own request or line";
        registry.register("panics", help, self.panics.clone());
    }

    /// What is counted of connections, and the memory they hold.
    fn register_connections(&mut self) {
        let registry = &mut self.registry;
        registry.register("connections", "Open connections", self.connections.clone());
        let help = "Connections closed by the service";
        registry.register("connections_closed", help, self.closed.clone());
        let help = "Memory of bodies and answers on their way";
        registry.register_with_unit("held", help, Unit::Bytes, self.held_bytes.clone());
    }

    /// The metrics of a route.
    pub fn of_route(&self, route: &str) -> OfRoute {
        let is_operation = route.starts_with("/v1/");
        let route = Route { route: route.into() };
        let histogram = |of: &Histograms| of.get_or_create(&route).clone();
        let sizes =
            is_operation.then(|| [histogram(&self.request_bytes), histogram(&self.answer_bytes)]);
        OfRoute { duration: histogram(&self.duration), sizes, good: OnceLock::new(), route }
    }

    /// One thing more that was refused.
    pub fn shed(&self, reason: Reason) {
        self.shed.get_or_create(&Because { reason }).inc();
    }

    /// Every metric as text.
    pub fn text(&self) -> String {
        let mut text = String::new();
        // Writing to a string does not fail.
        let _ = encode(&mut text, &self.registry);
        text
    }
}
