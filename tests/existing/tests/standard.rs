//! Sockets of the standard library and of `socket2`, which tokio takes over, and the clocks of the standard library.

use std::net::SocketAddr;
use std::time::Duration;

use cohaptic_testkit::Testbed;
use socket2::{Domain, Socket, TcpKeepalive, Type};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream, UdpSocket, lookup_host};
use tokio::time::{sleep, sleep_until};

/// A listener with options of `socket2`, and a client that begins its connection without waiting.
#[test]
fn sockets_of_socket2_are_given_to_tokio() {
    crate::over_lossy_links(
        |bed| bed,
        async |bed| {
            bed.host("server").spawn(async {
                let socket = Socket::new(Domain::IPV6, Type::STREAM, None).unwrap();
                socket.set_reuse_address(true).unwrap();
                socket.set_tcp_nodelay(true).unwrap();
                socket.set_recv_buffer_size(20_000).unwrap();
                socket.bind(&"[::]:7".parse::<SocketAddr>().unwrap().into()).unwrap();
                socket.listen(16).unwrap();
                socket.set_nonblocking(true).unwrap();
                let listener = TcpListener::from_std(socket.into()).unwrap();
                let (mut stream, _) = listener.accept().await.unwrap();
                assert!(stream.nodelay().unwrap());
                let (mut read, mut write) = stream.split();
                tokio::io::copy(&mut read, &mut write).await.unwrap();
            });
            let client = bed.host("client").spawn(async {
                let to = lookup_host("server:7").await.unwrap().next().unwrap();
                let socket = Socket::new(Domain::IPV4, Type::STREAM, None).unwrap();
                socket.set_nonblocking(true).unwrap();
                socket.set_tcp_keepalive(&TcpKeepalive::new().with_time(Duration::from_secs(9))).unwrap();
                assert!(socket.connect(&to.into()).is_err());
                let mut stream = TcpStream::from_std(socket.into()).unwrap();
                stream.writable().await.unwrap();
                assert!(stream.take_error().unwrap().is_none());
                stream.write_all(&[7; 30_000]).await.unwrap();
                stream.shutdown().await.unwrap();
                let mut echo = Vec::new();
                assert_eq!(stream.read_to_end(&mut echo).await.unwrap(), 30_000);
            });
            client.await.unwrap();
        },
    );
}

#[test]
fn datagrams_of_the_standard_library_are_given_to_tokio() {
    crate::over_lossy_links(
        |bed| bed,
        async |bed| {
            let bind = |port: u16| {
                let socket = std::net::UdpSocket::bind(("0.0.0.0", port)).unwrap();
                socket.set_nonblocking(true).unwrap();
                socket
            };
            bed.host("server").spawn(async move {
                let socket = UdpSocket::from_std(bind(7)).unwrap();
                let mut buffer = [0; 100];
                loop {
                    let (count, from) = socket.recv_from(&mut buffer).await.unwrap();
                    socket.send_to(&buffer[..count], from).await.unwrap();
                }
            });
            let client = bed.host("client").spawn(async move {
                let socket = bind(0);
                socket.connect("server:7").unwrap();
                let socket = UdpSocket::from_std(socket).unwrap();
                let mut answered = 0;
                for number in 0..20 {
                    socket.send(&[number]).await.unwrap();
                    answered += u32::from(tokio::time::timeout(Duration::from_millis(100), socket.recv(&mut [0; 9])).await.is_ok());
                }
                assert!((10..=20).contains(&answered), "{answered}");
            });
            client.await.unwrap();
        },
    );
}

/// Instants of the standard library and of tokio are those of one clock.
#[test]
fn the_clock_of_the_standard_library_is_that_of_tokio() {
    Testbed::new(["host"]).std_clocks().on_tokio().run(async |bed: cohaptic_testkit::Bed| {
        let host = bed.host("host").spawn(async {
            let (begin, same) = (std::time::Instant::now(), tokio::time::Instant::now().into_std());
            assert_eq!(begin, same);
            sleep_until((begin + Duration::from_secs(90)).into()).await;
            assert_eq!(begin.elapsed(), Duration::from_secs(90));
            sleep(Duration::from_secs(1)).await;
            assert_eq!(std::time::Instant::now() - same, Duration::from_secs(91));
        });
        host.await.unwrap();
    });
}

/// Outside of test beds, a server and a client of the standard library are real, and may wait.
#[test]
fn real_sockets_wait() {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let to = listener.local_addr().unwrap();
    let client = std::thread::spawn(move || std::net::TcpStream::connect(to).unwrap());
    let (_stream, peer) = listener.accept().unwrap();
    assert_eq!(client.join().unwrap().local_addr().unwrap(), peer);
}
