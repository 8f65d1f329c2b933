//! One program on tokio's sockets, over the loopback interface of this machine, and on virtual sockets: all its results are equal.

use std::fmt::Debug;
use std::io;

use cohaptic_testkit::Testbed;
use tokio::io::Interest;

/// Results that a program saw, in words. Ports are left out, because the system chooses free ports.
#[derive(Default)]
pub(crate) struct Log(pub(crate) Vec<String>);

impl Log {
    pub(crate) fn see<T: Debug>(&mut self, what: &str, seen: io::Result<T>) {
        let seen = match seen {
            Ok(value) => format!("{value:?}"),
            // An error of the system has its number.
            Err(error) => format!("{:?} {:?}", error.kind(), error.raw_os_error()),
        };
        self.0.push(format!("{what}: {seen}"));
    }
}

macro_rules! program {
    ($name:ident, $socket:ty) => {
        async fn $name() -> Vec<String> {
            type Socket = $socket;
            let mut log = Log::default();
            let bound = Socket::bind("127.0.0.1:0").await.unwrap();
            let address = bound.local_addr().unwrap();
            let to = |socket: &Socket| socket.local_addr().unwrap();
            log.see("a free port is none", Ok(address.port() == 0));
            log.see("the address is taken", Socket::bind(address).await.map(drop));
            log.see("and so is any with that port", Socket::bind(("0.0.0.0", address.port())).await.map(drop));
            log.see("somebody else's address", Socket::bind("192.0.2.1:0").await.map(drop));
            log.see("no address", Socket::bind("nonsense").await.map(drop));
            log.see("nobody is the peer", bound.peer_addr());
            log.see("nothing has come", bound.try_recv(&mut [0; 4]));
            log.see("nothing has come from anybody", bound.try_recv_from(&mut [0; 4]));
            log.see("nothing can be looked at", bound.try_peek(&mut [0; 4]));
            log.see("it may not broadcast", bound.broadcast());
            log.see("now it may", bound.set_broadcast(true));
            log.see("it may broadcast", bound.broadcast());
            log.see("no error", bound.take_error().map(|error| error.map(|error| error.kind())));

            let other = Socket::bind("127.0.0.1:0").await.unwrap();
            log.see("without a peer", other.send(b"x").await);
            log.see("to port 0", other.send_to(b"x", "127.0.0.1:0").await);
            log.see("too long", other.send_to(&vec![0; 65_508], address).await);
            log.see("as long as can be", other.send_to(&vec![7; 65_507], address).await);
            let mut long = vec![0; 70_000];
            log.see("all of it", bound.recv(&mut long).await);
            log.see("as it was", Ok(long[..65_507].iter().all(|byte| *byte == 7)));
            log.see("nothing", other.send_to(b"", address).await);
            log.see("nothing came", bound.recv_from(&mut [0; 4]).await.map(|(len, from)| (len, from == to(&other))));
            log.see("six bytes", other.send_to(b"abcdef", address).await);
            log.see("it can be read", bound.readable().await);
            let mut short = [0; 4];
            log.see("looked at", bound.peek_from(&mut short).await.map(|(len, from)| (len, from == to(&other))));
            log.see("its sender", bound.peek_sender().await.map(|from| from == to(&other)));
            log.see("cut off", bound.recv(&mut short).await);
            log.see("its begin", Ok(short));
            log.see("the rest is gone", bound.try_recv(&mut short));
            let mut room = Vec::with_capacity(4);
            other.send_to(b"wxyz12", address).await.unwrap();
            bound.readable().await.unwrap();
            log.see("into the room", bound.recv_buf_from(&mut room).await.map(|(len, _)| len > 3));
            log.see("what there was of it", Ok(room[..4].to_vec()));
            log.see("always writable", other.writable().await);

            log.see("connected", other.connect(address).await);
            log.see("its peer", other.peer_addr().map(|peer| peer == address));
            log.see("to the peer", other.send(b"one").await);
            log.see("from the peer's peer", bound.recv(&mut short).await);
            let stranger = Socket::bind("127.0.0.1:0").await.unwrap();
            stranger.send_to(b"from a stranger", to(&other)).await.unwrap();
            bound.send_to(b"peer", to(&other)).await.unwrap();
            log.see("hears its peer", other.recv(&mut short).await);
            log.see("the peer's", Ok(short));
            log.see("and no stranger", other.try_recv(&mut short));
            log.see("to somebody else all the same", other.send_to(b"hi", to(&stranger)).await);
            log.see("who hears it", stranger.recv(&mut short).await);

            let gone = to(&stranger);
            drop(stranger);
            other.connect(gone).await.unwrap();
            log.see("to a closed port", other.send(b"x").await);
            log.see("refused", other.recv(&mut short).await);
            log.see("once", other.try_recv(&mut short));
            log.see("to a closed port again", other.send(b"x").await);
            log.see("refused when it sends", other.send(b"x").await);
            let unconnected = Socket::bind("127.0.0.1:0").await.unwrap();
            log.see("not connected", unconnected.send_to(b"x", gone).await);
            log.see("and so not told", unconnected.try_recv(&mut short));
            log.see("closed ports are free", Socket::bind(gone).await.map(drop));

            let any = Socket::bind("0.0.0.0:0").await.unwrap();
            let at_any = std::net::SocketAddr::from((std::net::Ipv4Addr::LOCALHOST, any.local_addr().unwrap().port()));
            other.connect(at_any).await.unwrap();
            log.see("to a socket of all addresses", other.send(b"any").await);
            log.see("which hears it", any.recv_from(&mut short).await.map(|(len, from)| (len, from == to(&other))));
            log.see("and answers", any.send_to(b"yes", to(&other)).await);
            log.see("from the address that was meant", other.recv(&mut short).await);
            let nowhere = (std::net::Ipv4Addr::UNSPECIFIED, any.local_addr().unwrap().port());
            log.see("to no address is to oneself", unconnected.send_to(b"self", std::net::SocketAddr::from(nowhere)).await);
            log.see("as it is heard", any.recv_from(&mut short).await.map(|(len, from)| (len, from == to(&unconnected))));
            log.see("time to live", any.ttl());
            log.see("none", any.set_ttl(0));
            log.see("too much", any.set_ttl(256));
            log.see("another", any.set_ttl(9));
            log.see("as said", any.ttl());
            log.see("type of service", any.tos_v4());
            log.see("capable of marks", any.set_tos_v4(0b10));
            log.see("as said", any.tos_v4());
            log.see("multicast", any.multicast_ttl_v4().and_then(|ttl| Ok((ttl, any.multicast_loop_v4()?))));
            log.see("nothing to read", any.try_io(Interest::READABLE, || any.try_recv(&mut [0; 1])));
            log.see(
                "ready to send",
                any.ready(Interest::READABLE | Interest::WRITABLE).await.map(|ready| (ready.is_readable(), ready.is_writable())),
            );
            any.send_to(b"own", to(&any)).await.unwrap();
            log.see("by hand", any.async_io(Interest::READABLE, || any.try_recv(&mut [0; 8])).await);
            let six = Socket::bind("[::1]:0").await.unwrap();
            log.see("over the other version", six.send_to(b"six", to(&six)).await);
            log.see("heard", six.recv_from(&mut short).await.map(|(len, from)| (len, from == to(&six))));
            let both = Socket::bind("[::]:0").await.unwrap();
            let port = to(&both).port();
            log.see("both versions are taken", Socket::bind(("0.0.0.0", port)).await.map(drop));
            log.see("and each address", Socket::bind(("127.0.0.1", port)).await.map(drop));
            log.see("over version 4", unconnected.send_to(b"four", ("127.0.0.1", port)).await);
            let (len, from) = both.recv_from(&mut short).await.unwrap();
            log.see("from an address of version 6", Ok((len, from.ip(), from.port() == to(&unconnected).port())));
            log.see("the answer", both.send_to(b"back", from).await);
            log.see("over version 4 again", unconnected.recv_from(&mut short).await.map(|(len, from)| (len, from.ip(), from.port() == port)));
            log.see("connected over version 4", both.connect(from).await);
            log.see("from here", both.local_addr().map(|local| local.ip()));
            log.see("to there", both.peer_addr().map(|peer| peer == from));
            log.see("bound to version 6, to version 4", six.send_to(b"x", ("::ffff:127.0.0.1", port)).await);
            let wide = Socket::bind("0.0.0.0:0").await.unwrap();
            let port = to(&wide).port();
            log.see("another address of loopback", unconnected.send_to(b"five", ("127.0.0.5", port)).await);
            log.see("reaches all addresses", wide.recv(&mut short).await);
            log.see("and not the first one", other.send_to(b"x", ("127.0.0.5", to(&bound).port())).await);
            log.see("as is seen", bound.try_recv(&mut short).map_err(|_| io::ErrorKind::WouldBlock.into()));
            log.see("connected to it", wide.connect(("127.0.0.5", 9)).await);
            log.see("from the first one", wide.local_addr().map(|local| local.ip()));
            let broadcasting = Socket::bind("0.0.0.0:0").await.unwrap();
            log.see("no broadcast without leave", broadcasting.send_to(b"x", "255.255.255.255:9").await);
            log.0
        }
    };
}

program!(on_tokio, tokio::net::UdpSocket);
program!(on_a_test_bed, cohaptic_testkit::UdpSocket);

#[test]
fn a_program_sees_the_same_on_virtual_sockets_and_on_tokios() {
    let bed = || Testbed::new(["machine"]);
    let program = |bed: cohaptic_testkit::Bed| async move { bed.host("machine").spawn(on_a_test_bed()).await.unwrap() };
    let ours = bed().run_twice(program);
    assert_eq!(bed().on_tokio().run_twice(program), ours, "both runtimes");
    // On this machine IPv6 may be switched off.
    if std::net::UdpSocket::bind("[::1]:0").is_err() {
        return;
    }
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let theirs = runtime.block_on(on_tokio());
    for (ours, theirs) in ours.iter().zip(&theirs) {
        assert_eq!(ours, theirs);
    }
    assert_eq!(ours.len(), theirs.len());
}
