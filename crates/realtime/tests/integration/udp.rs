//! Sockets on loopback: every datagram arrives complete, once and in order. Nothing here depends on speed.

use std::net::{SocketAddr, UdpSocket};
use std::os::fd::AsFd as _;
use std::time::Duration;

use cohaptic_realtime::udp::{Ecn, EndpointConfig, ReceiveBuffers, UdpEndpoint};
use cohaptic_realtime::{Clock as _, MonotonicClock, Pacer, Pacing};
use cohaptic_units::Instant;

type Received = (SocketAddr, Vec<u8>, Option<Ecn>, Instant);

const LOOPBACKS: [&str; 2] = ["127.0.0.1:0", "[::1]:0"];

fn endpoint(address: &str, config: EndpointConfig) -> UdpEndpoint {
    UdpEndpoint::bind(address.parse().unwrap(), config).unwrap()
}

/// Reads until `count` datagrams have arrived. The bound is for a busy machine; the wait ends with the last datagram.
fn receive(endpoint: &mut UdpEndpoint, clock: &MonotonicClock, count: usize) -> Vec<Received> {
    let (mut buffers, mut received) = (ReceiveBuffers::new(), Vec::new());
    let end = clock.now() + Duration::from_secs(60);
    while received.len() < count && clock.now() < end {
        Pacer::new(Pacing::Sleep).wait(clock, Some(end), &[endpoint.as_fd()]).unwrap();
        endpoint.receive(&mut buffers, clock, |datagram| received.push((datagram.from, datagram.bytes.to_vec(), datagram.ecn, datagram.at))).unwrap();
    }
    received
}

#[test]
fn what_goes_out_together_comes_in_one_by_one_in_order_with_its_congestion_bits() {
    for address in LOOPBACKS {
        let clock = MonotonicClock::start();
        let (mut sender, mut receiver) = (endpoint(address, EndpointConfig::default()), endpoint(address, EndpointConfig::default()));
        let lengths: Vec<usize> = (0..200).map(|n| [64, 64, 64, 64, 9, 0, 1232, 1232, 3000, 64][n % 10]).collect();
        let ecn = |n: usize| [None, Some(Ecn::Ect0), Some(Ecn::Ect1), Some(Ecn::Ce)][n / 50];
        let before = clock.now();
        let mut received = Vec::new();
        // Sent in parts, so that even the smallest receive buffer of a system holds each part.
        for part in 0..10 {
            for (n, length) in lengths.iter().enumerate().skip(part * 20).take(20) {
                let content: Vec<u8> = (0..*length).map(|place| u8::try_from((n + place) % 256).unwrap()).collect();
                sender.queue(receiver.local_address(), &content, ecn(n));
            }
            sender.flush();
            received.extend(receive(&mut receiver, &clock, 20));
        }
        let after = clock.now();
        assert_eq!(received.len(), 200);
        for (n, (from, bytes, marks, at)) in received.iter().enumerate() {
            assert_eq!((*from, bytes.len(), *marks), (sender.local_address(), lengths[n], ecn(n)), "{n}");
            assert!(bytes.iter().enumerate().all(|(place, byte)| usize::from(*byte) == (n + place) % 256));
            assert!((before..=after).contains(at));
        }
        assert!(received.is_sorted_by_key(|(.., at)| *at));
        assert_eq!((sender.counts().sent, sender.counts().failures.in_all(), receiver.counts().received), (200, 0, 200));
        assert!(sender.counts().send_calls <= 200);
        assert_eq!(receiver.kernel_drops().unwrap(), Some(0));
    }
}

#[test]
fn the_longest_datagram_is_whole_and_a_longer_one_than_asked_for_is_counted() {
    let clock = MonotonicClock::start();
    let mut wide = endpoint("127.0.0.1:0", EndpointConfig::default());
    let mut narrow = endpoint("127.0.0.1:0", EndpointConfig { largest: 100, ..EndpointConfig::default() });
    let mut sender = endpoint("127.0.0.1:0", EndpointConfig::default());
    // 65,535 bytes less the headers of IPv4 and UDP.
    let longest: Vec<u8> = (0..65_507_u32).map(|n| u8::try_from(n % 251).unwrap()).collect();
    sender.queue(wide.local_address(), &longest, None);
    for length in [101, 100, 99] {
        sender.queue(narrow.local_address(), &longest[..length], None);
    }
    sender.queue(wide.local_address(), &[0; 65_508], None);
    sender.flush();
    assert_eq!(receive(&mut wide, &clock, 1)[0].1, longest);
    let lengths: Vec<usize> = receive(&mut narrow, &clock, 2).iter().map(|(_, bytes, ..)| bytes.len()).collect();
    assert_eq!((lengths, narrow.counts().oversized), (vec![100, 99], 1));
    assert_eq!((sender.counts().sent, sender.counts().failures.too_large), (4, 1));
}

