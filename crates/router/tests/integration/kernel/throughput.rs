//! Throughput of the router, compared with a copy between the same two devices and with a bridge of the kernel: `cargo test --release -p cohaptic-router --
//! --ignored --nocapture --test-threads=1 throughput`. The figures depend on the machine, so nothing is asserted about them.

use std::fs;
use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::fd::AsFd as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
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

/// Returns the processor time of this process, including the time in the system \[s\]. Sender, router and receiver are threads of this process.
fn spent() -> f64 {
    let line = fs::read_to_string("/proc/self/stat").unwrap();
    // The fields after the name of the process, in hundredths of a second (proc(5)).
    let fields: Vec<&str> = line.rsplit(')').next().unwrap().split_whitespace().collect();
    fields[11..13].iter().map(|ticks| ticks.parse::<f64>().unwrap() / 100.0).sum()
}

/// Rate per second, and rate per second of processor time. The first depends on the other work of the machine.
type Rates = [f64; 2];

/// Returns the bits carried by one connection.
fn tcp(left: &Host, right: &Host) -> Rates {
    // Four gigabits per second for 50 ms are 25 MB.
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
        let (mut bytes, from, cost) = (0, begin.elapsed(), spent());
        while begin.elapsed() < until {
            bytes += to.read(&mut block).unwrap_or(0);
        }
        let bits = bytes as f64 * 8.0;
        [bits / (begin.elapsed() - from).as_secs_f64(), bits / (spent() - cost)]
    };
    count(WARM_UP);
    let rates = count(WARM_UP + SPAN);
    drop(to);
    writer.join().unwrap();
    rates
}

/// Returns the number of arriving packets of 64 bytes. At most `on_the_way` packets are under way: further packets would be lost, and the time for sending them
/// wasted.
fn datagrams(left: &Host, right: &Host, on_the_way: u32) -> Rates {
    const PATIENCE: Duration = Duration::from_millis(100);
    let (from, to) = (left.udp([10, 1, 0, 1].into(), 0), right.udp(THERE.into(), 7));
    from.connect(SocketAddr::from((THERE, 7))).unwrap();
    to.set_read_timeout(Some(Duration::from_millis(300))).unwrap();
    socket2::SockRef::from(&to).set_recv_buffer_size(4 << 20).unwrap();
    let arrived = Arc::new(AtomicU32::new(0));
    let seen = Arc::clone(&arrived);
    let sender = thread::spawn(move || {
        let (begin, mut sent, mut lost) = (Instant::now(), 0_u32, 0);
        while begin.elapsed() < SPAN {
            let waiting = Instant::now();
            while sent - lost - seen.load(Ordering::Relaxed) >= on_the_way {
                thread::yield_now();
                if waiting.elapsed() > PATIENCE {
                    lost = sent - seen.load(Ordering::Relaxed);
                }
            }
            for _ in 0..32 {
                sent += u32::from(from.send(&[7; 36]).is_ok());
            }
        }
    });
    let mut buffer = [0; 2000];
    let (mut begin, cost) = (Instant::now(), spent());
    while to.recv(&mut buffer).is_ok() {
        if arrived.fetch_add(1, Ordering::Relaxed) == 0 {
            begin = Instant::now();
        }
    }
    // The last wait found no packet, so its time is subtracted.
    let took = begin.elapsed().saturating_sub(Duration::from_millis(300));
    sender.join().unwrap();
    [took.as_secs_f64(), spent() - cost].map(|seconds| f64::from(arrived.load(Ordering::Relaxed)) / seconds)
}

fn print(name: &str, left: &Host, right: &Host, delay: u32) {
    // The room of a device, and 400,000 packets per second for the delay.
    let on_the_way = 1_500 + 400 * delay;
    let tcp: Vec<Rates> = (0..RUNS).map(|_| tcp(left, right).map(|rate| (rate / 1e7).round() / 100.0)).collect();
    let packets: Vec<Rates> = (0..RUNS).map(|_| datagrams(left, right, on_the_way).map(|rate| (rate / 1e3).round())).collect();
    println!("{name}, per second and per second of processor time: TCP {tcp:?} Gbit, packets of 64 bytes {packets:?} thousand");
}

/// Measures the router with one link of `delay` \[ms\].
fn through_the_router(name: &str, delay: u32) {
    let (left, right) = (Host::new(), Host::new());
    let side = |name: &str, host: u8, namespace: &str| {
        format!("{name} = {{ tun = \"{name}0\", addresses = [\"10.1.0.{host}/24\"], namespace = \"{namespace}\" }}\n")
    };
    let link = format!("router = {{ default = \"x\" }}\nlinks = {{ x = {{ delay = \"{delay}ms\" }} }}");
    let text = side("left", 1, &left.namespace) + &side("right", 2, &right.namespace) + &link;
    let running = Running::begin_with(&text, Pacing::Sleep, &Wishes::NONE);
    print(name, &left, &right, delay);
    let report = running.end();
    println!("   release error {:?}, lost at the devices {:?}", report.release, report.written.map(|written| written.lost()));
}

/// Measures two devices with a thread that copies every packet or segment from one device to the other.
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
    print(name, &left, &right, 0);
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

/// Measures two veth pairs with a bridge of the kernel between them.
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
    print(name, &left, &right, 0);
    ip("link del near1")?;
    ip("link del near2")?;
    ip("link del bridge0")
}

#[test]
#[ignore = "measures: see the head of the file"]
fn throughput_of_the_router() {
    inside_as_root("kernel::throughput::throughput_of_the_router", || {
        for (name, delay) in [("no delay", 0), ("1 ms each way", 1), ("24 ms each way", 24)] {
            through_the_router(name, delay);
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
