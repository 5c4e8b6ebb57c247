//! Connections: how many, how long, and how they end.

use std::future::Future;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use hyper::server::conn::http1;
use hyper::service::Service;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::{GracefulConnection, GracefulShutdown};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinSet;
use tokio_io_timeout::TimeoutStream;

use super::Options;
use super::http::{App, router};
use super::seats::{Seat, Seats};
use super::watched::{Sent, Told};
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
        let local = listener.local_addr()?.ip().is_loopback();
        let app = Arc::new(App::new(store, options, local));
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
        let seats = Seats::new(options.connections);
        let (graceful, mut tasks) = (GracefulShutdown::new(), JoinSet::new());
        let mut stop = std::pin::pin!(stop);
        loop {
            let next = async {
                let (stream, _) = self.listener.accept().await?;
                Ok::<_, io::Error>((stream, seats.take().await))
            };
            let accepted = tokio::select! {
                () = &mut stop => break,
                next = next => next,
            };
            while tasks.try_join_next().is_some() {}
            match accepted {
                Ok((stream, seat)) => {
                    let connection = graceful.watch(self.connection(stream, seat.clone()));
                    let open = self.app.metrics.connections.clone();
                    tasks.spawn(async move {
                        open.inc();
                        let ended = tokio::select! {
                            ended = connection => ended,
                            () = seat.bidden() => Ok(()),
                        };
                        // Why a connection ended is the client's affair.
                        if let Err(error) = ended {
                            tracing::debug!(%error, "a connection broke");
                        }
                        open.dec();
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
        seat: Arc<Seat>,
    ) -> impl GracefulConnection<Error = hyper::Error> + Send + 'static {
        let options = &self.app.options;
        bound(&stream);
        let mut stream = TimeoutStream::new(stream);
        stream.set_write_timeout(Some(options.stall));
        let stream = Told::new(Box::pin(stream), seat.clone());
        let router = TowerToHyperService::new(self.router.clone());
        let service = hyper::service::service_fn(move |request| {
            let (answer, response) = (seat.answer(), router.call(request));
            async move { response.await.map(|response| response.map(|body: Body| Sent::new(body, answer))) }
        });
        http1::Builder::new()
            .timer(TokioTimer::new())
            .header_read_timeout(options.idle)
            .max_headers(MAX_HEADERS)
            .max_buf_size(MAX_HEAD_BYTES)
            .serve_connection(TokioIo::new(stream), service)
    }
}

/// Bounds what the system keeps for a connection. Of bytes that have not left it is little: as soon as the client takes some of them there is room for
/// more, so that a slow client can be told from one that takes nothing, and a thousand of the latter cost little. What cannot be set stays as it is.
fn bound(stream: &TcpStream) {
    let socket = socket2::SockRef::from(stream);
    let _ = socket.set_send_buffer_size(SEND_BYTES);
    #[cfg(any(target_os = "linux", target_os = "android"))]
    let _ = socket.set_tcp_notsent_lowat(UNSENT_BYTES);
    // It only makes small answers quicker.
    let _ = stream.set_nodelay(true);
}

/// Most lines of the head of a request, and most bytes, which also bound what waits to be sent.
const MAX_HEADERS: usize = 64;
const MAX_HEAD_BYTES: usize = 64 << 10;
/// Memory of the system for what is sent and not yet acknowledged: enough for 5 MB/s to the other side of an ocean.
const SEND_BYTES: usize = 256 << 10;
/// How much of it may wait to be sent. There is room for more as soon as half of this is left, and the last piece may add 64 KiB: together with
/// the steps in which the system of a client tells that it has room (64 KiB on a loopback address, much less elsewhere) this makes the
/// 128 KiB of [`Options::stall`].
#[cfg(any(target_os = "linux", target_os = "android"))]
const UNSENT_BYTES: u32 = 32 << 10;
/// How long no connection is accepted after one could not be.
const PAUSE: Duration = Duration::from_millis(100);
