//! Connections: few at a time, and none that keeps silent.

use core::time::Duration;
use std::io;
use std::sync::Arc;

use axum::Router;
use hyper::server::conn::http1::Builder;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// How many connections may be open. The others wait: the real-time side shares the limit of open files with them.
const MOST: usize = 64;
/// How long a request head may take, from its connection or from the answer before it.
const PATIENCE: Duration = Duration::from_secs(10);
/// When no connection can be taken, because there are too many open files, it is tried again after this.
const RETRY: Duration = Duration::from_secs(1);

/// Takes connections for ever.
pub(crate) async fn answer_all(listener: TcpListener, router: Router) {
    let places = Arc::new(Semaphore::new(MOST));
    // It is never closed.
    while let Ok(place) = Arc::clone(&places).acquire_owned().await {
        match listener.accept().await {
            Ok((stream, _)) => {
                tokio::spawn(answer(stream, router.clone(), place));
            }
            // It was given up before it was taken.
            Err(error) if matches!(error.kind(), io::ErrorKind::ConnectionAborted | io::ErrorKind::ConnectionReset) => {}
            Err(_) => tokio::time::sleep(RETRY).await,
        }
    }
}

/// Answers what one connection asks, until it ends.
async fn answer(stream: TcpStream, router: Router, place: OwnedSemaphorePermit) {
    // Events are small and should not wait for one another.
    let _set: io::Result<()> = stream.set_nodelay(true);
    let mut builder = Builder::new();
    builder.timer(TokioTimer::new()).header_read_timeout(PATIENCE);
    // Whoever is at the other end has gone, or spoke no HTTP: nobody is left to be told.
    let _ended: hyper::Result<()> = builder.serve_connection(TokioIo::new(stream), TowerToHyperService::new(router)).await;
    drop(place);
}
