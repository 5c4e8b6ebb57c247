//! Connections: how many, how long, and how they end.

use std::future::Future;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::GracefulShutdown;
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::task::JoinSet;
use tokio_io_timeout::TimeoutStream;

use super::Options;
use super::http::{App, router};
use crate::store::Store;

/// A server that has an address, and answers once it is run.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    app: Arc<App>,
    router: Router,
}

impl Server {
    /// Takes an address; port 0 is any that is free.
    ///
    /// # Errors
    /// Those of the system, such as that the address is taken.
    pub async fn bind(address: SocketAddr, store: Store, options: Options) -> io::Result<Self> {
        let listener = TcpListener::bind(address).await?;
        let app = Arc::new(App::new(store, options));
        Ok(Self { listener, router: router(app.clone()), app })
    }

    /// The address that was taken.
    ///
    /// # Errors
    /// Those of the system.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Answers until `stop` is ready, then lets answers under way come to their end, or breaks them off once
    /// [`Options::grace`] is over.
    pub async fn run(self, stop: impl Future<Output = ()>) {
        let options = &self.app.options;
        let places = Arc::new(Semaphore::new(options.connections.clamp(1, Semaphore::MAX_PERMITS)));
        let (graceful, mut tasks) = (GracefulShutdown::new(), JoinSet::new());
        let mut stop = std::pin::pin!(stop);
        loop {
            let next = async {
                let place = places.clone().acquire_owned().await;
                (place, self.listener.accept().await)
            };
            let (place, accepted) = tokio::select! {
                () = &mut stop => break,
                next = next => next,
            };
            while tasks.try_join_next().is_some() {}
            match accepted {
                Ok((stream, _)) => {
                    let connection = graceful.watch(self.connection(stream));
                    let open = self.app.metrics.connections.clone();
                    tasks.spawn(async move {
                        open.inc();
                        // Why a connection ended is the client's affair.
                        if let Err(error) = connection.await {
                            tracing::debug!(%error, "a connection broke");
                        }
                        open.dec();
                        drop(place);
                    });
                }
                Err(error) => {
                    // No more files may be open, say: some connection has to end first.
                    tracing::warn!(%error, "a connection could not be accepted");
                    tokio::time::sleep(PAUSE).await;
                }
            }
        }
        drop(self.listener);
        tracing::info!(connections = graceful.count(), "stopping");
        let _ = tokio::time::timeout(options.grace, graceful.shutdown()).await;
    }

    fn connection(
        &self,
        stream: TcpStream,
    ) -> impl hyper_util::server::graceful::GracefulConnection<Error = hyper::Error> + Send + 'static {
        let options = &self.app.options;
        // It only makes small answers quicker.
        let _ = stream.set_nodelay(true);
        let mut stream = TimeoutStream::new(stream);
        stream.set_write_timeout(Some(options.stall));
        let service = TowerToHyperService::new(self.router.clone());
        http1::Builder::new()
            .timer(TokioTimer::new())
            .header_read_timeout(options.idle)
            .max_headers(MAX_HEADERS)
            .max_buf_size(MAX_HEAD_BYTES)
            .serve_connection(TokioIo::new(Box::pin(stream)), service)
    }
}

/// Most lines of the head of a request, and most bytes, which also bound what waits to be sent.
const MAX_HEADERS: usize = 64;
const MAX_HEAD_BYTES: usize = 64 << 10;
/// How long no connection is accepted after one could not be.
const PAUSE: Duration = Duration::from_millis(100);