#[test]
fn one_that_cannot_be_sent_is_counted_and_the_others_go_on() {
    let clock = MonotonicClock::start();
    let (mut sender, mut receiver) = (endpoint("127.0.0.1:0", EndpointConfig::default()), endpoint("127.0.0.1:0", EndpointConfig::default()));
    let there = receiver.local_address();
    let nobody = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    sender.queue(there, b"first", None);
    // Port number 0 cannot be a target.
    sender.queue("127.0.0.1:0".parse().unwrap(), b"nowhere", None);
    // An IPv4 socket cannot send to an IPv6 address.
    sender.queue("[::1]:9".parse().unwrap(), b"nowhere", None);
    // No socket listens at this port. The kernel accepts the datagram all the same.
    sender.queue(nobody, b"nobody", None);
    sender.queue(there, b"last", None);
    sender.flush();
    let texts: Vec<Vec<u8>> = receive(&mut receiver, &clock, 2).into_iter().map(|(_, bytes, ..)| bytes).collect();
    assert_eq!(texts, [b"first".to_vec(), b"last".to_vec()]);
    assert_eq!((sender.counts().sent, sender.counts().failures.in_all()), (3, 2));
    assert!(!sender.has_waiting());
}

#[test]
fn what_waits_is_bounded_and_what_the_kernel_drops_is_known() {
    let mut sender = endpoint("127.0.0.1:0", EndpointConfig { waiting: 3, ..EndpointConfig::default() });
    // The smallest receive buffer of Linux holds a few datagrams.
    let small = endpoint("127.0.0.1:0", EndpointConfig { receive_buffer: 1, ..EndpointConfig::default() });
    assert!(small.granted_receive_buffer() > 0);
    for _ in 0..5 {
        sender.queue(small.local_address(), &[0; 64], None);
    }
    assert!(sender.has_waiting());
    sender.flush();
    assert_eq!((sender.counts().sent, sender.counts().failures.full), (3, 2));
    for _ in 0..100 {
        sender.queue(small.local_address(), &[0; 1000], None);
        sender.flush();
    }
    assert!(small.kernel_drops().unwrap().unwrap() > 0);
}

/// The sender has the kernel cut one long call into 64 datagrams. At a socket without joining, a batch has at most [`UdpEndpoint::BATCH`] datagrams.
#[test]
fn a_batch_of_single_datagrams_has_no_more_than_it_says() {
    let clock = MonotonicClock::start();
    let (sent, mut most) = (2 * UdpEndpoint::BATCH, [0; 2]);
    for (most, joined) in most.iter_mut().zip([false, true]) {
        let mut receiver = endpoint("127.0.0.1:0", EndpointConfig { joined, ..EndpointConfig::default() });
        let mut sender = endpoint("127.0.0.1:0", EndpointConfig::default());
        for number in 0..sent {
            sender.queue(receiver.local_address(), &[u8::try_from(number).unwrap(); 88], None);
        }
        sender.flush();
        let (mut buffers, mut numbers) = (ReceiveBuffers::new(), Vec::new());
        let end = clock.now() + Duration::from_secs(60);
        while numbers.len() < sent && clock.now() < end {
            let before = numbers.len();
            receiver.receive(&mut buffers, &clock, |datagram| numbers.push(usize::from(datagram.bytes[0]))).unwrap();
            *most = (numbers.len() - before).max(*most);
        }
        assert!(numbers.into_iter().eq(0..sent));
    }
    assert!(most[0] <= UdpEndpoint::BATCH, "{most:?}");
}

#[test]
fn what_must_not_delay_others_is_sent_at_once_or_dropped() {
    let clock = MonotonicClock::start();
    let (mut sender, mut receiver) = (endpoint("127.0.0.1:0", EndpointConfig::default()), endpoint("127.0.0.1:0", EndpointConfig::default()));
    let there = receiver.local_address();
    sender.send_or_drop(there, b"at once");
    sender.queue(there, b"waits", None);
    sender.send_or_drop(there, b"dropped");
    sender.flush();
    sender.send_or_drop(there, b"again");
    let texts: Vec<Vec<u8>> = receive(&mut receiver, &clock, 3).into_iter().map(|(_, bytes, ..)| bytes).collect();
    assert_eq!(texts, [b"at once".to_vec(), b"waits".to_vec(), b"again".to_vec()]);
    assert_eq!((sender.counts().sent, sender.counts().failures.full), (3, 1));
}

#[test]
fn an_address_that_is_taken_is_refused_with_the_address() {
    let first = endpoint("[::1]:0", EndpointConfig::default());
    let error = UdpEndpoint::bind(first.local_address(), EndpointConfig::default()).unwrap_err();
    assert_eq!(error.address, first.local_address());
    assert!(error.to_string().starts_with(&format!("cannot listen on {}: ", first.local_address())), "{error}");
    // The same port number in the other address family is another socket.
    let v4 = SocketAddr::new([127, 0, 0, 1].into(), first.local_address().port());
    if let Err(error) = UdpEndpoint::bind(v4, EndpointConfig::default()) {
        // Another program may hold the port.
        assert_eq!(error.source.kind(), std::io::ErrorKind::AddrInUse);
    }
}

#[test]
fn what_came_while_the_kernel_did_not_stamp_yet_is_not_placed_behind_what_came_later() {
    let clock = MonotonicClock::start();
    let mut receiver = endpoint("127.0.0.1:0", EndpointConfig::default());
    let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
    // The kernel begins to stamp some milliseconds after the first request for stamps, which is sometimes in the middle of these datagrams.
    for n in 0..200_u8 {
        sender.send_to(&[n], receiver.local_address()).unwrap();
        std::thread::sleep(Duration::from_micros(50));
    }
    let received = receive(&mut receiver, &clock, 200);
    assert!(received.iter().map(|(_, bytes, ..)| bytes[0]).eq(0..200));
    assert!(received.is_sorted_by_key(|(.., at)| *at));
}
