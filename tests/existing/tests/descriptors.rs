//! Descriptors: placeholders stand for sockets of a test bed.

use std::io::ErrorKind;
use std::os::fd::{AsFd, AsRawFd, FromRawFd, IntoRawFd};
use std::time::Duration;

use cohaptic_testkit::{Bed, Testbed};
use socket2::{Domain, SockRef, Socket, TcpKeepalive, Type};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpSocket, TcpStream, UdpSocket};
use tokio::time::{Instant, sleep};

/// Runs a program on the client, while the server echoes at port 7.
fn with_echo<F: Future<Output = ()> + 'static>(program: impl FnOnce(Bed) -> F + 'static) {
    Testbed::new(["client", "server"]).links("delay 10ms").on_tokio().run(|bed: Bed| async move {
        bed.host("server").spawn(async {
            let listener = TcpListener::bind("[::]:7").await.unwrap();
            loop {
                let (mut stream, _) = listener.accept().await.unwrap();
                tokio::spawn(async move {
                    let (mut read, mut write) = stream.split();
                    tokio::io::copy(&mut read, &mut write).await
                });
            }
        });
        bed.host("client").spawn(program(bed.clone())).await.unwrap();
    });
}

async fn echo(stream: &mut TcpStream) {
    let mut read = [0; 5];
    stream.write_all(b"hello").await.unwrap();
    stream.read_exact(&mut read).await.unwrap();
    assert_eq!(&read, b"hello");
}

/// Keep-alive probes after 10 s, and each 5 s, three times.
fn probes() -> TcpKeepalive {
    TcpKeepalive::new().with_time(Duration::from_secs(10)).with_interval(Duration::from_secs(5)).with_retries(3)
}

#[test]
fn a_stream_comes_back_from_the_standard_library_with_new_options() {
    with_echo(async |_| {
        let mut stream = TcpStream::connect("server:7").await.unwrap();
        echo(&mut stream).await;
        let peer = stream.peer_addr().unwrap();
        let std = stream.into_std().unwrap();
        std.set_nodelay(true).unwrap();
        let socket = Socket::from(std);
        socket.set_linger(Some(Duration::from_secs(3))).unwrap();
        socket.set_ttl_v4(9).unwrap();
        // A duplicate stands for the same connection.
        let other = socket.try_clone().unwrap();
        let mut stream = TcpStream::from_std(socket.into()).unwrap();
        #[allow(deprecated, reason = "newer versions of tokio deprecate the method")]
        let linger = stream.linger().unwrap();
        assert_eq!((stream.nodelay().unwrap(), linger, stream.ttl().unwrap()), (true, Some(Duration::from_secs(3)), 9));
        assert_eq!(stream.peer_addr().unwrap(), peer);
        echo(&mut stream).await;
        let mut same = TcpStream::from_std(other.into()).unwrap();
        drop(stream);
        echo(&mut same).await;
    });
}

#[test]
fn options_are_set_on_the_descriptor_of_a_living_stream() {
    with_echo(async |bed| {
        let mut stream = TcpStream::connect("server:7").await.unwrap();
        assert!(stream.as_raw_fd() > 2);
        let socket = SockRef::from(&stream);
        assert!(!socket.tcp_nodelay().unwrap());
        socket.set_tcp_nodelay(true).unwrap();
        socket.set_tcp_keepalive(&probes()).unwrap();
        assert!(stream.nodelay().unwrap());
        echo(&mut stream).await;
        bed.host("server").crash();
        // The probes have an effect: nobody answers any more.
        let begin = Instant::now();
        assert_eq!(stream.read(&mut [0; 1]).await.unwrap_err().kind(), ErrorKind::TimedOut);
        assert!((24..27).contains(&begin.elapsed().as_secs()), "{:?}", begin.elapsed());
    });
}

#[test]
fn a_user_timeout_has_an_effect() {
    with_echo(async |bed| {
        let socket = Socket::from(TcpStream::connect("server:7").await.unwrap().into_std().unwrap());
        socket.set_tcp_user_timeout(Some(Duration::from_secs(4))).unwrap();
        let mut stream = TcpStream::from_std(socket.into()).unwrap();
        echo(&mut stream).await;
        bed.cut("client", "server");
        let begin = Instant::now();
        stream.write_all(b"lost").await.unwrap();
        assert_eq!(stream.read(&mut [0; 1]).await.unwrap_err().kind(), ErrorKind::TimedOut);
        assert!(begin.elapsed() < Duration::from_secs(9), "{:?}", begin.elapsed());
    });
}

