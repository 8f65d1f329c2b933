//! What the router carries at most, beside what the same two devices carry with nothing but a copy between them, and beside a bridge of the kernel:
//! `cargo test --release -p cohaptic-router -- --ignored --nocapture --test-threads=1 throughput`. The figures depend on the machine, so nothing is asked of
//! them here.

use std::fs;
use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::fd::AsFd as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use cohaptic_realtime::{Clock as _, MonotonicClock, Pacing, Wishes, prepare_thread};
use tun_rs::{DeviceBuilder, SyncDevice};

use super::ethernet::ip;
use super::hosts::{Host, PATIENCE, Running};
use super::sandbox::inside_as_root;

const WARM_UP: Duration = Duration::from_millis(800);
const SPAN: Duration = Duration::from_secs(2);
const RUNS: usize = 3;
const THERE: [u8; 4] = [10, 1, 0, 2];

/// The bits that one connection carries in a second.
fn tcp(left: &Host, right: &Host) -> f64 {
    // Four gigabits for 50 ms are 25 MB.
    left.does(|| fs::write("/proc/sys/net/ipv4/tcp_wmem", "4096 1000000 67108864").unwrap());
    right.does(|| fs::write("/proc/sys/net/ipv4/tcp_rmem", "4096 1000000 67108864").unwrap());
    let there = SocketAddr::from((THERE, 5001));
    let listener = right.does(move || TcpListener::bind(there).unwrap());
    let mut from = left.does(move || TcpStream::connect_timeout(&there, PATIENCE).unwrap());
    let (mut to, _) = listener.accept().unwrap();
    from.set_write_timeout(Some(Duration::from_secs(1))).unwrap();
    to.set_read_timeout(Some(Duration::from_secs(1))).unwrap();
    let writer = thread::spawn(move || {
        let block = vec![7; 128 << 10];
        while from.write(&block).is_ok() {}
    });
    let mut block = vec![0; 256 << 10];
    let begin = Instant::now();
    let mut count = |until: Duration| {
        let (mut bytes, from) = (0, begin.elapsed());
        while begin.elapsed() < until {
            bytes += to.read(&mut block).unwrap_or(0);
        }
        bytes as f64 / (begin.elapsed() - from).as_secs_f64()
    };
    count(WARM_UP);
    let rate = count(WARM_UP + SPAN) * 8.0;
    drop(to);
    writer.join().unwrap();
    rate
}

/// Packets of 64 bytes in a second: sent, and arrived.
fn datagrams(left: &Host, right: &Host) -> [f64; 2] {
    let (from, to) = (left.udp([10, 1, 0, 1].into(), 0), right.udp(THERE.into(), 7));
    from.connect(SocketAddr::from((THERE, 7))).unwrap();
    to.set_read_timeout(Some(Duration::from_millis(300))).unwrap();
    socket2::SockRef::from(&to).set_recv_buffer_size(4 << 20).unwrap();
    let sender = thread::spawn(move || {
        let (begin, mut sent) = (Instant::now(), 0_u32);
        while begin.elapsed() < SPAN {
            sent += u32::from(from.send(&[7; 36]).is_ok());
        }
        f64::from(sent) / begin.elapsed().as_secs_f64()
    });
    let (mut buffer, mut arrived) = ([0; 2000], 0_u32);
    let mut begin = None;
    while to.recv(&mut buffer).is_ok() {
        begin.get_or_insert_with(Instant::now);
        arrived += 1;
    }
    [sender.join().unwrap(), f64::from(arrived) / SPAN.as_secs_f64()]
}

fn print(name: &str, left: &Host, right: &Host) {
    let rates: Vec<f64> = (0..RUNS).map(|_| tcp(left, right) / 1e9).collect();
    let packets: Vec<_> = (0..RUNS).map(|_| datagrams(left, right).map(|rate| rate.round())).collect();
    println!("{name}: TCP {rates:.2?} Gbit/s, packets sent and arrived in a second {packets:?}");
}

