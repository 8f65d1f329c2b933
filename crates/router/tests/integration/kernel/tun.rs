//! Between two TUN devices.

use std::collections::BTreeSet;
use std::io::{Read as _, Write as _};
use std::net::{IpAddr, Ipv6Addr, SocketAddr, TcpListener, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use cohaptic_linkfile::link_from_keys;
use cohaptic_linkfile::router::Side;
use cohaptic_units::Bytes;
use cohaptic_wan::{DropCause, Fate, Link, LinkName};
use socket2::{Domain, Protocol, Socket, Type};

use super::hosts::{Host, PATIENCE, Running};
use super::sandbox::inside;

fn v4(host: u8) -> IpAddr {
    IpAddr::from([10, 1, 0, host])
}

fn v6(host: u16) -> IpAddr {
    Ipv6Addr::new(0xfd00, 0, 0, 0, 0, 0, 0, host).into()
}

/// Starts two hosts, number 1 on the left and number 2 on the right, and the router between them.
fn hosts(text: &str) -> (Host, Host, Running) {
    let (left, right) = (Host::new(), Host::new());
    let running = Running::begin(&format!("{}{text}", sides(&left, &right)));
    left.has(v6(1));
    right.has(v6(2));
    (left, right, running)
}

/// Returns the configuration of a TUN device in the namespace of each host, with an IPv4 and an IPv6 address.
pub(super) fn sides(left: &Host, right: &Host) -> String {
    let tun = |name: &str, host: u8, namespace: &str| {
        format!(
            "{name} = {{ tun = \"{name}0\", addresses = [\"{}/24\", \"{}/64\"], mtu = 1400, namespace = \"{namespace}\" }}\n",
            v4(host),
            v6(host.into())
        )
    };
    tun("left", 1, &left.namespace) + &tun("right", 2, &right.namespace)
}

/// Sends echo requests, and returns the time until each answer.
fn ping(host: &Host, to: IpAddr, count: u16) -> Vec<Duration> {
    let (domain, protocol, kind, header) =
        if to.is_ipv4() { (Domain::IPV4, Protocol::ICMPV4, [8, 0], 20) } else { (Domain::IPV6, Protocol::ICMPV6, [128, 129], 0) };
    let mut socket = host.does(move || Socket::new(domain, Type::RAW, Some(protocol)).unwrap());
    socket.set_read_timeout(Some(PATIENCE)).unwrap();
    let once = |number: u16| {
        // Type, code, checksum, identifier, number. The kernel computes the checksum of ICMPv6.
        let [high, low] = number.to_be_bytes();
        let mut request = [kind[0], 0, 0, 0, 0x47, 0x11, high, low];
        if to.is_ipv4() {
            let sum: u32 = request.chunks(2).map(|word| u32::from(u16::from_be_bytes([word[0], word[1]]))).sum();
            request[2..4].copy_from_slice(&(!((sum & 0xffff) + (sum >> 16)) as u16).to_be_bytes());
        }
        let begin = Instant::now();
        socket.send_to(&request, &SocketAddr::new(to, 0).into()).unwrap();
        loop {
            let mut answer = [0; 200];
            let length = socket.read(&mut answer).unwrap();
            if answer[header..length].first() == Some(&kind[1]) && answer[header + 4..header + 8] == request[4..] {
                return begin.elapsed();
            }
        }
    };
    (0..count).map(once).collect()
}

const DELAY: Duration = Duration::from_millis(20);

/// Checks that no packet is earlier than its link says. Lateness is the machine's; the counters of the link show that the link itself adds none.
fn check_round_trips(times: &[Duration], least: Duration) {
    assert!(times.iter().all(|time| *time >= least), "{times:?}");
}

#[test]
fn ping_udp_and_tcp_take_as_long_as_asked_with_ipv4_and_ipv6() {
    inside("kernel::tun::ping_udp_and_tcp_take_as_long_as_asked_with_ipv4_and_ipv6", || {
        let (left, right, running) = hosts("router = { default = \"x\" }\nlinks = { x = { delay = \"20ms\" } }");
        for [here, there] in [[v4(1), v4(2)], [v6(1), v6(2)]] {
            check_round_trips(&ping(&left, there, 5), 2 * DELAY);
            check_round_trips(&ping(&right, here, 5), 2 * DELAY);
            let (client, server) = (left.udp(here, 0), right.udp(there, 7));
            let echo = thread::spawn(move || {
                let mut buffer = [0; 2000];
                for _ in 0..5 {
                    let (length, from) = server.recv_from(&mut buffer).unwrap();
                    server.send_to(&buffer[..length], from).unwrap();
                }
            });
            let round_trip = |number: u8| {
                let begin = Instant::now();
                client.send_to(&[number; 1300], SocketAddr::new(there, 7)).unwrap();
                let mut buffer = [0; 2000];
                assert_eq!((client.recv(&mut buffer).unwrap(), buffer[700]), (1300, number));
                begin.elapsed()
            };
            check_round_trips(&(0..5).map(round_trip).collect::<Vec<_>>(), 2 * DELAY);
            echo.join().unwrap();
            let listener = right.does(move || TcpListener::bind(SocketAddr::new(there, 80)).unwrap());
            let server = thread::spawn(move || {
                let (mut stream, _) = listener.accept().unwrap();
                let mut word = [0; 5];
                stream.read_exact(&mut word).unwrap();
                stream.write_all(&word).unwrap();
            });
            let begin = Instant::now();
            let mut stream = left.does(move || TcpStream::connect_timeout(&SocketAddr::new(there, 80), PATIENCE).unwrap());
            stream.set_read_timeout(Some(PATIENCE)).unwrap();
            stream.write_all(b"hello").unwrap();
            let mut word = [0; 5];
            stream.read_exact(&mut word).unwrap();
            // One round trip is for the connection, one for the word.
            assert!(begin.elapsed() >= 4 * DELAY);
            assert_eq!(&word, b"hello");
            server.join().unwrap();
        }
        let report = running.end();
        assert_eq!(report.dropped(), 0);
        assert!(report.counters.lanes.iter().all(|lane| lane.stats.delivered() >= 20 && lane.stats.mean_delay() == Some(DELAY)));
    });
}

/// The losses are the losses of the seeded link in virtual time, packet by packet. The other packets arrive complete and in order.
#[test]
fn exactly_those_packets_are_lost_that_the_seeded_link_loses_in_virtual_time() {
    const PACKETS: u16 = 300;
    inside("kernel::tun::exactly_those_packets_are_lost_that_the_seeded_link_loses_in_virtual_time", || {
        let keys = ["delay=3ms", "loss={ gilbert-elliott = { p = 0.05, r = 0.3 } }"].map(str::to_owned);
        // Only the packets of the test take the link. Other packets of a host pass without the link.
        let text = "router = { seed = 42, default = \"pass\" }\n\
            links = { wan = { delay = \"3ms\", loss = { gilbert-elliott = { p = 0.05, r = 0.3 } } } }\n\
            rules = [{ protocol = \"udp\", port = 7000, link = \"wan\" }]";
        let (left, right, running) = hosts(text);
        let mut expected_losses = Vec::new();
        for (from, [here, there]) in [(Side::Left, [v4(1), v4(2)]), (Side::Right, [v6(2), v6(1)])] {
            let (from_host, to_host) = if from == Side::Left { (&left, &right) } else { (&right, &left) };
            let end = |side: Side| format!("wan.{}", side.name());
            let mut link = Link::new(42, &LinkName::between(&end(from), &end(from.opposite())), link_from_keys(&keys).unwrap());
            (0..PACKETS).for_each(|number| link.handle_packet(cohaptic_units::Instant::ZERO, Bytes::new(30), number).unwrap());
            link.handle_timeout(cohaptic_units::Instant::from_nanos(1_000_000_000)).unwrap();
            let events = std::iter::from_fn(|| link.poll_event());
            let survivors: BTreeSet<u16> = events.filter(|event| matches!(event.fate, Fate::Delivered(_))).map(|event| event.payload).collect();
            assert!((200..290).contains(&survivors.len()), "the test needs losses and arrivals: {}", survivors.len());
            let (sender, receiver) = (from_host.udp(here, 0), to_host.udp(there, 7000));
            let mut found = Vec::new();
            // A few packets at a time, so that no buffer of a host overflows.
            for first in (0..PACKETS).step_by(20) {
                let numbers = first..first + 20;
                for number in numbers.clone() {
                    sender.send_to(&number.to_be_bytes(), SocketAddr::new(there, 7000)).unwrap();
                }
                for _ in survivors.range(numbers) {
                    let mut word = [0; 2];
                    assert_eq!(receiver.recv(&mut word).unwrap(), 2);
                    found.push(u16::from_be_bytes(word));
                }
            }
            assert_eq!(found, survivors.into_iter().collect::<Vec<_>>());
            // The last packets may be among the lost ones. The arrival of a later packet shows that the router has read them.
            let behind = to_host.udp(there, 7001);
            sender.send_to(b"!", SocketAddr::new(there, 7001)).unwrap();
            assert_eq!(behind.recv(&mut [0; 2]).unwrap(), 1);
            expected_losses.push(link.stats().dropped(DropCause::Loss));
        }
        let report = running.end();
        let lanes = &report.counters.lanes;
        assert_eq!(lanes.iter().map(|lane| lane.stats.dropped(DropCause::Loss)).collect::<Vec<_>>(), expected_losses);
        assert_eq!(lanes.iter().map(|lane| lane.stats.offered()).collect::<Vec<_>>(), [u64::from(PACKETS); 2]);
        assert_eq!(report.counters.by_rule[0].packets, 2 * u64::from(PACKETS));
    });
}

/// TCP gets at most the rate: the data arrived until a time t is at most R·t under any load of the machine, and all data arrives unchanged.
#[test]
fn tcp_gets_no_more_than_the_rate() {
    const AMOUNT: usize = 400_000;
    const BITS_PER_SECOND: f64 = 8e6;
    const QUEUE: f64 = 40.0 * 1400.0;
    inside("kernel::tun::tcp_gets_no_more_than_the_rate", || {
        let (left, right, running) = hosts("router = { default = \"x\" }\nlinks = { x = { rate = \"8Mbit\", queue = { limit = \"40 packets\" } } }");
        let there = SocketAddr::new(v4(2), 80);
        let listener = right.does(move || TcpListener::bind(there).unwrap());
        let sent: Vec<u8> = (0..AMOUNT).map(|place| (place * 31 / 7) as u8).collect();
        let sending = sent.clone();
        let begin = Instant::now();
        let sender = left.does(move || TcpStream::connect_timeout(&there, PATIENCE).unwrap());
        let writer = thread::spawn(move || (&sender).write_all(&sending).map(|()| drop(sender)).unwrap());
        let (mut stream, _) = listener.accept().unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let mut received = vec![0; AMOUNT];
        stream.read_exact(&mut received).unwrap();
        let took = begin.elapsed().as_secs_f64();
        assert!(received == sent);
        assert!(AMOUNT as f64 * 8.0 <= BITS_PER_SECOND * took + 8.0 * QUEUE, "{AMOUNT} bytes in {took} s");
        writer.join().unwrap();
        let report = running.end();
        let lane = report.counters.lane("x", Side::Left).unwrap();
        assert!(lane.delivered_bytes >= AMOUNT as u64 && report.written[1].bytes == lane.delivered_bytes);
    });
}

/// A host hands over segments of many TCP or UDP packets, and the link meets packets, with and without offloads.
#[test]
fn a_link_meets_packets_and_not_segments() {
    const AMOUNT: usize = 2_000_000;
    inside("kernel::tun::a_link_meets_packets_and_not_segments", || {
        for offloads in [true, false] {
            let (left, right) = (Host::new(), Host::new());
            let devices = sides(&left, &right).replace("mtu =", &format!("offloads = {offloads}, mtu ="));
            let running = Running::begin(&format!(
                "{devices}router = {{ default = \"pass\" }}\nlinks = {{ x = {{ delay = \"1ms\" }} }}\nrules = [{{ port = 80, link = \"x\" }}]"
            ));
            left.has(v6(1));
            right.has(v6(2));
            let sent: Vec<u8> = (0..AMOUNT).map(|place| (place * 31 / 7) as u8).collect();
            for there in [v4(2), v6(2)].map(|address| SocketAddr::new(address, 80)) {
                let listener = right.does(move || TcpListener::bind(there).unwrap());
                let sender = left.does(move || TcpStream::connect_timeout(&there, PATIENCE).unwrap());
                let sending = sent.clone();
                let writer = thread::spawn(move || (&sender).write_all(&sending).map(|()| drop(sender)).unwrap());
                let (mut stream, _) = listener.accept().unwrap();
                stream.set_read_timeout(Some(PATIENCE)).unwrap();
                let mut received = vec![0; AMOUNT];
                stream.read_exact(&mut received).unwrap();
                assert!(received == sent);
                writer.join().unwrap();
            }
            // Ten datagrams of 100 bytes and one of 50 bytes, in one call.
            let (from, to) = (left.udp(v4(1), 0), right.udp(v4(2), 80));
            socket2::SockRef::from(&from).connect(&SocketAddr::new(v4(2), 80).into()).unwrap();
            nix::sys::socket::setsockopt(&from, nix::sys::socket::sockopt::UdpGsoSegment, &100).unwrap();
            from.send(&sent[..1050]).unwrap();
            let mut buffer = [0; 2000];
            for part in sent[..1050].chunks(100) {
                let length = to.recv(&mut buffer).unwrap();
                assert_eq!(&buffer[..length], part);
            }
            let report = running.end();
            let rule = report.counters.by_rule[0];
            let lane = report.counters.lane("x", Side::Left).unwrap();
            assert!(lane.delivered_bytes >= 2 * AMOUNT as u64);
            // No packet is longer than the MTU.
            assert!(lane.delivered_bytes <= lane.stats.delivered() * 1400);
            assert_eq!((rule.packets, report.dropped()), (report.counters.lanes.iter().map(|lane| lane.stats.offered()).sum(), 0));
        }
    });
}

#[test]
fn rules_choose_the_link_of_real_traffic() {
    inside("kernel::tun::rules_choose_the_link_of_real_traffic", || {
        let text = "router = { default = \"pass\" }\nlinks = { slow = { delay = \"60ms\" }, quick = { delay = \"1ms\" }, never = { loss = \"100%\" } }\n\
            rules = [{ protocol = \"udp\", destination-port = 1000, destination = \"10.1.0.0/24\", link = \"slow\" }, { protocol = \"udp\", destination-port = \"1000-1001\", link = \"quick\" },\n\
            { protocol = \"icmp\", from = \"left\", link = \"quick\" }, { protocol = \"udp\", port = 1002, link = \"never\" }, { protocol = \"udp\", port = 1003, link = \"drop\" }]";
        let (left, right, running) = hosts(text);
        let receive = |address, port| right.udp(address, port);
        let (slow, quick, slow6) = (receive(v4(2), 1000), receive(v4(2), 1001), receive(v6(2), 1000));
        let (from, from6) = (left.udp(v4(1), 0), left.udp(v6(1), 0));
        let begin = Instant::now();
        for port in [1000, 1001, 1002, 1003] {
            from.send_to(b"x", SocketAddr::new(v4(2), port)).unwrap();
        }
        from6.send_to(b"x", SocketAddr::new(v6(2), 1000)).unwrap();
        let mut byte = [0; 1];
        for socket in [&quick, &slow6, &slow] {
            socket.recv(&mut byte).unwrap();
        }
        assert!(begin.elapsed() >= Duration::from_millis(60));
        check_round_trips(&ping(&left, v4(2), 3), Duration::from_millis(1));
        let report = running.end();
        let offered = |link: &str, from: Side| report.counters.lane(link, from).unwrap().stats.offered();
        assert_eq!(report.counters.by_rule.iter().map(|count| count.packets).collect::<Vec<_>>(), [1, 2, 3, 1, 1]);
        assert_eq!([offered("slow", Side::Left), offered("quick", Side::Left), offered("never", Side::Left)], [1, 5, 1]);
        assert_eq!([offered("slow", Side::Right), offered("quick", Side::Right)], [0, 0]);
        assert_eq!(report.counters.received[0].dropped, 1);
        // The answers to the echo requests.
        assert!(report.counters.received[1].passed >= 3);
    });
}

/// The receiver takes a damaged packet if its checksums were corrected. A packet whose checksum shows the damage never arrives.
#[test]
fn damaged_packets_arrive_or_do_not_as_asked() {
    inside("kernel::tun::damaged_packets_arrive_or_do_not_as_asked", || {
        let text = "router = { default = \"pass\" }\n\
            links = { dirty = { corrupt = { probability = \"100%\", bits = 3, bytes = \"28-91\", checksum = \"passes\" } }, found = { corrupt = \"100%\" } }\n\
            rules = [{ protocol = \"udp\", port = 1000, link = \"dirty\" }, { protocol = \"udp\", port = 1001, link = \"found\" }]";
        let (left, right, running) = hosts(text);
        let (from, to) = (left.udp(v4(1), 0), right.udp(v4(2), 1000));
        for port in [1001, 1000] {
            for _ in 0..10 {
                from.send_to(&[0; 64], SocketAddr::new(v4(2), port)).unwrap();
            }
        }
        let mut buffer = [0; 100];
        for _ in 0..10 {
            assert_eq!(to.recv(&mut buffer).unwrap(), 64);
            assert_eq!(buffer[..64].iter().map(|byte| byte.count_ones()).sum::<u32>(), 3);
        }
        let report = running.end();
        assert_eq!(report.counters.lane("found", Side::Left).unwrap().stats.dropped(DropCause::Checksum), 10);
    });
}
