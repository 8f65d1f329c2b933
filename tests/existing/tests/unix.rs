//! Unix sockets and pipes of tokio in a test bed, and descriptors that are refused there.

use std::io::ErrorKind;
use std::net::Shutdown;
use std::os::fd::AsRawFd;

use bytes::Bytes;
use cohaptic_testkit::{Bed, Testbed};
use http_body_util::{BodyExt, Full};
use hyper::Request;
use hyper_util::rt::TokioIo;
use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader, Interest};
use tokio::net::unix::{UCred, pipe};
use tokio::net::{UnixDatagram, UnixListener, UnixSocket, UnixStream};
use tokio::time::Instant;

/// Runs a program on a host.
fn on_a_host<F: Future<Output = ()> + 'static>(program: impl FnOnce(Bed) -> F + 'static) {
    Testbed::new(["host", "other"]).links("delay 10ms").on_tokio().run(|bed: Bed| async move {
        bed.host("host").spawn(program(bed.clone())).await.unwrap();
    });
}

#[test]
fn a_stream_and_its_halves() {
    on_a_host(async |_| {
        let begin = Instant::now();
        let listener = UnixListener::bind("/run/echo.sock").unwrap();
        assert_eq!(listener.local_addr().unwrap().as_pathname().unwrap().to_str(), Some("/run/echo.sock"));
        let server = tokio::spawn(async move {
            let (mut stream, peer) = listener.accept().await.unwrap();
            assert!(peer.is_unnamed() && stream.peer_addr().unwrap().is_unnamed());
            let (mut read, mut write) = stream.split();
            tokio::io::copy(&mut read, &mut write).await.unwrap();
            write.shutdown().await.unwrap();
        });
        let stream = UnixStream::connect("/run/echo.sock").await.unwrap();
        assert_eq!(stream.peer_addr().unwrap().as_pathname().unwrap().to_str(), Some("/run/echo.sock"));
        assert!(stream.ready(Interest::READABLE | Interest::WRITABLE).await.unwrap().is_writable());
        assert_eq!(stream.try_read(&mut [0]).unwrap_err().kind(), ErrorKind::WouldBlock);
        let (mut read, mut write) = stream.into_split();
        let writer = tokio::spawn(async move { write.write_all(&[7; 1_000_000]).await.unwrap() });
        let mut got = vec![0; 10];
        read.readable().await.unwrap();
        got.clear();
        assert!(read.try_read_buf(&mut got).unwrap() > 0);
        read.read_to_end(&mut got).await.unwrap();
        assert_eq!(got, vec![7; 1_000_000]);
        writer.await.unwrap();
        server.await.unwrap();
        assert_eq!(begin.elapsed().as_nanos(), 0);
    });
}

#[test]
fn pairs_and_their_owner() {
    let own = || -> UCred {
        // The real credentials, from a real pair.
        let runtime = tokio::runtime::Builder::new_current_thread().enable_io().build().unwrap();
        runtime.block_on(async { UnixStream::pair().unwrap().0.peer_cred().unwrap() })
    };
    let own = own();
    on_a_host(async move |_| {
        let (mut one, other) = UnixStream::pair().unwrap();
        assert_eq!(one.peer_cred().unwrap(), own);
        one.write_all(b"line\n").await.unwrap();
        let mut line = String::new();
        BufReader::new(&mut { other }).read_line(&mut line).await.unwrap();
        assert_eq!(line, "line\n");
        assert_eq!(one.write_all(b"x").await.unwrap_err().kind(), ErrorKind::BrokenPipe);
    });
}

#[test]
fn errors_have_the_numbers_of_linux() {
    on_a_host(async |bed: Bed| {
        let number = |error: std::io::Error| error.raw_os_error();
        assert_eq!(number(UnixStream::connect("/run/x").await.unwrap_err()), Some(2));
        let _listener = UnixListener::bind("/run/x").unwrap();
        assert_eq!(number(UnixListener::bind("/run/x").unwrap_err()), Some(98));
        // Another host has another file.
        bed.host("other").spawn(async { UnixListener::bind("/run/x").map(drop).unwrap() }).await.unwrap();
        let gone = UnixDatagram::bind("/run/gone").unwrap();
        assert_eq!(number(UnixStream::connect("/run/gone").await.unwrap_err()), Some(91));
        drop(gone);
        assert_eq!(number(UnixStream::connect("/run/gone").await.unwrap_err()), Some(111));
        let _abstract = UnixListener::bind("\0name").unwrap();
        assert_eq!(_abstract.local_addr().unwrap().as_abstract_name(), Some(&b"name"[..]));
        UnixStream::connect("\0name").await.unwrap();
        assert_eq!(number(UnixStream::connect("\0nobody").await.unwrap_err()), Some(111));
        assert_eq!(UnixListener::bind("x".repeat(200)).unwrap_err().kind(), ErrorKind::InvalidInput);
        let error = UnixSocket::new_datagram().unwrap().listen(8).unwrap_err();
        assert_eq!(error.to_string(), "listen cannot be called on a datagram socket");
        let socket = UnixSocket::new_stream().unwrap();
        socket.bind("/run/y").unwrap();
        let listener = socket.listen(1).unwrap();
        let _waiting = [UnixStream::connect("/run/y").await.unwrap(), UnixStream::connect("/run/y").await.unwrap()];
        assert_eq!(number(UnixStream::connect("/run/y").await.unwrap_err()), Some(11));
        listener.accept().await.unwrap();
        UnixStream::connect("/run/y").await.unwrap();
    });
}