/// The settings of a link, and what stands in the tables of both sides.
fn through_the_router(name: &str, keys: &str, link: &str) {
    let (left, right) = (Host::new(), Host::new());
    let side = |name: &str, host: u8, namespace: &str| {
        format!("{name} = {{ tun = \"{name}0\", addresses = [\"10.1.0.{host}/24\"], namespace = \"{namespace}\"{keys} }}\n")
    };
    let text = side("left", 1, &left.namespace) + &side("right", 2, &right.namespace) + link;
    let running = Running::begin_with(&text, Pacing::Sleep, &Wishes::NONE);
    print(name, &left, &right);
    let report = running.end();
    println!("   {} came, release error {:?}, written {:?}", report.packets(), report.release, report.written);
}

/// Two devices and a thread that copies what it reads from one to the other, as it is.
fn through_a_copy(name: &str, offloads: bool) {
    let (left, right) = (Host::new(), Host::new());
    let device = |host: &Host, number: u8| {
        host.does(move || {
            let builder = DeviceBuilder::new().name("copy0").offload(offloads);
            let device = builder.build_sync().unwrap();
            device.set_nonblocking(true).unwrap();
            ip(&format!("address add 10.1.0.{number}/24 dev copy0")).unwrap();
            ip("link set copy0 txqueuelen 2000 up").unwrap();
            device
        })
    };
    let devices = [device(&left, 1), device(&right, 2)];
    let stop = Arc::new(AtomicBool::new(false));
    let stopped = Arc::clone(&stop);
    let copying = thread::spawn(move || {
        drop(prepare_thread(&Wishes::NONE));
        copy(&devices, &stopped);
    });
    print(name, &left, &right);
    stop.store(true, Ordering::Relaxed);
    copying.join().unwrap();
}

fn copy(devices: &[SyncDevice; 2], stop: &AtomicBool) {
    let (clock, mut buffer) = (MonotonicClock::start(), vec![0; (1 << 16) + 64]);
    while !stop.load(Ordering::Relaxed) {
        let mut is_idle = true;
        for (from, to) in [(&devices[0], &devices[1]), (&devices[1], &devices[0])] {
            for _ in 0..64 {
                let Ok(length) = from.recv(&mut buffer) else { break };
                drop(to.send(&buffer[..length]));
                is_idle = false;
            }
        }
        if is_idle {
            let until = clock.now().saturating_add(Duration::from_millis(50));
            clock.block(Some(until), &[devices[0].as_fd(), devices[1].as_fd()]).unwrap();
        }
    }
}

/// Two veth pairs and a bridge of the kernel between them.
fn through_a_bridge(name: &str, segments: &'static str) -> Result<(), String> {
    let (left, right) = (Host::new(), Host::new());
    ip("link add bridge0 type bridge")?;
    ip("link set bridge0 up")?;
    for (number, host) in [(1, &left), (2, &right)] {
        ip(&format!("link add near{number} type veth peer name far0"))?;
        ip(&format!("link set far0 netns {}", host.namespace))?;
        ip(&format!("link set near{number} master bridge0 up"))?;
        host.does(move || {
            ip(&format!("address add 10.1.0.{number}/24 dev far0"))?;
            ip(&format!("link set far0 {segments} up"))
        })?;
    }
    // A port forwards at once, as no spanning tree is asked for; ARP takes a moment.
    print(name, &left, &right);
    ip("link del bridge0")
}

#[test]
#[ignore = "measures: see the head of the file"]
fn throughput_of_the_router() {
    inside_as_root("kernel::throughput::throughput_of_the_router", || {
        for (name, link) in [
            ("pass", "router = { default = \"pass\" }"),
            ("delay of 1 ms", "router = { default = \"x\" }\nlinks = { x = { delay = \"1ms\" } }"),
            ("delay of 24 ms", "router = { default = \"x\" }\nlinks = { x = { delay = \"24ms\" } }"),
        ] {
            through_the_router(name, "", link);
        }
    });
}

#[test]
#[ignore = "measures: see the head of the file"]
fn throughput_beside_the_router() {
    inside_as_root("kernel::throughput::throughput_beside_the_router", || {
        through_a_copy("bare copy, packet by packet", false);
        through_a_copy("bare copy of large segments", true);
        for (name, segments) in [("bridge, packet by packet", "gso_max_segs 1"), ("bridge, large segments", "")] {
            if let Err(why) = through_a_bridge(name, segments) {
                println!("{name}: the system has none: {why}");
            }
        }
    });
}
