//! Programs that nobody here wrote, over a bad link, unmodified but for where sockets come from: every octet is right, and two runs are the same.

mod axum;
mod hyper;
mod phone;
mod quic;
mod redis;
mod rustls;
mod tonic;
mod websocket;

use cohaptic_testkit::{Bed, Testbed};

/// Runs a program over the link with 20 seeds, each twice.
fn over_a_bad_link<F: Future<Output = ()> + 'static>(prepare: impl Fn(Testbed) -> Testbed, program: impl Fn(Bed) -> F) {
    for seed in 0..20 {
        let bed = Testbed::new(["client", "server"]).links("delay 100ms loss 5% rate 1mbit").seed(seed);
        prepare(bed).run_twice(&program);
    }
}

/// Octets that show what was lost, doubled or invented.
fn octets(count: usize) -> Vec<u8> {
    (0..count).map(|at| ((at * 31 + at / 251) % 251) as u8).collect()
}
