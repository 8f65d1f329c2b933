//! The token bucket beside the kernel's: UDP through `tc tbf` in a network namespace of its own. Asked for with `COHAPTIC_KERNEL_TESTS=1`, since it takes
//! seconds of real time and a kernel with `sch_tbf`; where that is not to be had, it says why and passes.

use std::net::UdpSocket;
use std::process::Command;
use std::time::Duration;

use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{Framing, Link, LinkConfig, LinkName, TokenBucket};

use crate::random_links::rate;

const ASKED: &str = "COHAPTIC_KERNEL_TESTS";
const INSIDE: &str = "COHAPTIC_INSIDE_A_NAMESPACE";
/// Bit/s, bytes and packets: 3.2 Mbit at 2 Mbit/s with a burst of 20 kB.
const RATE: u64 = 2_000_000;
const BURST: u64 = 20_000;
const PACKETS: u64 = 400;
const PAYLOAD: usize = 1_000;
/// Ethernet, IPv4 and UDP: what `tbf` counts besides the payload.
const HEADERS: i32 = 14 + 20 + 8;

/// Runs this test again in a network namespace whose loopback interface has a token bucket. Returns the output of that run, or the reason why it failed.
fn enter_namespace() -> Result<String, String> {
    let program = std::env::current_exe().map_err(|error| error.to_string())?;
    let script = format!(
        "ip link set lo up && tc qdisc add dev lo root tbf rate {RATE}bit burst {BURST} limit 10000000 && exec \"$0\" --exact {} --nocapture",
        "kernel_tbf::the_token_bucket_lets_through_what_the_kernels_does"
    );
    let output = Command::new("unshare").args(["-rn", "sh", "-c", &script]).arg(program).env(INSIDE, "1").output();
    let output = output.map_err(|error| format!("unshare: {error}"))?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    if text(&output.stdout).contains("compared") {
        assert!(output.status.success(), "{}{}", text(&output.stdout), text(&output.stderr));
        return Ok(text(&output.stdout).lines().filter(|line| line.starts_with("compared")).collect());
    }
    assert!(!text(&output.stdout).contains("panicked") && !text(&output.stderr).contains("panicked"), "{}", text(&output.stderr));
    Err(text(&output.stderr))
}

/// Sends all packets at once through the token bucket of the kernel. Returns the time from the first reception to the reception of each packet \[s\].
#[expect(clippy::disallowed_methods, reason = "the kernel has no other clock than the wall's")]
fn through_the_kernel() -> Vec<f64> {
    let receiver = UdpSocket::bind("127.0.0.1:0").unwrap();
    receiver.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
    let to = receiver.local_addr().unwrap();
    let sender = std::thread::spawn(move || {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        for _ in 0..PACKETS {
            // A full buffer waits until the bucket has let something go.
            socket.send_to(&[0; PAYLOAD], to).unwrap();
        }
    });
    let mut buffer = [0; 2 * PAYLOAD];
    let mut first = None;
    let mut received = Vec::new();
    for _ in 0..PACKETS {
        assert_eq!(receiver.recv(&mut buffer).unwrap(), PAYLOAD);
        let now = std::time::Instant::now();
        received.push(now.duration_since(*first.get_or_insert(now)).as_secs_f64());
    }
    sender.join().unwrap();
    received
}

/// Returns the departures \[s\] of the same packets from the emulated token bucket.
fn through_the_link() -> Vec<f64> {
    let framing = Framing { overhead: HEADERS, cells: None };
    let bucket = TokenBucket { rate: rate(RATE), burst: Bytes::new(BURST), peak: None, framing, limit: None };
    let mut link = Link::new(1, &LinkName::between("a", "b"), LinkConfig { token_bucket: Some(bucket), ..LinkConfig::default() });
    (0..PACKETS).for_each(|_| link.handle_packet(Instant::ZERO, Bytes::new(PAYLOAD as u64), 0_u64).unwrap());
    link.handle_timeout(Instant::MAX).unwrap();
    std::iter::from_fn(|| link.poll_event()).map(|event| event.at.as_secs_f64()).collect()
}

#[test]
#[expect(clippy::print_stdout, clippy::print_stderr, reason = "who asks for it wants to know why it was skipped, and what was seen")]
fn the_token_bucket_lets_through_what_the_kernels_does() {
    if std::env::var_os(ASKED).is_none() {
        println!("skipped: {ASKED} is not set");
        return;
    }
    if std::env::var_os(INSIDE).is_none() {
        match enter_namespace() {
            Ok(seen) => println!("{seen}"),
            Err(reason) => eprintln!("skipped: {}", reason.trim()),
        }
        return;
    }
    let (kernel, link) = (through_the_kernel(), through_the_link());
    // The kernel may be late, by its timers and by who else runs; it is never early but for the rounding of its tokens, a microsecond a packet, and for the
    // lateness of the very first packet, from which the others are counted.
    let lateness: Vec<f64> = kernel.iter().zip(&link).map(|(kernel, link)| kernel - link).collect();
    let earliest = lateness.iter().copied().fold(f64::INFINITY, f64::min);
    let mut sorted = lateness;
    sorted.sort_by(f64::total_cmp);
    let median = sorted[sorted.len() / 2];
    println!(
        "compared {PACKETS} packets: kernel {:.6} s, link {:.6} s, lateness least {earliest:.6} s, median {median:.6} s",
        kernel[399], link[399]
    );
    assert!(earliest > -0.005, "a packet left the kernel {earliest} s before the emulated bucket let it go");
    assert!(median < 0.02, "packets leave the kernel {median} s late");
}
