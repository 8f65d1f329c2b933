//! The sockets of quinn: `sendmsg` and `recvmmsg` with control messages.

use std::io::IoSliceMut;
use std::net::{IpAddr, Ipv4Addr, UdpSocket};
use std::time::Duration;

use cohaptic_testkit::time::sleep;
use cohaptic_testkit::{Bed, Testbed};
use quinn_udp::{BATCH_SIZE, EcnCodepoint, RecvMeta, Transmit, UdpSocketState};

use crate::run;

/// Datagrams of both versions of IP have their codepoint, and the address to which they were sent, and come without offload.
#[test]
fn codepoints_and_addresses_arrive() {
    for (at, to, shown) in
        [("0.0.0.0:7", "10.0.0.2:7", "10.0.0.2"), ("[::]:7", "[fd00::2]:7", "fd00::2"), ("[::]:7", "[::ffff:10.0.0.2]:7", "10.0.0.2")]
    {
        run(move |bed: Bed| async move {
            let server = bed.host("server").spawn(async move {
                let socket = UdpSocket::bind(at).unwrap();
                let state = UdpSocketState::new((&socket).into()).unwrap();
                assert_eq!((state.max_gso_segments(), state.gro_segments()), (1, 1));
                sleep(Duration::from_millis(15)).await;
                let mut memory = [[0_u8; 100]; BATCH_SIZE];
                let mut buffers = memory.each_mut().map(|buffer| IoSliceMut::new(buffer));
                let mut metas = [RecvMeta::default(); BATCH_SIZE];
                assert_eq!(state.recv((&socket).into(), &mut buffers, &mut metas).unwrap(), 2);
                assert_eq!((metas[0].ecn, metas[1].ecn), (Some(EcnCodepoint::Ect0), None));
                for meta in &metas[..2] {
                    assert_eq!(meta.dst_ip.map(|ip| ip.to_canonical()), Some(shown.parse().unwrap()));
                    assert_eq!((meta.len, meta.stride), (5, 5));
                }
                assert!(state.recv((&socket).into(), &mut buffers, &mut metas).is_err());
            });
            let client = bed.host("client").spawn(async move {
                let any = if at.starts_with('[') { "[::]:0" } else { "0.0.0.0:0" };
                let socket = UdpSocket::bind(any).unwrap();
                let state = UdpSocketState::new((&socket).into()).unwrap();
                let destination = to.parse().unwrap();
                let send = |ecn, src_ip: Option<IpAddr>| {
                    let transmit = Transmit { destination, ecn, contents: b"hello", segment_size: None, src_ip };
                    state.try_send((&socket).into(), &transmit)
                };
                send(Some(EcnCodepoint::Ect0), None).unwrap();
                send(None, None).unwrap();
                // The host has no such address to send from.
                let foreign: IpAddr = if at.starts_with('[') { "fd00::9".parse().unwrap() } else { "10.0.0.9".parse().unwrap() };
                assert_eq!(send(None, Some(foreign)).unwrap_err().raw_os_error(), Some(libc::EINVAL));
            });
            server.await.unwrap();
            client.await.unwrap();
        });
    }
}

/// A host with two interfaces sends from the address that the program names, whichever interface the host would choose.
#[test]
fn a_datagram_leaves_by_the_interface_of_its_address() {
    Testbed::new(["phone", "server"]).interfaces("phone", ["wifi", "lte"]).run(async |bed: Bed| {
        let server = bed.host("server").spawn(async {
            let socket = UdpSocket::bind("0.0.0.0:7").unwrap();
            socket.join_multicast_v4(&Ipv4Addr::new(224, 0, 0, 251), &Ipv4Addr::UNSPECIFIED).unwrap();
            sleep(Duration::from_millis(1)).await;
            [(); 6].map(|()| socket.recv_from(&mut [0; 9]).unwrap().1.ip())
        });
        let phone = bed.host("phone");
        let sent = phone.clone().spawn(async move {
            let [lte, wifi] = ["lte", "wifi"].map(|name| phone.uplink(name).v4);
            let send = |at: &str, to: &str, src_ip| {
                let socket = UdpSocket::bind(at).unwrap();
                let state = UdpSocketState::new((&socket).into()).unwrap();
                let transmit = Transmit { destination: to.parse().unwrap(), ecn: None, contents: b"hello", segment_size: None, src_ip };
                state.try_send((&socket).into(), &transmit).unwrap();
            };
            // The unspecified address names none.
            for src_ip in [Some(lte), Some(wifi), Some(Ipv4Addr::UNSPECIFIED), None] {
                send("0.0.0.0:0", "10.0.0.2:7", src_ip.map(IpAddr::from));
            }
            // A socket of IPv6 names an address of IPv4 in its own form.
            send("[::]:0", "[::ffff:10.0.0.2]:7", Some(lte.to_ipv6_mapped().into()));
            send("0.0.0.0:0", "224.0.0.251:7", Some(lte.into()));
            [lte, wifi, wifi, wifi, lte, lte].map(IpAddr::from)
        });
        assert_eq!(server.await.unwrap(), sent.await.unwrap());
    });
}
