//! Between two Ethernet interfaces, as between the two cards of a machine. Here the interfaces are the ends of two veth pairs.

use std::io::{Read as _, Write as _};
use std::net::{IpAddr, Ipv6Addr, SocketAddr, TcpListener, TcpStream};
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use cohaptic_linkfile::router::{RouterFile, Side};
use cohaptic_router::{OpenError, Router};

use super::hosts::{Host, PATIENCE, Running};
use super::sandbox::inside;

/// Runs `ip` with the given words, and returns the reason of a failure.
pub(super) fn ip(words: &str) -> Result<(), String> {
    let output = Command::new("ip").args(words.split_whitespace()).output().map_err(|error| error.to_string())?;
    if output.status.success() { Ok(()) } else { Err(format!("ip {words}: {}", String::from_utf8_lossy(&output.stderr))) }
}

/// Returns a host at the far end of a cable. The near end is `device` in the namespace of the test.
fn cable(device: &'static str, number: u8) -> Result<Host, String> {
    let host = Host::new();
    let far = format!("h{number}");
    ip(&format!("link add {device} type veth peer name {far}"))?;
    ip(&format!("link set {far} netns {}", host.namespace))?;
    ip(&format!("link set {device} up"))?;
    host.does(move || {
        ip(&format!("address add 10.1.0.{number}/24 dev {far}"))?;
        ip(&format!("address add fd00::{number}/64 dev {far} nodad"))?;
        // Otherwise the host hands over TCP segments longer than any frame, for the device to cut.
        ip(&format!("link set {far} gso_max_segs 1"))?;
        ip(&format!("link set {far} up"))
    })?;
    host.has(Ipv6Addr::new(0xfd00, 0, 0, 0, 0, 0, 0, number.into()).into());
    Ok(host)
}

/// ARP, neighbour discovery, UDP and TCP cross the router. A checksum that the sender leaves to its device, as Linux does on veth, is right at the other end.
#[test]
fn hosts_on_two_cables_reach_each_other() {
    const DELAY: Duration = Duration::from_millis(10);
    inside("kernel::ethernet::hosts_on_two_cables_reach_each_other", || {
        let (left, right) = match cable("near1", 1).and_then(|left| Ok((left, cable("near2", 2)?))) {
            Ok(hosts) => hosts,
            Err(why) => return println!("skipped: cannot make veth devices: {why}"),
        };
        let running = Running::begin(
            "left = { interface = \"near1\" }\nright = { interface = \"near2\" }\nrouter = { default = \"x\" }\nlinks = { x = { delay = \"10ms\" } }",
        );
        let addresses = [IpAddr::from([10, 1, 0, 2]), Ipv6Addr::new(0xfd00, 0, 0, 0, 0, 0, 0, 2).into()];
        for there in addresses {
            let any: IpAddr = if there.is_ipv4() { IpAddr::from([0; 4]) } else { IpAddr::from([0_u8; 16]) };
            let (client, server) = (left.udp(any, 0), right.udp(there, 7));
            let mut buffer = [0; 2000];
            let begin = Instant::now();
            client.send_to(&[7; 1001], SocketAddr::new(there, 7)).unwrap();
            let (length, from) = server.recv_from(&mut buffer).unwrap();
            server.send_to(&buffer[..length], from).unwrap();
            assert_eq!((client.recv(&mut buffer).unwrap(), buffer[1000]), (1001, 7));
            assert!(begin.elapsed() >= 2 * DELAY);
            let listener = right.does(move || TcpListener::bind(SocketAddr::new(there, 80)).unwrap());
            let sent: Vec<u8> = (0..100_000_usize).map(|place| (place * 31 / 7) as u8).collect();
            let sending = sent.clone();
            let sender = left.does(move || TcpStream::connect_timeout(&SocketAddr::new(there, 80), PATIENCE).unwrap());
            let writer = thread::spawn(move || (&sender).write_all(&sending).map(|()| drop(sender)).unwrap());
            let (mut stream, _) = listener.accept().unwrap();
            stream.set_read_timeout(Some(PATIENCE)).unwrap();
            let mut received = vec![0; sent.len()];
            stream.read_exact(&mut received).unwrap();
            assert!(received == sent);
            writer.join().unwrap();
        }
        let report = running.end();
        assert!(report.counters.received.iter().all(|received| received.not_ip >= 1), "ARP went both ways");
        assert_eq!(report.written.map(|written| written.lost()), [0, 0]);
        assert!(report.counters.lane("x", Side::Left).unwrap().delivered_bytes >= 200_000);
    });
}

#[test]
fn what_cannot_be_opened_says_why() {
    inside("kernel::ethernet::what_cannot_be_opened_says_why", || {
        let open = |left: &str, right: &str| {
            let text = format!("left = {left}\nright = {right}\nrouter = {{ default = \"pass\" }}");
            let file = RouterFile::parse(&text, "x".as_ref(), &[]).unwrap_or_else(|error| panic!("{error}"));
            Router::open(&file, cohaptic_realtime::Pacing::Sleep).err().as_ref().map(OpenError::to_string)
        };
        let cases = [
            (
                open("{ interface = \"no0\" }", "{ interface = \"no1\" }"),
                "left, device no0: there is no such device in the network namespace of the program",
            ),
            (open("{ interface = \"lo\" }", "{ interface = \"no1\" }"), "left, device lo: it does not carry Ethernet (type 772)"),
            (open("{ tun = \"t0\", existing = true }", "{ tun = \"t1\" }"), "left, device t0: there is no such device"),
            (
                open("{ tun = \"t0\" }", "{ tun = \"t1\", namespace = \"/no/such\" }"),
                "right, device t1: cannot open the network namespace /no/such: ",
            ),
            (open("{ tun = \"t0\" }", "{ tun = \"lo\" }"), "right, device lo: cannot open it through /dev/net/tun: "),
        ];
        for (found, expected) in cases {
            let found = found.unwrap();
            assert!(found.starts_with(expected), "{found}");
        }
        // Devices disappear with the router, so the same names can be used again.
        assert_eq!(open("{ tun = \"t0\" }", "{ tun = \"t1\" }"), None);
        assert_eq!(open("{ tun = \"t0\", addresses = [\"10.0.0.1/24\", \"10.0.1.1/24\", \"fd00::1/64\"], mtu = 1300 }", "{ tun = \"t1\" }"), None);
    });
}
