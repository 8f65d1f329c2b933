//! Tests as failures have printed them, letter by letter.

use cohaptic_testkit::Testbed;

use super::programs::{five_letters, letters_in_order};

#[should_panic(expected = "letters are missing")]
#[test]
fn every_letter_arrives_again() {
    Testbed::new(["client", "server"])
        .hit("client", "server", "drop packet 1")
        .run(five_letters);
}

#[should_panic(expected = "letters are out of order")]
#[test]
fn letters_keep_their_order_again() {
    Testbed::new(["client", "server"])
        .link("client", "server", "delay 5700us 5700us")
        .seed(16721237442888058395)
        .run(letters_in_order);
}

#[should_panic(expected = "letters are missing")]
#[test]
fn letters_of_a_closure_arrive_again() {
    Testbed::new(["client", "server"])
        .hit("client", "server", "drop packet 2")
        .on_tokio()
        .run(|bed| async move {
            let (begin, end) = (b"(", ")");
            five_letters(bed).await;
            assert_ne!(begin, end.as_bytes());
        });
}
