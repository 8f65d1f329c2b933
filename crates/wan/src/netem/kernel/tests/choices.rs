//! Decisions packet by packet: duplication, loss, marks, and flipped bits.

use crate::netem::kernel::qdisc::FlippedBit;
use crate::netem::kernel::tests::{Driver, SIZE, at, qdisc, run};
use crate::netem::kernel::{DropReason, Output, Prng, Qdisc, QdiscError, Table};
use crate::netem::{Contradiction, Netem};

/// Collects the outputs of `enqueue` for one packet.
fn told(words: &str, ect: bool) -> (Vec<Output<u64>>, Qdisc<u64>) {
    let mut qdisc = qdisc(words, 1);
    let mut outputs = Vec::new();
    qdisc.enqueue(at(0), SIZE, ect, 7, &mut |output| outputs.push(output));
    (outputs, qdisc)
}

#[test]
fn a_packet_that_is_duplicated_and_lost_passes_once() {
    let (outputs, qdisc) = told("duplicate 100% loss 100%", false);
    assert_eq!(outputs, []);
    assert_eq!(qdisc.len(), 1);
}

#[test]
fn a_copy_is_told_of_first_and_leaves_first() {
    let (outputs, mut qdisc) = told("duplicate 100% delay 1ms", false);
    assert_eq!(outputs, [Output::Duplicated]);
    let left: Vec<_> = core::iter::from_fn(|| qdisc.dequeue(at(1_000_000))).map(|packet| (packet.item, packet.copy)).collect();
    assert_eq!(left, [(7, 1), (7, 0)]);
}

#[test]
fn a_copy_is_not_duplicated_but_may_be_lost() {
    let run = run("duplicate 100% loss 50%", 1, 100_000, 1000);
    // Each packet that is not lost gets a copy, and half of the copies are lost.
    let copies = run.duplicated as f64;
    assert!((copies - 50_000.0).abs() < 5.0 * 158.2, "{copies}: five standard errors of a binomial");
    assert!((run.lost.len() as f64 - copies / 2.0).abs() < 5.0 * 112.0);
    // A packet whose own draw says lost passes in place of its copy, so that every packet passes once at least.
    let originals: Vec<u64> = run.delivered.iter().filter(|(_, packet)| packet.copy == 0).map(|(_, packet)| packet.item).collect();
    assert_eq!(originals, (0..100_000).collect::<Vec<_>>());
}

/// The first draws of the kernel, by hand: duplication, loss, then the copy's loss, the copy's reordering, and the packet's reordering.
#[test]
fn draws_are_made_in_the_order_of_the_kernel() {
    let seed = 1;
    let mut prng = Prng::new(seed);
    let draws: Vec<u32> = (0..5).map(|_| prng.next_u32()).collect();
    // The second draw (0.0044) loses at 1 % and the fourth (0.0022) reorders at 1 %. No other draw is below 1 %.
    let small: Vec<bool> = draws.iter().map(|&draw| f64::from(draw) < 0.01 * 4_294_967_295.0).collect();
    assert_eq!(small, [false, true, false, true, false]);
    let mut driver = Driver::new(qdisc("delay 1ms duplicate 10% loss 1% reorder 1%", seed));
    // The first packet: 0.064 duplicates at 10 % and 0.0044 loses at 1 %, so the packet passes once. The draw for reordering is 0.535, so the packet waits.
    driver.offer(at(0), 0, SIZE, false);
    assert_eq!((driver.run.delivered.len(), driver.run.duplicated, driver.qdisc.len()), (0, 0, 1));
    // The next packet: 0.0022 duplicates at 10 %, and 0.75 does not lose. The copy draws for loss and reordering first, then the packet draws.
    driver.offer(at(1), 1, SIZE, false);
    assert_eq!((driver.run.duplicated, driver.qdisc.len() + driver.run.delivered.len()), (1, 3));
}

