//! The words of `tc netem`: what is read is printed and read back as the same, every refusal points at a word, and the links that the words mean can be used.

use std::time::Duration;

use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::netem::Netem;
use cohaptic_wan::{KernelNetem, Link, LinkModel, LinkName};

/// The events of a link that are waited for: slots may be a nanosecond apart, and a delay may be years.
const MOST_STEPS: usize = 100;
const PACKETS: u64 = 6;

/// The bytes are words.
pub fn run(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let netem = match Netem::parse(text) {
        Ok(netem) => netem,
        Err(error) => {
            assert!(text.get(error.span.clone()).is_some_and(|word| !word.is_empty()), "{:?}", error.span);
            assert!(error.excerpt(text).contains('^'));
            return;
        }
    };
    assert_eq!(netem.check(), Ok(()));
    let printed = netem.to_string();
    let again = Netem::parse(&printed).unwrap_or_else(|error| panic!("{}", error.excerpt(&printed)));
    assert_eq!(again, netem);
    assert_eq!(again.to_string(), printed);
    match netem.to_link_config(&mut |_| None) {
        Ok(config) => use_link(config.into()),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
    match KernelNetem::new(netem, Vec::new()) {
        Ok(kernel) => use_link(LinkModel::Kernel(kernel)),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

/// Offers packets, and counts what comes out.
fn use_link(model: LinkModel) {
    let mut link = Link::new(1, &LinkName::between("a", "b"), model);
    let mut now = Instant::ZERO;
    let (mut ended, mut copies) = (0, 0);
    for step in 0..MOST_STEPS {
        if (step as u64) < PACKETS {
            now = now.saturating_add(Duration::from_micros(100));
            link.handle_packet(now, Bytes::new(100), ()).unwrap();
        } else {
            let Some(due) = link.poll_timeout() else { break };
            // Beyond that a kernel's clock has no time, and slots take for ever to get there.
            if due > now.saturating_add(Duration::from_secs(1)) {
                break;
            }
            now = now.max(due);
            link.handle_timeout(now).unwrap();
        }
        while let Some(event) = link.poll_event() {
            if event.fate.is_end() {
                ended += 1;
            } else {
                copies += 1;
            }
        }
    }
    let stats = link.stats();
    assert_eq!((stats.offered(), stats.duplicated()), (PACKETS, copies));
    assert_eq!(stats.offered() + copies - ended, stats.in_flight());
}