#[test]
fn datagrams() {
    on_a_host(async |_| {
        let server = UnixDatagram::bind("/run/log").unwrap();
        let client = UnixDatagram::unbound().unwrap();
        let sender = tokio::spawn(async move {
            // More than wait at once.
            for number in 0..50_u8 {
                client.send_to(&vec![number; number.into()], "/run/log").await.unwrap();
            }
            client.connect("/run/log").unwrap();
            client.send(b"last").await.unwrap();
        });
        for number in 0..50_u8 {
            let mut got = Vec::with_capacity(100);
            let (count, from) = server.recv_buf_from(&mut got).await.unwrap();
            assert!(from.is_unnamed());
            assert_eq!((count, got), (usize::from(number), vec![number; number.into()]));
        }
        let mut buffer = [0; 3];
        assert_eq!((server.recv(&mut buffer).await.unwrap(), &buffer), (3, b"las"));
        sender.await.unwrap();
        let (one, other) = UnixDatagram::pair().unwrap();
        assert!(other.ready(Interest::WRITABLE).await.unwrap().is_writable());
        assert_eq!(other.try_recv(&mut buffer).unwrap_err().kind(), ErrorKind::WouldBlock);
        one.shutdown(Shutdown::Both).unwrap();
        assert_eq!(one.send(b"x").await.unwrap_err().kind(), ErrorKind::BrokenPipe);
    });
}

#[test]
fn pipes() {
    on_a_host(async |_| {
        let (mut sender, mut receiver) = pipe::pipe().unwrap();
        let writer = tokio::spawn(async move { sender.write_all(&[7; 300_000]).await.unwrap() });
        let mut got = Vec::new();
        receiver.read_to_end(&mut got).await.unwrap();
        assert_eq!(got, vec![7; 300_000]);
        writer.await.unwrap();
    });
}

/// Hosts of a network talk over their links, and each with a service beside it over a Unix socket.
#[test]
fn http_over_a_unix_socket() {
    on_a_host(async |_| {
        let listener = UnixListener::bind("/run/docker.sock").unwrap();
        tokio::spawn(async move {
            let app = axum::Router::new().route("/", axum::routing::get(async || "hello"));
            axum::serve(listener, app).await.unwrap();
        });
        let stream = UnixStream::connect("/run/docker.sock").await.unwrap();
        let (mut sender, connection) = hyper::client::conn::http1::handshake(TokioIo::new(stream)).await.unwrap();
        tokio::spawn(connection);
        let request = Request::get("/").header("host", "docker").body(Full::<Bytes>::default()).unwrap();
        assert_eq!(sender.send_request(request).await.unwrap().into_body().collect().await.unwrap().to_bytes(), "hello");
    });
}

#[test]
fn descriptors_are_refused() {
    on_a_host(async |_| {
        let refused = |what: &str, error: std::io::Error| {
            assert_eq!(error.kind(), ErrorKind::Unsupported);
            let text = error.to_string();
            assert!(text.contains(&format!("`{what}` in a test bed")) && text.contains("with the functions of `tokio::net`"), "{text}");
        };
        let (one, _other) = UnixStream::pair().unwrap();
        refused("UnixStream::into_std", one.into_std().unwrap_err());
        let (one, _other) = std::os::unix::net::UnixStream::pair().unwrap();
        one.set_nonblocking(true).unwrap();
        refused("UnixStream::from_std", UnixStream::from_std(one).unwrap_err());
        let (sender, receiver) = pipe::pipe().unwrap();
        refused("pipe::Sender::into_blocking_fd", sender.into_blocking_fd().unwrap_err());
        refused("pipe::Receiver::into_nonblocking_fd", receiver.into_nonblocking_fd().unwrap_err());
        refused("pipe::OpenOptions::open_sender", pipe::OpenOptions::new().open_sender("/dev/null").unwrap_err());
    });
}

#[test]
#[should_panic(expected = "`UnixDatagram::as_fd` in a test bed: Unix sockets and pipes of a test bed live in memory")]
fn a_descriptor_that_cannot_be_refused_by_an_error() {
    on_a_host(async |_| {
        let _ = UnixDatagram::unbound().unwrap().as_raw_fd();
    });
}

#[test]
#[should_panic(expected = "`UnixStream::pair` at tests/unix.rs:")]
fn a_socket_on_no_host() {
    Testbed::new(["host"]).on_tokio().run(async |_: Bed| drop(UnixStream::pair()));
}

/// Nothing of tokio tells a user to call `enable_io`.
#[test]
#[should_panic(expected = "Replace an `AsyncFd`, which waits for a descriptor of the system, by a socket or a channel")]
fn an_asynchronous_descriptor() {
    on_a_host(async |_| {
        let (one, _other) = std::os::unix::net::UnixStream::pair().unwrap();
        #[allow(deprecated, reason = "newer versions of tokio deprecate the safe function")]
        let watched = tokio::io::unix::AsyncFd::new(one);
        drop(watched);
    });
}
