//! Programs with the fault that they rely on the network.

use std::time::Duration;

use cohaptic_testkit::{Bed, time};

/// Returns the number of letters that arrive. Five letters are sent, each once, 10 ms apart.
pub(super) async fn count_letters(bed: Bed) -> u8 {
    arrived(&bed).await.len().try_into().unwrap()
}

async fn arrived(bed: &Bed) -> Vec<u8> {
    let (client, server) = (bed.host("client").bind("0.0.0.0:0").unwrap(), bed.host("server").bind("0.0.0.0:7").unwrap());
    for letter in 0..5 {
        client.send_to(&[letter], "server:7").await.unwrap();
        time::sleep(Duration::from_millis(10)).await;
    }
    let (mut arrived, mut letter) = (Vec::new(), [0]);
    while time::timeout(Duration::from_secs(1), server.recv(&mut letter)).await.is_ok() {
        arrived.push(letter[0]);
    }
    arrived
}

/// Expects that every letter arrives.
pub(super) async fn five_letters(bed: Bed) {
    let arrived = arrived(&bed).await;
    assert_eq!(arrived.len(), 5, "letters are missing");
}

/// Expects that letters arrive in the order of sending.
pub(super) async fn letters_in_order(bed: Bed) {
    let arrived = arrived(&bed).await;
    assert!(arrived.is_sorted(), "letters are out of order");
}
