//! Programs of others whose sockets are tokio's, unchanged on the test kit. The package `tokio` of this workspace is the one that `cohaptic tokio` generates.

use cohaptic_testkit::{Bed, Testbed};

mod aws;
mod axum;
mod beds;
mod descriptors;
mod foreign;
mod h2;
mod hickory;
mod http_client;
mod linux;
mod loopback;
mod mini_redis;
mod mongodb;
mod nats;
mod ping_pong;
mod postgres;
mod quinn;
mod redis;
mod refused;
mod signals;
mod sockets;
mod standard;
mod tasks;
mod tokio_rustls;
mod tonic;
mod unix;
mod websocket;

/// Seeds with which each program runs.
const SEEDS: u64 = 20;

/// Runs a program of a client and a server with several seeds over a lossy link, each twice, and checks that both runs are the same. `prepare` changes the test bed.
fn over_lossy_links<F: Future<Output = ()> + 'static>(prepare: impl Fn(Testbed) -> Testbed, program: impl Fn(Bed) -> F) {
    let mut lost = 0;
    for seed in 0..SEEDS {
        let bed = prepare(Testbed::new(["client", "server"]).links("delay 30ms loss 3%").seed(seed).on_tokio());
        let ((), record) = bed.clone().run_recorded(&program);
        lost += record.trace().events().iter().filter(|event| record.trace().words(event).to_string().contains(" lost")).count();
        bed.run_twice(&program);
    }
    // Otherwise the links would have tested nothing.
    assert!(lost > 0);
}
