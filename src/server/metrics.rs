//! What the server counts, in the form of Prometheus.

use prometheus_client::encoding::{EncodeLabelSet, text};
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::registry::Registry;

use crate::store::Store;

/// Counters; a clone of one counts the same.
#[derive(Debug)]
pub struct Metrics {
    registry: Registry,
    /// Requests by route and status.
    pub requests: Family<Request, Counter>,
    /// Seconds until the head of an answer was ready.
    pub seconds: Histogram,
    /// Bytes of meshes handed to connections.
    pub body_bytes: Counter,
    /// Bodies that were not sent to their end.
    pub unfinished: Counter,
    /// Connections that are open.
    pub connections: Gauge,
}

/// What requests are told apart by.
#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
pub struct Request {
    /// A word for the route.
    pub route: &'static str,
    /// The status of the answer.
    pub status: u16,
}

impl Metrics {
    /// All at 0, but for the retries of the store.
    pub fn new(store: &Store) -> Self {
        let mut registry = Registry::with_prefix("unweld");
        let requests = Family::<Request, Counter>::default();
        let seconds = Histogram::new(SECONDS);
        let (body_bytes, unfinished, connections) =
            (Counter::default(), Counter::default(), Gauge::default());
        registry.register("requests", "Requests by route and status", requests.clone());
        registry.register(
            "request_seconds",
            "Seconds until the head of an answer was ready",
            seconds.clone(),
        );
        registry.register("body_bytes", "Bytes of meshes handed to connections", body_bytes.clone());
        registry.register("unfinished_bodies", "Bodies that were not sent to their end", unfinished.clone());
        registry.register("connections", "Connections that are open", connections.clone());
        registry.register(
            "store_retries",
            "Requests to the store that were made again",
            store.retries().clone(),
        );
        Self { registry, requests, seconds, body_bytes, unfinished, connections }
    }

    /// All of them as text.
    pub fn text(&self) -> String {
        let mut out = String::new();
        // Writing to a string cannot fail.
        let _ = text::encode(&mut out, &self.registry);
        out
    }
}

const SECONDS: [f64; 8] = [0.0003, 0.001, 0.003, 0.01, 0.03, 0.1, 1.0, 10.0];
