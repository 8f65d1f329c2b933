//! An order over bad networks.

use std::cell::Cell;
use std::future::pending;
use std::rc::Rc;
use std::time::Duration;

use cohaptic_testkit::proptest::prelude::*;
use cohaptic_testkit::strategies::{LinkBounds, links_like};
use cohaptic_testkit::{Bed, Testbed, ToLink};
use orders::{kitchen, order};
use redis::Client;
use tokio::net::TcpListener;
use tokio::time::sleep;

fn redis() -> Client {
    Client::open("redis://redis:6379/").unwrap()
}

async fn one_order(bed: Bed) {
    bed.host("redis").spawn(async {
        let listener = TcpListener::bind("0.0.0.0:6379").await.unwrap();
        mini_redis::server::run(listener, pending::<()>()).await.unwrap();
    });
    let cooked = Rc::new(Cell::new(0));
    let count = Rc::clone(&cooked);
    bed.host("kitchen").spawn(async move {
        kitchen(&redis(), |_| count.set(count.get() + 1)).await.unwrap();
    });
    // The kitchen opens before the shop.
    sleep(Duration::from_secs(1)).await;
    bed.host("shop").spawn(async { order(&redis(), "one pizza").await }).await.unwrap().unwrap();
    // Time for what is still under way.
    sleep(Duration::from_secs(60)).await;
    assert_eq!(cooked.get(), 1);
}

/// The link between the shop and Redis is bad. The kitchen is beside Redis.
fn shop_behind(link: impl ToLink + Clone) -> Testbed {
    Testbed::new(["shop", "redis", "kitchen"]).link("shop", "redis", link.clone()).link("redis", "shop", link).on_tokio()
}

#[test]
fn an_order_is_cooked_over_a_lossy_link() {
    for seed in 0..20 {
        shop_behind("delay 30ms loss 3%").seed(seed).run(one_order);
    }
}

proptest! {
    #[test]
    fn an_order_is_cooked_once(link in links_like(LinkBounds::phone().loss(0.0..=20.0)), seed: u64) {
        shop_behind(link).seed(seed).run(one_order);
    }
}