#[test]
fn a_packet_that_can_be_marked_is_marked_and_not_lost() {
    let (outputs, mut qdisc) = told("loss 100% ecn", true);
    assert_eq!(outputs, []);
    assert!(qdisc.dequeue(at(0)).unwrap().marked);
    let (outputs, _) = told("loss 100% ecn", false);
    assert_eq!(outputs, [Output::Dropped { item: 7, copy: 0, reason: DropReason::Loss }]);
    let (outputs, _) = told("loss 100%", true);
    assert_eq!(outputs.len(), 1);
}

#[test]
fn a_copy_of_a_marked_packet_is_marked() {
    let (_, mut qdisc) = told("loss 100% ecn duplicate 100%", true);
    assert!((0..2).all(|_| qdisc.dequeue(at(0)).unwrap().marked));
}

#[test]
fn the_copy_is_made_before_the_bit_is_flipped() {
    let run = run("corrupt 50% duplicate 100%", 1, 10_000, 1000);
    let of = |copy: u8| run.delivered.iter().filter(move |(_, packet)| packet.copy == copy).map(|(_, packet)| packet.corrupted.is_some());
    let both = of(0).zip(of(1)).filter(|(original, copy)| *original && *copy).count();
    // Independent events: a quarter of 10⁴, with five standard errors of 43.3.
    assert!((2283..=2717).contains(&both), "{both}");
}

/// χ² of the flipped bit over 8·32 places has 255 degrees of freedom, for which the 0.999 quantile is 330.5.
#[test]
fn the_flipped_bit_is_anywhere() {
    let mut driver = Driver::new(qdisc("corrupt 100%", 5));
    for number in 0..100_000 {
        driver.offer(at(number), number, 32, false);
    }
    let mut counts = [0_u32; 256];
    for (_, packet) in driver.finish().delivered {
        let FlippedBit { byte, bit } = packet.corrupted.unwrap();
        counts[(byte * 8 + u32::from(bit)) as usize] += 1;
    }
    let expected = 100_000.0 / 256.0;
    let chi_squared: f64 = counts.iter().map(|&count| (f64::from(count) - expected).powi(2) / expected).sum();
    assert!(chi_squared < 330.5, "{chi_squared}");
}

#[test]
fn an_empty_packet_has_no_bit_to_flip() {
    let mut qdisc = qdisc("corrupt 100%", 5);
    qdisc.enqueue(at(0), 0, false, 1, &mut |_| {});
    assert_eq!(qdisc.dequeue(at(0)).unwrap().corrupted, None);
}

/// A seed in the words has priority over the argument, which then decides only the values that the kernel does not seed.
#[test]
fn the_seed_of_the_words_decides() {
    let times = |words: &str, seed| run(words, seed, 1000, 1_000_000).delivered;
    let words = "delay 10ms 1ms loss 10% seed 9";
    assert_eq!(times(words, 1), times(words, 2));
    assert_eq!(times("delay 10ms 1ms loss 10%", 9), times(words, 1));
    assert_ne!(times("delay 10ms 1ms loss 10%", 8), times(words, 1));
    assert_ne!(times("corrupt 100% seed 9", 1), times("corrupt 100% seed 9", 2));
}

#[test]
fn a_distribution_that_nobody_has_is_refused_and_one_that_is_given_is_used() {
    let netem = Netem::parse("delay 10ms 1ms distribution mine").unwrap();
    let refused = Qdisc::<u64>::new(&netem, 1, |_| None).unwrap_err();
    assert!(matches!(&refused, QdiscError::UnknownTable { name } if name.as_str() == "mine"));
    let mut qdisc = Qdisc::new(&netem, 1, |_| Table::parse("8192").ok()).unwrap();
    qdisc.enqueue(at(0), SIZE, false, 1, &mut |_| {});
    assert_eq!(qdisc.next_at(), Some(at(11_000_000)));
    let mut contradiction = netem;
    contradiction.ecn = true;
    assert!(matches!(Qdisc::<u64>::new(&contradiction, 1, |_| None), Err(QdiscError::Contradiction(_))));
    let cross = Netem::parse("rate 1mbit cross poisson 8kbit").unwrap();
    assert!(matches!(Qdisc::<u64>::new(&cross, 1, |_| None), Err(QdiscError::Contradiction(Contradiction::CrossInKernel))));
}
