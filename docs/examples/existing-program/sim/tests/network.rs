//! An order over bad networks.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use cohaptic_testkit::proptest::prelude::*;
use cohaptic_testkit::strategies::{LinkBounds, links_like};
use cohaptic_testkit::{Bed, Testbed};
use orders::{order, serve};
use tokio::net::TcpListener;

async fn one_order(bed: Bed) {
    let taken = Arc::new(AtomicU32::new(0));
    let count = Arc::clone(&taken);
    bed.host("shop").spawn(async move {
        let listener = TcpListener::bind("0.0.0.0:80").await.unwrap();
        let take = move |_: &str| {
            count.fetch_add(1, Ordering::Relaxed);
        };
        serve(listener, take).await;
    });
    bed.host("phone").spawn(order("ws://shop:80/", "one pizza")).await.unwrap().unwrap();
    assert_eq!(taken.load(Ordering::Relaxed), 1);
}

#[test]
fn an_order_is_taken_over_a_lossy_link() {
    for seed in 0..20 {
        Testbed::new(["phone", "shop"]).links("delay 30ms loss 3%").seed(seed).on_tokio().run(one_order);
    }
}

proptest! {
    #[test]
    fn an_order_is_taken_once(link in links_like(LinkBounds::phone().loss(0.0..=20.0))) {
        Testbed::new(["phone", "shop"]).links(link).on_tokio().run(one_order);
    }
}
