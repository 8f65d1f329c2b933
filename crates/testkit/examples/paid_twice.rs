//! A shop asks a bank for a payment, and asks again when no answer comes within 200 ms. How often is a customer charged twice?
//!
//! The example shows what the test kit is for: the program has the sockets and timers of an ordinary one, the network between its hosts is as bad as the
//! words of `tc-netem` say, and no run waits for anything. A run that fails is found again from its seed, with all that happened in it.
//!
//! ```text
//! cargo run -p cohaptic-testkit --example paid_twice
//! ```
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "an example prints, and its sockets are there")]

use std::cell::Cell;
use std::fmt::{self, Write as _};
use std::rc::Rc;
use std::time::Duration;

use cohaptic_testkit::{Bed, Testbed, time};

/// The program under test. Returns the number of charges for one payment.
async fn payment(bed: Bed) -> u32 {
    let bank = bed.host("bank").bind("0.0.0.0:80").unwrap();
    let charged = Rc::new(Cell::new(0));
    let charges = Rc::clone(&charged);
    bed.host("bank").spawn(async move {
        let mut request = [0; 64];
        while let Ok((_, from)) = bank.recv_from(&mut request).await {
            // The bug: the bank does not look whether it has seen this request before.
            charges.set(charges.get() + 1);
            bank.send_to(b"charged", from).await.unwrap();
        }
    });
    let shop = bed.host("shop").bind("0.0.0.0:0").unwrap();
    loop {
        shop.send_to(b"payment 17 of 10 EUR", "bank:80").await.unwrap();
        if time::timeout(Duration::from_millis(200), shop.recv(&mut [0; 64])).await.is_ok() {
            return charged.get();
        }
    }
}

/// Shop and bank, and between them a line of 20 ms that loses packets.
fn network(loss: &str, seed: u64) -> Testbed {
    Testbed::new(["shop", "bank"]).links(format!("delay 20ms loss {loss}")).seed(seed)
}

const RUNS: u64 = 1000;

/// Returns the seeds with which the customer pays twice or more.
fn charged_twice(loss: &str) -> Vec<u64> {
    (0..RUNS).filter(|seed| network(loss, *seed).run(payment) > 1).collect()
}

/// Returns the text of the README.
fn text() -> Result<String, fmt::Error> {
    let mut text = String::new();
    for loss in ["0%", "1%", "5%", "20%"] {
        writeln!(text, "loss {loss:>3}: {:>3} of {RUNS} customers are charged twice or more", charged_twice(loss).len())?;
    }
    let seed = charged_twice("5%")[0];
    let (charges, record) = network("5%", seed).run_recorded(payment);
    writeln!(text, "\nWith seed {seed} the customer is charged {charges} times over a line that loses 5 %:")?;
    for event in record.trace().events() {
        writeln!(text, "{}", record.trace().words(event))?;
    }
    Ok(text)
}

fn main() -> Result<(), fmt::Error> {
    print!("{}", text()?);
    Ok(())
}

#[test]
fn the_readme_shows_the_text() -> Result<(), fmt::Error> {
    assert!(include_str!("../README.md").contains(&text()?), "{}", text()?);
    Ok(())
}
