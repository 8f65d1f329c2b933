//! Random hits on packets.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::sync::Arc;

use proptest::strategy::{NewTree, Strategy, ValueTree};
use proptest::test_runner::TestRunner;

use super::grid::Dice;
use super::shrink::{Number, Search, Space};
use crate::hit::{Action, Hit, Hits, PathHit, Which, push_number};
use crate::words::hits_on;

/// Draws sets of hits on packets, among the first `packets` packets of every path between these hosts. Each hit applies an action, given by the words before
/// the packets: `drop`, `delay 200ms`, `behind 2`. About a sixteenth of the packets is hit in a third of all sets, a quarter in another third, and half in the
/// last third.
///
/// A set shrinks until no packet can be left out. An action becomes the first action wherever the test then fails as well. Shrinking tries all packets at once,
/// then halves, and so on down to single packets. Leaving a hit out [changes nothing else](crate::hit) on the links.
///
/// ```
/// use cohaptic_testkit::proptest::test_runner::{TestCaseError, TestError, TestRunner};
/// use cohaptic_testkit::strategies::any_hits;
/// use cohaptic_testkit::{Bed, Testbed, time};
///
/// // Sends a question twice, and never again.
/// async fn asks_twice(bed: Bed) -> bool {
///     let (client, server) = (bed.host("client").bind("0.0.0.0:0").unwrap(), bed.host("server").bind("0.0.0.0:7").unwrap());
///     client.send_to(b"one", "server:7").await.unwrap();
///     client.send_to(b"one", "server:7").await.unwrap();
///     time::timeout(std::time::Duration::from_secs(1), server.recv(&mut [0; 3])).await.is_ok()
/// }
///
/// let failure = TestRunner::deterministic().run(&any_hits(["client", "server"], 10, ["drop", "delay 2s"]), |hits| {
///     let is_heard = Testbed::new(["client", "server"]).links("delay 24ms").hits(&hits).run(asks_twice);
///     if is_heard { Ok(()) } else { Err(TestCaseError::fail("not heard")) }
/// });
/// let Err(TestError::Fail(_, hits)) = failure else { panic!("it is always heard") };
/// assert_eq!(hits.to_string(), "client -> server: drop packets 0-1");
/// ```
///
/// # Panics
///
/// If there are no actions, an action makes no sense, or two hosts have the same name.
#[track_caller]
pub fn any_hits<N: Into<String>, A: AsRef<str>>(
    hosts: impl IntoIterator<Item = N>,
    packets: u64,
    actions: impl IntoIterator<Item = A>,
) -> PacketSets {
    let hosts: crate::names::Names = hosts.into_iter().collect();
    let actions: Vec<Action> = actions.into_iter().map(|words| action(words.as_ref())).collect();
    assert!(!actions.is_empty(), "`any_hits` has no actions: give at least one action, such as `drop`");
    let space = SetSpace { hosts: hosts.to_vec().into(), actions: actions.into() };
    PacketSets(Sets { space, packets })
}

/// Strategy of sets of packets that are hit: see [`any_hits`].
#[derive(Clone, Debug)]
#[must_use = "strategies do nothing unless used"]
pub struct PacketSets(Sets);

impl Strategy for PacketSets {
    type Tree = Box<dyn ValueTree<Value = Hits>>;
    type Value = Hits;

    fn new_tree(&self, runner: &mut TestRunner) -> NewTree<Self> {
        let space = self.0.space.clone();
        let tree = self.0.clone().prop_map(move |set| space.hits(&set)).new_tree(runner)?;
        Ok(Box::new(tree))
    }
}

/// Parses an action: the words before the packets of a hit.
#[track_caller]
#[expect(clippy::panic, reason = "documented: actions stand in a test")]
fn action(words: &str) -> Action {
    // The parser knows whole hits only, so a packet is added to the words of the action.
    match hits_on(&format!("{words} packet 0")).as_deref() {
        Ok([Hit { action, .. }]) => *action,
        Ok(_) => panic!("`{words}` is more than one action: expected a single one, such as `drop`"),
        Err(error) => panic!("`{words}` is not an action: {}", error.message()),
    }
}

/// Packets that are hit, by sender, receiver and number, with the index of the action.
type Set = BTreeMap<(usize, usize, u64), usize>;

#[derive(Clone, Debug)]
struct Sets {
    space: SetSpace,
    packets: u64,
}

impl Strategy for Sets {
    type Tree = Box<dyn ValueTree<Value = Set>>;
    type Value = Set;

    fn new_tree(&self, runner: &mut TestRunner) -> NewTree<Self> {
        let mut dice = Dice(runner.rng());
        // The share is drawn once for the set, so that sparse sets and dense sets both occur.
        let one_in = dice.pick(2, &[4, 16]);
        let mut set = Set::new();
        let hosts = self.space.hosts.len();
        for (from, to) in (0..hosts).flat_map(|from| (0..hosts).map(move |to| (from, to))).filter(|(from, to)| from != to) {
            for number in 0..self.packets {
                if dice.one_in(one_in) {
                    let action = usize::try_from(dice.below(self.space.actions.len() as u64)).unwrap_or(0);
                    set.insert((from, to, number), action);
                }
            }
        }
        Ok(Box::new(Search::new(self.space.clone(), set)))
    }
}

/// Space of sets, in which shrinking searches.
#[derive(Clone, Debug)]
struct SetSpace {
    hosts: Arc<[String]>,
    actions: Arc<[Action]>,
}

impl SetSpace {
    /// Converts a set to hits, sorted by path, then action.
    fn hits(&self, set: &Set) -> Hits {
        let mut numbers: BTreeMap<(usize, usize, usize), Vec<RangeInclusive<u64>>> = BTreeMap::new();
        for (&(from, to, number), &action) in set {
            let ranges = numbers.entry((from, to, action)).or_default();
            push_number(ranges, number);
        }
        let hit = |((from, to, action), numbers): ((usize, usize, usize), Vec<_>)| PathHit {
            from: self.hosts[from].clone(),
            to: self.hosts[to].clone(),
            hit: Hit { action: self.actions[action], which: Which::Numbers(numbers) },
        };
        Hits { all: numbers.into_iter().map(hit).collect() }
    }
}

impl Space for SetSpace {
    type Value = Set;
    type Part = (usize, usize, u64);
    type Form = (usize, usize, u64);
    type Place = ();

    const LEVELS: usize = 1;

    fn parts(&self, set: &Set, _level: usize) -> Vec<Self::Part> {
        set.keys().copied().collect()
    }

    fn without(&self, set: &Set, parts: &[Self::Part]) -> Option<Set> {
        let mut less = set.clone();
        less.retain(|packet, _| !parts.contains(packet));
        Some(less)
    }

    fn forms(&self, set: &Set) -> Vec<Self::Form> {
        // Action 0 is the plainest action: the first of the test, into which shrinking turns all others.
        set.iter().filter(|(_, action)| **action > 0).map(|(packet, _)| *packet).collect()
    }

    fn plainer(&self, set: &Set, packet: &Self::Form) -> Option<Set> {
        let mut plainer = set.clone();
        *plainer.get_mut(packet)? = 0;
        Some(plainer)
    }

    fn places(&self, _set: &Set) -> Vec<()> {
        Vec::new()
    }

    fn number(&self, _set: &Set, _place: &()) -> Option<Number> {
        None
    }

    fn with_number(&self, _set: &Set, _place: &(), _number: u64) -> Option<Set> {
        None
    }
}
