//! Two programs learn each other's address from a meeting point, and call each other. The table shows behind which NATs both programs hear each other.
//!
//! ```text
//! cargo run -p cohaptic-testkit --example through_a_nat
//! ```
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "an example prints, and its sockets are there")]

use std::fmt::{self, Write as _};
use std::net::SocketAddr;
use std::time::Duration;

use cohaptic_testkit::net::UdpSocket;
use cohaptic_testkit::{Bed, Testbed, time};

/// The meeting point. Tells each of two callers the address from which the other one has asked.
async fn meet() {
    let socket = UdpSocket::bind("0.0.0.0:7").await.unwrap();
    let one = socket.recv_from(&mut [0; 8]).await.unwrap().1;
    let other = socket.recv_from(&mut [0; 8]).await.unwrap().1;
    socket.send_to(other.to_string().as_bytes(), one).await.unwrap();
    socket.send_to(one.to_string().as_bytes(), other).await.unwrap();
}

/// The program under test. Calls the other one five times a second for two seconds, and returns whether the other one was heard.
async fn call() -> bool {
    let socket = UdpSocket::bind("0.0.0.0:5000").await.unwrap();
    socket.send_to(b"hello", "meet:7").await.unwrap();
    let mut buffer = [0; 64];
    let (len, _) = socket.recv_from(&mut buffer).await.unwrap();
    let mut to: SocketAddr = std::str::from_utf8(&buffer[..len]).unwrap().parse().unwrap();
    let mut is_heard = false;
    for _ in 0..10 {
        socket.send_to(b"hello", to).await.unwrap();
        if let Ok(heard) = time::timeout(Duration::from_millis(200), socket.recv_from(&mut buffer)).await {
            // A strict NAT gives the other side a port that the meeting point has not seen.
            to = heard.unwrap().1;
            is_heard = true;
        }
    }
    is_heard
}

async fn both_call(bed: Bed) -> bool {
    bed.host("meet").spawn(meet());
    let alice = bed.host("alice").spawn(call());
    let bob = bed.host("bob").spawn(call());
    alice.await.unwrap() && bob.await.unwrap()
}

/// Alice and bob, each behind a NAT of its own.
fn network(alice: &str, bob: &str) -> Testbed {
    Testbed::new(["alice", "bob", "meet"]).nat("home-a", alice, ["alice"]).nat("home-b", bob, ["bob"]).links("delay 10ms 2ms")
}

/// Returns the table of the page.
fn text() -> Result<String, fmt::Error> {
    let kinds = ["open", "address", "home", "strict", "cgnat"];
    let mut text = format!("{:8}{}\n", "", kinds.map(|kind| format!("{kind:>9}")).concat());
    for alice in kinds {
        write!(text, "{alice:8}")?;
        for bob in kinds {
            let calls = (0..100).filter(|seed| network(alice, bob).seed(*seed).run(both_call)).count();
            write!(text, "{:>9}", format!("{calls} %"))?;
        }
        text.push('\n');
    }
    Ok(text)
}

fn main() -> Result<(), fmt::Error> {
    print!("{}", text()?);
    Ok(())
}

#[test]
fn homes_hear_each_other() {
    assert!(network("home", "home").run(both_call));
    assert!(!network("home", "strict").run(both_call));
}

#[test]
fn two_homes_of_one_carrier_need_a_hairpin() {
    let carrier = |words| network("home", "home").nat("carrier", words, ["home-a", "home-b"]);
    assert!(carrier("cgnat").run(both_call));
    assert!(!carrier("cgnat hairpin no").run(both_call));
}

#[test]
fn the_page_shows_the_table() -> Result<(), fmt::Error> {
    assert!(include_str!("../../../docs/how-to-nat.md").contains(&text()?), "{}", text()?);
    Ok(())
}
