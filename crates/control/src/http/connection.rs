//! Accepts connections, gives each a place, and ends slow connections.

use core::pin::pin;
use core::time::Duration;
use std::io;
use std::sync::Arc;

use axum::Router;
use axum::http::Request;
use futures_util::future::select;
use hyper::body::Incoming;
use hyper::server::conn::http1::Builder;
use hyper::service::{Service as _, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};

use super::patient::Patient;
use super::slots::{Limits, Slot, Slots};

/// Time for the head of a request, counted from the connection or from the answer before, and time that an answer waits for a slow reader.
pub(crate) const PATIENCE: Duration = Duration::from_secs(10);
/// Pause after a failed accept, for instance with too many open files.
const RETRY: Duration = Duration::from_millis(100);
/// Length of the longest accepted head of a request, and of the unread answers kept in memory \[byte\].
const BUFFER: usize = 16 * 1024;

/// Accepts connections forever, with the usual limits.
pub(crate) async fn answer_all(listener: TcpListener, router: Router) {
    answer_within(listener, router, Limits::USUAL, PATIENCE).await;
}

/// Accepts connections forever, with given limits.
async fn answer_within(listener: TcpListener, router: Router, limits: Limits, patience: Duration) {
    let slots = Slots::new(limits);
    loop {
        match listener.accept().await {
            Ok((stream, address)) => {
                tokio::spawn(answer(stream, router.clone(), slots.take(address.ip()), patience));
                // Lets a connection with a complete request show its token before the next connection may displace the stranger.
                tokio::task::yield_now().await;
            }
            // The client gave up before the connection was accepted.
            Err(error) if matches!(error.kind(), io::ErrorKind::ConnectionAborted | io::ErrorKind::ConnectionReset) => {}
            Err(_) => {
                // The likely error is too many open files. Ending a stranger's connection frees one.
                slots.send_one_away();
                tokio::time::sleep(RETRY).await;
            }
        }
    }
}

/// Answers the requests of a TCP connection until its end.
async fn answer(stream: TcpStream, router: Router, slot: Arc<Slot>, patience: Duration) {
    // Without a delay for coalescing, because events are small and should be seen at once.
    let _set: io::Result<()> = stream.set_nodelay(true);
    converse(stream, router, slot, patience).await;
}

/// Answers the requests of a stream until its end, or until the connection loses its place.
async fn converse(stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static, router: Router, slot: Arc<Slot>, patience: Duration) {
    let routes = TowerToHyperService::new(router);
    let shown = Arc::clone(&slot);
    let service = service_fn(move |mut request: Request<Incoming>| {
        // The guard finds the connection's place in the request, to record the role shown.
        request.extensions_mut().insert(Arc::clone(&shown));
        routes.call(request)
    });
    let mut builder = Builder::new();
    builder.timer(TokioTimer::new()).header_read_timeout(patience).max_buf_size(BUFFER);
    let serving = builder.serve_connection(TokioIo::new(Patient::new(stream, patience)), service).with_upgrades();
    // The result is ignored: on an error the other end is gone, does not speak HTTP, or is too slow, and nobody could be told.
    select(pin!(serving), pin!(slot.sent_away())).await;
}

/// Answers the requests of a stream as if from this machine, on a server without other connections.
#[cfg(fuzzing)]
pub(crate) async fn answer_bytes(stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static, router: Router) {
    let slot = Slots::new(Limits::USUAL).take(std::net::Ipv4Addr::LOCALHOST.into());
    converse(stream, router, slot, PATIENCE).await;
}

#[cfg(test)]
mod tests {
    use std::io::{Read as _, Write as _};
    use std::net::{SocketAddr, TcpStream};
    use std::time::Instant;

    use super::*;
    use crate::http::tests::{Site, TOKEN};

    /// Longer than the patience of the server below, and shorter than forever.
    const LONG: Duration = Duration::from_secs(30);

