use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::os::fd::AsRawFd;
use std::time::Duration;

use cohaptic_testkit::Bed;
use cohaptic_testkit::time::{now, sleep};
use socket2::{Domain, Socket, Type};

use crate::run;

fn listen(at: &str) -> TcpListener {
    let listener = TcpListener::bind(at).unwrap();
    listener.set_nonblocking(true).unwrap();
    listener
}

/// Begins a connection.
fn begin(to: &str) -> Socket {
    let to: SocketAddr = to.parse().unwrap();
    let socket = Socket::new(Domain::for_address(to), Type::STREAM, None).unwrap();
    socket.set_nonblocking(true).unwrap();
    assert_eq!(socket.connect(&to.into()).unwrap_err().raw_os_error(), Some(libc::EINPROGRESS));
    assert_eq!(socket.connect(&to.into()).unwrap_err().raw_os_error(), Some(libc::EALREADY));
    socket
}

/// Returns what `poll` says of a descriptor, without waiting.
fn poll(of: &impl AsRawFd) -> i16 {
    let mut list = [libc::pollfd { fd: of.as_raw_fd(), events: libc::POLLIN | libc::POLLOUT, revents: 0 }];
    // SAFETY: the list has one value.
    assert!(unsafe { libc::poll(list.as_mut_ptr(), 1, 0) } >= 0);
    list[0].revents
}

/// Returns the number of bytes that wait to be read.
fn unread(of: &impl AsRawFd) -> i32 {
    let mut count = -1;
    // SAFETY: the call writes one number, for which there is memory.
    assert_eq!(unsafe { libc::ioctl(of.as_raw_fd(), libc::FIONREAD, &raw mut count) }, 0);
    count
}

#[test]
fn a_connection_takes_its_round_trips() {
    run(async |bed: Bed| {
        let server = bed.host("server").spawn(async {
            let listener = listen("[::]:80");
            assert_eq!(listener.local_addr().unwrap().to_string(), "[::]:80");
            assert_eq!(listener.accept().unwrap_err().kind(), ErrorKind::WouldBlock);
            assert_eq!(poll(&listener), 0);
            sleep(Duration::from_millis(31)).await;
            assert_eq!(poll(&listener), libc::POLLIN);
            let (mut stream, peer) = listener.accept().unwrap();
            assert_eq!(peer.ip().to_string(), "::ffff:10.0.0.1");
            stream.set_nonblocking(true).unwrap();
            stream.set_nodelay(true).unwrap();
            let mut text = [0; 9];
            assert_eq!(unread(&stream), 5);
            assert_eq!(stream.peek(&mut text).unwrap(), 5);
            assert_eq!((stream.read(&mut text).unwrap(), &text[..5]), (5, &b"hello"[..]));
            assert_eq!(unread(&stream), 0);
            assert_eq!(stream.read(&mut text).unwrap_err().kind(), ErrorKind::WouldBlock);
            stream.write_all(b"and good bye").unwrap();
            // Closing the only descriptor sends FIN.
            drop(stream);
            assert!(TcpListener::bind("[::]:80").is_err());
            drop(listener);
            listen("[::]:80");
        });
        let client = bed.host("client").spawn(async {
            let socket = begin("10.0.0.2:80");
            assert_eq!(poll(&socket), 0);
            assert_eq!(socket.peer_addr().unwrap_err().raw_os_error(), Some(libc::ENOTCONN));
            sleep(Duration::from_millis(19)).await;
            assert_eq!(poll(&socket), 0);
            sleep(Duration::from_millis(1)).await;
            assert_eq!(poll(&socket), libc::POLLOUT);
            assert!(socket.take_error().unwrap().is_none());
            let mut stream = TcpStream::from(socket);
            assert_eq!(stream.peer_addr().unwrap().to_string(), "10.0.0.2:80");
            assert_eq!(stream.local_addr().unwrap().ip().to_string(), "10.0.0.1");
            stream.write_all(b"hello").unwrap();
            sleep(Duration::from_millis(30)).await;
            let mut other = stream.try_clone().unwrap();
            stream.shutdown(Shutdown::Write).unwrap();
            drop(stream);
            let mut text = String::new();
            assert_eq!(other.read_to_string(&mut text).unwrap(), 12);
            assert_eq!(text, "and good bye");
        });
        server.await.unwrap();
        client.await.unwrap();
    });
}

#[test]
fn a_connection_to_nobody_fails() {
    run(async |bed: Bed| {
        let client = bed.host("client").spawn(async {
            for (to, wait, error) in [("10.0.0.2:80", 20, libc::ECONNREFUSED), ("10.0.0.77:80", 3100, libc::EHOSTUNREACH)] {
                let socket = begin(to);
                sleep(Duration::from_millis(wait)).await;
                assert_ne!(poll(&socket) & libc::POLLOUT, 0, "{to}");
                assert_eq!(socket.take_error().unwrap().unwrap().raw_os_error(), Some(error), "{to}");
            }
            let far: SocketAddr = "192.0.2.1:80".parse().unwrap();
            let socket = Socket::new(Domain::IPV4, Type::STREAM, None).unwrap();
            assert_eq!(socket.connect(&far.into()).unwrap_err().raw_os_error(), Some(libc::ENETUNREACH));
            let unbound = Socket::new(Domain::IPV4, Type::STREAM, None).unwrap();
            assert_eq!(unbound.bind(&"[::1]:80".parse::<SocketAddr>().unwrap().into()).unwrap_err().raw_os_error(), Some(libc::EAFNOSUPPORT));
            assert_eq!(unbound.send(b"x").unwrap_err().raw_os_error(), Some(libc::EPIPE));
        });
        client.await.unwrap();
    });
}

/// As on Linux, a descriptor that was duplicated before the bind stands for the same socket.
#[test]
fn a_socket_is_bound_through_one_descriptor_and_listens_through_the_other() {
    run(async |bed: Bed| {
        let server = bed.host("server").spawn(async {
            let socket = Socket::new(Domain::IPV4, Type::STREAM, None).unwrap();
            socket.set_reuse_address(true).unwrap();
            let other = socket.try_clone().unwrap();
            socket.bind(&"10.0.0.2:0".parse::<SocketAddr>().unwrap().into()).unwrap();
            drop(socket);
            assert!(!other.is_listener().unwrap());
            other.listen(1).unwrap();
            assert!(other.is_listener().unwrap());
            let port = other.local_addr().unwrap().as_socket().unwrap().port();
            assert!(port >= 49152);
        });
        server.await.unwrap();
        assert_eq!(now().as_nanos(), 0);
    });
}

/// `std::io::copy` asks the system to move the bytes, and moves them itself where the system refuses.
#[test]
fn a_file_is_copied_into_a_stream() {
    run(async |bed: Bed| {
        bed.host("server").spawn(async {
            let listener = listen("0.0.0.0:80");
            sleep(Duration::from_millis(100)).await;
            let (mut stream, _) = listener.accept().unwrap();
            let mut text = Vec::new();
            assert_eq!(stream.read_to_end(&mut text).unwrap(), include_bytes!("tcp.rs").len());
        });
        let client = bed.host("client").spawn(async {
            let socket = begin("10.0.0.2:80");
            sleep(Duration::from_millis(20)).await;
            let mut stream = TcpStream::from(socket);
            let mut file = std::fs::File::open(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/integration/tcp.rs")).unwrap();
            std::io::copy(&mut file, &mut stream).unwrap();
        });
        client.await.unwrap();
        sleep(Duration::from_secs(1)).await;
    });
}
