//! Addresses, names and errors are those of Linux through the package as well. `crates/testkit/tests` has the whole table.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, SocketAddrV4, SocketAddrV6};
use std::time::Duration;

use cohaptic_testkit::{Bed, Testbed};
use tokio::io::{AsyncReadExt, AsyncWriteExt, Interest};
use tokio::net::{TcpListener, TcpStream, ToSocketAddrs, UdpSocket, lookup_host};
use tokio::time::Instant;

/// Runs a program on the client. A round trip takes 20 ms.
fn on_client<F: Future<Output = ()> + 'static>(program: impl FnOnce(Bed) -> F + 'static) {
    Testbed::new(["client", "server"]).links("delay 10ms").on_tokio().run(|bed: Bed| async move {
        bed.host("client").spawn(program(bed.clone())).await.unwrap();
    });
}

async fn found(description: impl ToSocketAddrs) -> Vec<String> {
    lookup_host(description).await.unwrap().map(|address| address.to_string()).collect()
}

#[test]
fn names_and_forms_of_addresses() {
    on_client(async |_| {
        assert_eq!(found("localhost:80").await, ["[::1]:80", "127.0.0.1:80"]);
        for name in [found("server:80").await, found(("SERVER.", 80)).await, found(("server".to_owned(), 80)).await] {
            assert_eq!(name, ["10.0.0.2:80", "[fd00::2]:80"]);
        }
        let (v4, v6) = (Ipv4Addr::new(10, 0, 0, 2), Ipv6Addr::new(0xfd00, 0, 0, 0, 0, 0, 0, 2));
        for four in [
            found(SocketAddr::from((v4, 80))).await,
            found(SocketAddrV4::new(v4, 80)).await,
            found((v4, 80)).await,
            found((IpAddr::from(v4), 80)).await,
            found("10.0.0.2:80").await,
        ] {
            assert_eq!(four, ["10.0.0.2:80"]);
        }
        assert_eq!(found(SocketAddrV6::new(v6, 80, 0, 0)).await, found((v6, 80)).await);
        let both = [SocketAddr::from((v4, 80)), SocketAddr::from((v6, 80))];
        assert_eq!(found(&both[..]).await, found("server:80").await);
    });
}

#[test]
fn each_address_is_tried_and_errors_have_the_numbers_of_linux() {
    on_client(async |bed| {
        bed.host("server").spawn(async {
            let listener = TcpListener::bind("[fd00::2]:80").await.unwrap();
            let both = TcpListener::bind("[::]:81").await.unwrap();
            assert_eq!(TcpListener::bind("0.0.0.0:81").await.unwrap_err().raw_os_error(), Some(98));
            assert_eq!(both.accept().await.unwrap().1.ip().to_string(), "::ffff:10.0.0.1");
            drop(listener.accept().await);
        });
        let begin = Instant::now();
        let number = async |to: &str| TcpStream::connect(to).await.unwrap_err().raw_os_error();
        TcpStream::connect("10.0.0.2:81").await.unwrap();
        // IPv4 refuses, IPv6 answers.
        assert!(TcpStream::connect("server:80").await.unwrap().peer_addr().unwrap().is_ipv6());
        assert_eq!((number("server:82").await, begin.elapsed()), (Some(111), Duration::from_millis(100)));
        assert_eq!(number("192.0.2.1:80").await, Some(101));
        assert_eq!((number("10.0.0.77:80").await, begin.elapsed()), (Some(113), Duration::from_millis(3100)));
        let _local = TcpListener::bind("127.0.0.1:7").await.unwrap();
        assert_eq!(TcpStream::connect("localhost:7").await.unwrap().peer_addr().unwrap().to_string(), "127.0.0.1:7");
        let socket = UdpSocket::bind("0.0.0.0:0").await.unwrap();
        assert_eq!(socket.send(b"x").await.unwrap_err().raw_os_error(), Some(89));
        assert_eq!(socket.send_to(&[0; 65_508], "10.0.0.2:1").await.unwrap_err().raw_os_error(), Some(90));
        socket.connect("server:9").await.unwrap();
        assert_eq!(socket.local_addr().unwrap().ip().to_string(), "10.0.0.1");
    });
}

#[test]
fn an_own_shutdown_closes_nothing_while_the_peer_is_open() {
    on_client(async |bed| {
        bed.host("server").spawn(async {
            let (mut stream, _) = TcpListener::bind("0.0.0.0:80").await.unwrap().accept().await.unwrap();
            stream.read_to_end(&mut Vec::new()).await.unwrap();
            tokio::time::sleep(Duration::from_secs(1)).await;
        });
        let mut stream = TcpStream::connect("server:80").await.unwrap();
        stream.shutdown().await.unwrap();
        assert!(!stream.ready(Interest::WRITABLE).await.unwrap().is_write_closed());
        assert_eq!(stream.read(&mut [0; 1]).await.unwrap(), 0);
        let ready = stream.ready(Interest::READABLE | Interest::WRITABLE).await.unwrap();
        assert!(ready.is_write_closed() && ready.is_read_closed());
    });
}
