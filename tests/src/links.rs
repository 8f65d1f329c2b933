//! Links at random, of every kind that treats packets on their way: what the claims about links hold for.

use proptest::option::weighted;
use proptest::prelude::*;

use crate::{Draft, DraftLink};

/// Keys of one link, each by itself there or not: delay with jitter, with and without reordering; loss of four models; copies, damage that a checksum finds,
/// reordering on purpose; a rate with a queue; slots; an outage. It shrinks to fewer keys and smaller numbers.
pub fn any_link() -> BoxedStrategy<String> {
    let law = prop_oneof![Just("uniform"), Just("normal"), Just("gamma"), Just("laplace")];
    // In parts per thousand of the delay: a uniform law reaches √3 of it.
    let delay = weighted(0.7, (0..40_000_u32, weighted(0.5, (1..550_u32, law, any::<bool>()))));
    let loss = weighted(
        0.4,
        prop_oneof![
            (1..90_u32).prop_map(|percent| format!("loss = \"{percent}%\"")),
            (1..30_u32, 5..100_u32, 0..30_u32)
                .prop_map(|(p, r, h)| format!("loss = {{ gilbert-elliott = {{ p = \"{p}%\", r = \"{r}%\", h = \"{h}%\" }} }}")),
            (1..60_u32, 11..40_u32).prop_map(|(p, c)| format!("loss = {{ correlated = {{ probability = \"{p}%\", correlation = 0.{c} }} }}")),
            (0..5_u32, 1..8_u32).prop_map(|(first, more)| format!(
                "loss = {{ packets = [\"{first}-{}\"], every = {} }}",
                first + more,
                first + 2 * more + 1
            )),
        ],
    );
    let copies = weighted(0.2, (1..50_u32).prop_map(|percent| format!("duplicate = \"{percent}%\"")));
    let damage = weighted(0.2, (1..50_u32).prop_map(|percent| format!("corrupt = \"{percent}%\"")));
    let disorder = weighted(
        0.2,
        prop_oneof![
            (1..50_u32, 1..40_u32).prop_map(|(percent, later)| format!("reorder = {{ probability = \"{percent}%\", later = \"{later}ms\" }}")),
            (1..50_u32, 1..4_u32, 5..60_u32).prop_map(|(percent, behind, most)| format!(
                "reorder = {{ probability = \"{percent}%\", behind = {behind}, at-most = \"{most}ms\" }}"
            )),
        ],
    );
    let line = weighted(0.3, (30..1000_u32, weighted(0.6, 1..6_u32))).prop_map(|line| {
        line.map(|(kbit, queue)| {
            let queue = queue.map_or_else(String::new, |packets| format!(", queue = {{ limit = \"{packets} packets\" }}"));
            format!("rate = \"{kbit}kbit\"{queue}")
        })
    });
    let slots = weighted(0.1, (1..10_u32, 0..20_u32).prop_map(|(min, more)| format!("slots = {{ min = \"{min}ms\", max = \"{}ms\" }}", min + more)));
    let outage = weighted(0.3, (0..200_u32, 1..200_u32))
        .prop_map(|outage| outage.map(|(from, length)| format!("outage = [{{ from = \"{from}ms\", to = \"{}ms\" }}]", from + length)));
    let delay = delay.prop_map(|delay| {
        delay.map(|(us, jitter)| {
            let jitter = jitter.map_or_else(String::new, |(part, law, in_order)| {
                let order = if in_order { "in-order" } else { "allow-reordering" };
                format!(", jitter = {{ sd = \"{}ns\", distribution = \"{law}\" }}, order = \"{order}\"", us * part)
            });
            format!("delay = \"{us}us\"{jitter}")
        })
    });
    (delay, loss, copies, damage, disorder, line, slots, outage)
        .prop_map(|(delay, loss, copies, damage, disorder, line, slots, outage)| {
            [delay, loss, copies, damage, disorder, line, slots, outage].into_iter().flatten().collect::<Vec<_>>().join(", ")
        })
        .boxed()
}

/// A link of its own for each direction of each pair of the peers of [`Draft::calm`].
pub fn any_network(peers: usize) -> BoxedStrategy<Vec<DraftLink>> {
    let names: Vec<String> = Draft::calm(peers).peers.into_iter().map(|peer| peer.name).collect();
    let pairs: Vec<(String, String)> =
        names.iter().flat_map(|from| names.iter().filter(move |to| *to != from).map(|to| (from.clone(), to.clone()))).collect();
    proptest::collection::vec(any_link(), pairs.len())
        .prop_map(move |links| {
            let both = pairs.iter().zip(links);
            both.map(|((from, to), keys)| DraftLink { from: from.clone(), to: to.clone(), keys }).collect()
        })
        .boxed()
}