    /// Starts a server with little patience on a real socket.
    fn server() -> SocketAddr {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        listener.set_nonblocking(true).unwrap();
        let address = listener.local_addr().unwrap();
        let limits = Limits { strangers: 4, guests: 1, hosts: 2 };
        let router = Site::new(2).router;
        std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_io().enable_time().build().unwrap();
            runtime.block_on(async {
                let listener = TcpListener::from_std(listener).unwrap();
                answer_within(listener, router, limits, Duration::from_millis(300)).await;
            });
        });
        address
    }

    fn send(address: SocketAddr, text: &str) -> TcpStream {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(LONG)).unwrap();
        stream.write_all(text.as_bytes()).unwrap();
        stream
    }

    /// Reads until the server ends the connection.
    fn rest(mut stream: TcpStream) -> String {
        let mut bytes = Vec::new();
        // A reset connection has ended too. A connection that stays open fails the test by its timeout.
        let ended = stream.read_to_end(&mut bytes);
        assert!(ended.is_ok() || ended.is_err_and(|error| error.kind() == io::ErrorKind::ConnectionReset));
        String::from_utf8_lossy(&bytes).into_owned()
    }

    fn request(method: &str, path: &str) -> String {
        format!("{method} {path} HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {TOKEN}\r\n")
    }

    #[test]
    fn a_body_that_does_not_come_is_not_waited_for() {
        let slow = send(server(), &(request("PATCH", "/api/links/0") + "Content-Length: 100\r\n\r\n{\"delay\":"));
        let answer = rest(slow);
        assert!(answer.starts_with("HTTP/1.1 408 ") && answer.contains("body"), "{answer}");
    }

    #[test]
    fn an_answer_that_nobody_reads_ends_the_connection() {
        let address = server();
        let mut stream = send(address, "");
        let page = request("GET", "/") + "\r\n";
        stream.set_write_timeout(Some(LONG)).unwrap();
        // The system buffers some of the unread pages. Then the server stops reading requests, and finally closes the connection.
        let ended = (0..).find_map(|_| stream.write_all(page.as_bytes()).err()).unwrap();
        assert!(matches!(ended.kind(), io::ErrorKind::ConnectionReset | io::ErrorKind::BrokenPipe), "{ended}");
    }

    #[test]
    fn half_a_head_and_silence_end_the_connection() {
        let address = server();
        for beginning in ["", "GET / HTTP/1.1\r\nHost:"] {
            assert_eq!(rest(send(address, beginning)), "", "{beginning:?}");
        }
        // The same after an answer.
        let answer = rest(send(address, &(request("GET", "/api/state") + "\r\nGET /")));
        assert_eq!(answer.matches("HTTP/1.1 200").count(), 1, "{answer}");
    }

    #[test]
    fn a_stranger_has_one_answer_and_the_host_has_slots_of_its_own() {
        let address = server();
        let refused = rest(send(address, "GET /api/state HTTP/1.1\r\nHost: localhost\r\n\r\n"));
        assert!(refused.starts_with("HTTP/1.1 401 ") && refused.to_lowercase().contains("connection: close"), "{refused}");
        let events = request("GET", "/api/events") + "\r\n";
        let mut answered = [0; 12];
        let mut open: Vec<TcpStream> = (0..2).map(|_| send(address, &events)).collect();
        for stream in &mut open {
            stream.read_exact(&mut answered).unwrap();
            assert_eq!(&answered, b"HTTP/1.1 200");
        }
        let answer = rest(send(address, &events));
        assert!(answer.starts_with("HTTP/1.1 503 ") && answer.contains("too many"), "{answer}");
        drop(open.pop());
        // The server notices the missing reader at its next event.
        let begun = Instant::now();
        while !rest(send(address, &(request("GET", "/api/state") + "Connection: close\r\n\r\n"))).starts_with("HTTP/1.1 200") {
            assert!(begun.elapsed() < LONG, "the place is never free");
        }
    }
}