#[test]
fn a_new_socket_becomes_one_of_the_test_bed() {
    with_echo(async |_| {
        let new = |domain| {
            let socket = Socket::new(domain, Type::STREAM, None).unwrap();
            socket.set_nonblocking(true).unwrap();
            socket
        };
        let real = new(Domain::IPV4);
        real.set_tcp_keepalive(&probes()).unwrap();
        real.set_recv_buffer_size(20_000).unwrap();
        real.set_reuse_address(true).unwrap();
        real.set_tcp_nodelay(true).unwrap();
        let socket = TcpSocket::from_std_stream(real.into());
        assert_eq!((socket.recv_buffer_size().unwrap(), socket.keepalive().unwrap()), (40_000, true));
        assert!(socket.reuseaddr().unwrap() && socket.nodelay().unwrap());
        // Through a raw descriptor and back.
        let socket = unsafe_from_raw(socket.into_raw_fd());
        assert!(socket.nodelay().unwrap());
        let mut stream = socket.connect("10.0.0.2:7".parse().unwrap()).await.unwrap();
        echo(&mut stream).await;

        let real = new(Domain::IPV6);
        real.set_only_v6(true).unwrap();
        let socket = TcpSocket::from_std_stream(real.into());
        socket.bind("[::]:9".parse().unwrap()).unwrap();
        let _listener = socket.listen(8).unwrap();
        assert_eq!(TcpStream::connect("127.0.0.1:9").await.unwrap_err().raw_os_error(), Some(111));
        TcpStream::connect("[::1]:9").await.unwrap();
    });
}

/// Hands a descriptor on, as a program does that keeps sockets as numbers.
#[allow(unsafe_code, reason = "the function of tokio is unsafe")]
fn unsafe_from_raw(descriptor: i32) -> TcpSocket {
    // SAFETY: the descriptor was handed over by `into_raw_fd`, and nobody else owns it.
    unsafe { TcpSocket::from_raw_fd(descriptor) }
}

#[test]
fn listeners_and_datagrams_go_through_the_standard_library() {
    with_echo(async |_| {
        let listener = TcpListener::bind("127.0.0.1:80").await.unwrap().into_std().unwrap();
        let listener = TcpListener::from_std(listener).unwrap();
        SockRef::from(&listener).set_tcp_nodelay(true).unwrap();
        // The option holds from the next call of the listener on.
        assert_eq!(listener.local_addr().unwrap().to_string(), "127.0.0.1:80");
        let _client = TcpStream::connect("127.0.0.1:80").await.unwrap();
        assert!(listener.accept().await.unwrap().0.nodelay().unwrap());

        let socket = UdpSocket::bind("0.0.0.0:5").await.unwrap();
        let real = Socket::from(socket.into_std().unwrap());
        real.set_broadcast(true).unwrap();
        real.set_ttl_v4(3).unwrap();
        let socket = UdpSocket::from_std(real.into()).unwrap();
        assert!(socket.broadcast().unwrap());
        assert_eq!(socket.ttl().unwrap(), 3);
        socket.send_to(b"all", "255.255.255.255:5").await.unwrap();
        assert_eq!(socket.recv(&mut [0; 8]).await.unwrap(), 3);
        assert!(socket.as_fd().as_raw_fd() > 2);
    });
}

/// Closing the last descriptor closes the connection; closing an earlier descriptor does not.
#[test]
fn a_connection_whose_placeholder_is_dropped_is_closed() {
    let program = async |bed: Bed| {
        bed.host("server").spawn(async {
            let listener = TcpListener::bind("0.0.0.0:7").await.unwrap();
            let (mut stream, _) = listener.accept().await.unwrap();
            let begin = Instant::now();
            assert_eq!(stream.read(&mut [0; 1]).await.unwrap(), 0);
            assert_eq!(begin.elapsed().as_secs(), 1);
        });
        let client = bed.host("client").spawn(async {
            let stream = TcpStream::connect("server:7").await.unwrap().into_std().unwrap();
            let other = stream.try_clone().unwrap();
            drop(stream);
            sleep(Duration::from_secs(1)).await;
            drop(other);
            sleep(Duration::from_secs(1)).await;
        });
        client.await.unwrap();
    };
    Testbed::new(["client", "server"]).links("delay 10ms").on_tokio().run(program);
}
