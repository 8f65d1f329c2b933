//! One run on several threads, or with groups of peers on one thread. Results equal the results of all peers together, to the bit.
//!
//! Each thread moves some of the peers, and has the links to its peers with the samples in flight. Peers act on each other by their samples alone, so threads
//! need to meet only at ticks of sending, to exchange the samples. The fate of a packet is drawn at a separate address, so any thread can draw the fate.
//!
//! For the same reason a thread need not move all its peers tick by tick. A thread computes one group of peers from one meeting to the next, then the next
//! group, so the held samples of a group stay in the cache.

mod barrier;
mod exchange;

use std::ops::{ControlFlow, Range};

use cohaptic_peer::coordination::BuiltIn;
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use self::exchange::{Exchange, Thread};
use super::bodies::Bodies;
use super::lanes::WIDTH;
use super::run_watch::Unwatched;
use super::samples::Sample;
use super::shape::Shape;
use super::{Arrays, Samples, bodies_of, summary};
use crate::summary::{Ending, Summary};

/// Least number of peers for each thread. With fewer peers, threads wait longer than they work.
const PEERS_A_THREAD: usize = 8;

/// Memory of the held samples of a group \[bytes\]: half of a typical second-level cache. Links and packets share the cache.
const HELD_BY_A_GROUP: usize = 1 << 20;

impl Shape {
    /// Returns the largest useful number of threads of a run, and the reason against more threads.
    pub(crate) fn threads(&self) -> (usize, &'static str) {
        match why_together(self) {
            Some(why) => (1, why),
            None => (
                (self.peers / PEERS_A_THREAD).max(1),
                "eight peers a thread; threads meet where samples are sent, and the number of threads changes no bit",
            ),
        }
    }

    /// Returns whether a run on one thread is faster with its peers in groups.
    pub(crate) fn pays_in_groups(&self) -> bool {
        why_together(self).is_none() && groups(self, &(0..self.peers), HELD_BY_A_GROUP).len() > 1
    }
}

/// Returns the reason for moving all peers together; `None` without such a reason.
fn why_together(shape: &Shape) -> Option<&'static str> {
    let whys = [(shape.delay.is_some(), "all samples travel together: a tick takes less time than threads take to meet")];
    whys.into_iter().find_map(|(is_so, why)| is_so.then_some(why))
}

/// Divides the peers of a thread into groups of whole registers. The held samples of a group take at most `held_by_a_group` bytes, unless one register of peers
/// takes more.
fn groups(shape: &Shape, members: &Range<usize>, held_by_a_group: usize) -> Vec<Range<usize>> {
    // A held sample takes a sequence number, and a position and a velocity per axis.
    let heard = shape.topology.as_ref().map_or(shape.peers - 1, |topology| topology.links().div_ceil(shape.peers));
    let held_by_a_peer = heard.max(1) * (size_of::<u64>() + shape.axes * size_of::<[f64; 2]>());
    let most = (held_by_a_group / held_by_a_peer).max(1).next_multiple_of(WIDTH);
    // Groups of nearly equal size: the number of groups comes first, and the peers are divided evenly among the groups in whole registers.
    let size = members.len().div_ceil(members.len().div_ceil(most).max(1)).next_multiple_of(WIDTH);
    members.clone().step_by(size).map(|first| first..(first + size).min(members.end)).collect()
}

/// Runs a scene on the given number of threads to its end. Returns `None` if the run diverged, because threads notice a divergence only at their next meeting.
pub(super) fn run<const A: usize>(
    scene: &Scene,
    shape: &Shape,
    law: BuiltIn,
    threads: usize,
    keep_going: &mut dyn FnMut(Instant) -> bool,
) -> Option<Summary> {
    run_in_groups::<A>(scene, shape, law, (threads, HELD_BY_A_GROUP), keep_going)
}

fn run_in_groups<const A: usize>(
    scene: &Scene,
    shape: &Shape,
    law: BuiltIn,
    (threads, held_by_a_group): (usize, usize),
    keep_going: &mut dyn FnMut(Instant) -> bool,
) -> Option<Summary> {
    let shares = (0..threads).map(|place| place * shape.peers / threads..(place + 1) * shape.peers / threads);
    let groups: Vec<Vec<Range<usize>>> = shares.map(|share| groups(shape, &share, held_by_a_group)).collect();
    let bodies: Vec<Vec<Bodies<A>>> =
        groups.iter().map(|groups| groups.iter().map(|members| bodies_of::<A, 1>(&[scene], members, &[law], None)).collect()).collect();
    // Every part begins with the initial states of all peers, so all bodies are made before any thread starts.
    let all = bodies.iter().flatten().zip(groups.iter().flatten());
    let initial: Vec<Sample<A, 1>> = all.flat_map(|(bodies, members)| (0..members.len()).map(|peer| bodies.sample(peer))).collect();
    let exchange = Exchange::new(threads);
    let part = |place: usize, bodies: Vec<Bodies<A>>, keep_going: Option<&mut dyn FnMut(Instant) -> bool>| {
        let _broken_if_panicking = exchange.guard();
        let groups = &groups[place];
        let members = groups.first().map_or(0..0, |first| first.start..groups[groups.len() - 1].end);
        let of_members =
            |(bodies, members): (Bodies<A>, &Range<usize>)| Arrays::of_members([scene], shape.clone(), [law], members.clone(), bodies, &initial);
        let groups = bodies.into_iter().zip(groups).map(of_members).collect();
        Part { groups, thread: Thread::new(&exchange, place, members), keep_going }.run()
    };
    let ended: Vec<Option<Ended<'_, A>>> = std::thread::scope(|scope| {
        let mut bodies = bodies.into_iter();
        let first = bodies.next()?;
        // The first part runs on the present thread: `keep_going` belongs to the caller and is not sent to another thread.
        let part = &part;
        let others: Vec<_> = bodies.enumerate().map(|(place, bodies)| scope.spawn(move || part(place + 1, bodies, None))).collect();
        let first = part(0, first, Some(keep_going));
        let others = others.into_iter().map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        Some(std::iter::once(first).chain(others).collect())
    })?;
    let ended: Vec<Ended<'_, A>> = ended.into_iter().collect::<Option<_>>()?;
    let Ended { ending, ticks, until, max_discrepancy, .. } = ended[0];
    let groups: Vec<_> = ended.into_iter().flat_map(|ended| ended.groups).collect();
    Some(summary(&groups, 0, ticks, ending, until, max_discrepancy))
}

/// Peers of a thread at the end of the run.
struct Ended<'a, const A: usize> {
    groups: Vec<Arrays<'a, A, 1>>,
    ending: Ending,
    ticks: u64,
    /// Instant of the last delivery.
    until: Instant,
    max_discrepancy: f64,
}

/// Share of a thread in a run. Has at least one group.
struct Part<'a, 'e, 'k, const A: usize> {
    groups: Vec<Arrays<'a, A, 1>>,
    thread: Thread<'e, A>,
    keep_going: Option<&'k mut dyn FnMut(Instant) -> bool>,
}

/// Reason for the early end of a thread's run.
enum Early {
    Diverged,
    /// The observer ended the run after the given number of ticks.
    Interrupted(u64),
}

impl<'a, const A: usize> Part<'a, '_, '_, A> {
    fn run(mut self) -> Option<Ended<'a, A>> {
        let shape = self.groups[0].shape.clone();
        let (mut tick, last) = (0, shape.tick_at(shape.end));
        let (ending, ticks) = loop {
            // All threads know the same changes of the timeline, so all stop at the same tick without a meeting.
            let until = self.groups[0].next_change().min(last);
            match self.run_over(tick..until) {
                ControlFlow::Break(Early::Diverged) => return None,
                ControlFlow::Break(Early::Interrupted(ticks)) => break (Ending::Interrupted(shape.before(ticks).1), ticks),
                ControlFlow::Continue(()) => tick = until,
            }
            let now = shape.instant(tick).min(shape.end);
            self.groups.iter_mut().for_each(|group| group.change(tick, now, &mut |_| ()));
            if tick == last {
                break (Ending::Complete, tick);
            }
        };
        let Self { mut groups, mut thread, .. } = self;
        for group in &mut groups {
            if ending == Ending::Complete
                && let Samples::PerPacket(samples) = &mut group.samples
            {
                samples.finish(shape.before(ticks));
            }
        }
        // A last exchange without samples: extremes and finiteness of the ticks since the last meeting.
        thread.exchange(&[], &mut []);
        // The last ticks may have diverged after the last meeting.
        if !thread.all_are_finite() {
            return None;
        }
        let until = groups.iter_mut().map(|group| group.stop(0, ticks, ending)).max()?;
        Some(Ended { groups, ending, ticks, until, max_discrepancy: thread.max_discrepancy() })
    }

    fn run_over(&mut self, ticks: Range<u64>) -> ControlFlow<Early> {
        let mut tick = ticks.start;
        while tick < ticks.end {
            // Every thread reads the result of the same meeting, so all threads end at the same tick.
            if !self.thread.all_are_finite() {
                return ControlFlow::Break(Early::Diverged);
            }
            let mut sends = false;
            // All groups begin the tick alike, so the answer of the last group is the answer of all.
            for group in &mut self.groups {
                sends = group.begin(tick);
            }
            if sends {
                self.meet();
            }
            let end = self.groups[0].earliest_send.min(self.groups[0].shape.asked_after(tick)).min(ticks.end);
            // Up to the next tick of a sending or of a question to the observer, groups do not depend on each other.
            self.go_on(tick..end, sends);
            let shape = &self.groups[0].shape;
            let (latest, is_asked) = (shape.instant(end - 1), shape.is_asked_before(end));
            if is_asked && !self.goes_on(latest) {
                return ControlFlow::Break(Early::Interrupted(end));
            }
            tick = end;
        }
        ControlFlow::Continue(())
    }

    /// Gives every group the samples of all other groups and threads.
    fn meet(&mut self) {
        let Self { groups, thread, .. } = self;
        let Some((first, others)) = groups.split_first_mut() else { return };
        // The first group collects the samples of all groups of this thread before the exchange.
        for group in &*others {
            first.sent[group.members.clone()].copy_from_slice(&group.sent[group.members.clone()]);
        }
        thread.exchange(&first.senders, &mut first.sent);
        others.iter_mut().for_each(|group| group.sent.copy_from_slice(&first.sent));
    }

    /// Computes the given ticks, one group after another. All groups have begun the ticks; samples are sent in the first tick only, if `sends`.
    fn go_on(&mut self, ticks: Range<u64>, sends: bool) {
        let Self { groups, thread, .. } = self;
        // Extremes of the first group append ticks, extremes of further groups join the same ticks from `noted` on.
        let noted = thread.ticks_noted();
        for group in groups {
            for (tick, place) in ticks.clone().zip(noted..) {
                let now = group.shape.instant(tick);
                if sends && tick == ticks.start {
                    group.send(tick, now);
                }
                // Before the motion: extremes belong to the present tick.
                thread.note_extremes(place, group.bodies.blocks().extremes());
                group.go_on(now, tick, &mut Unwatched(&mut |_| true));
                thread.note_finite(group.finite[0]);
            }
        }
    }

    /// Returns whether the run goes on after the instant `before`. The first thread asks the observer, and the other threads take its answer.
    fn goes_on(&mut self, before: Instant) -> bool {
        let known = self.keep_going.as_mut().map(|keep_going| keep_going(before));
        self.thread.goes_on(known)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use cohaptic_scene::FromScene;

    use super::*;
    use crate::plan::{Model, Plan};

    /// Returns a scene of 43 peers over the given links, with further settings.
    fn scene(link: &str, settings: &[&str]) -> Scene {
        let text = format!(
            r#"
            scene = {{ duration = "1100ms", count = 43 }}
            object.mass = 3.0
            coordination = {{ strategy = "average-position", stiffness = 20.0, damping = 0.5, update = "7ms" }}
            peer = {{ device = {{ mass = 0.1, damping = 5.0 }}, coupling = {{ stiffness = 1000.0, damping = 5.0 }} }}
            peers = [{{ name = "peer1", hand = {{ force = 1.5 }} }}, {{ name = "peer9", phase = 3, compute-delay = 1 }}]
            link = {{ {link} }}
            "#
        );
        let settings: Vec<String> = settings.iter().map(|setting| (*setting).to_owned()).collect();
        Scene::parse(&text, Path::new("x.toml"), &settings).unwrap_or_else(|error| panic!("{link}, {settings:?}: {error}"))
    }

    /// Runs a scene with peers in groups of eight on the given number of threads, and all peers together, until the observer was asked `questions` times.
    fn runs(scene: &Scene, threads: usize, questions: u32) -> (Option<Summary>, Summary) {
        let (shape, law) = Shape::of(scene, &Plan::new(scene, Model::Least, false), &FromScene).unwrap();
        let mut asked = [questions; 2];
        let [mut one, mut other] = asked.each_mut().map(|asked| {
            move |_| {
                *asked -= 1;
                *asked > 0
            }
        });
        let in_groups = run_in_groups::<1>(scene, &shape, law, (threads, 1), &mut one);
        // `arrays::run` would compile the loops for three axes too, for scenes of one axis.
        let [together] = Arrays::<1, 1>::new([scene], shape, [law], None).run(Unwatched(&mut other));
        (in_groups, together)
    }

    /// Covers links of all kinds, phases, neighbours, a timeline with a change between two meetings, and an observer that ends the run between two meetings.
    #[test]
    #[ignore = ".ci/nightly runs it: it takes long"]
    fn groups_come_to_what_all_come_to_together() {
        let jitter = "delay = \"9ms\", jitter = \"3ms\", loss = \"5%\"";
        let change = "timeline=[{ at = \"101500us\", link = \"all\", set = { delay = \"4ms\" } }, { at = \"205ms\", peer = \"peer20\", set = { hand = { force = 1 } } }]";
        let scenes = [
            scene(jitter, &[]),
            scene(jitter, &["coordination.strategy=extrapolated", "coordination.extrapolated.horizon=30ms"]),
            scene(jitter, &["topology={ kind = \"ring\", neighbours = 4 }"]),
            scene(jitter, &[change]),
            scene("delay = \"9ms\", jitter = \"2ms\", rate = \"100kbit\", queue = { limit = \"3 packets\", discipline = \"codel\" }", &[]),
        ];
        for (scene, threads, questions) in scenes.iter().flat_map(|scene| [(scene, 1, 9), (scene, 2, 9), (scene, 1, 1)]) {
            let (in_groups, together) = runs(scene, threads, questions);
            assert_eq!(in_groups.as_ref(), Some(&together), "{threads} threads, {questions} questions, {:?}", scene.links);
            assert_eq!(matches!(together.ending, Ending::Interrupted(_)), questions == 1);
        }
    }

    /// Copies that are farthest apart at first approach, while other copies move away, all between two meetings with a change in between.
    #[test]
    fn copies_are_apart_at_one_tick() {
        let apart = "peers=[{ name = \"peer1\", position = 0.012, hand = { force = -200 } }, { name = \"peer2\", hand = { force = -1 } }]";
        let at_once = "timeline=[{ at = \"2500us\", link = \"all\", set = { delay = \"4ms\" } }]";
        let (in_groups, together) = runs(&scene("delay = \"9ms\", jitter = \"3ms\"", &["scene.duration=6ms", apart, at_once]), 1, 9);
        assert_eq!(in_groups, Some(together));
    }

    #[test]
    fn groups_that_diverge_say_so() {
        let (in_groups, together) = runs(&scene("delay = \"9ms\", jitter = \"3ms\"", &["coordination.stiffness=1e9"]), 1, 9);
        assert!(in_groups.is_none() && matches!(together.ending, Ending::Diverged(_)));
    }

    #[test]
    fn groups_are_whole_registers_that_share_all_peers() {
        let scene = scene("delay = \"9ms\", jitter = \"3ms\"", &["scene.count=1000"]);
        let (shape, _) = Shape::of(&scene, &Plan::new(&scene, Model::Least, false), &FromScene).unwrap();
        // A peer holds 999 entries: a sequence number, a position and a velocity, of 8 bytes each.
        for (held, size) in [(1, 8), (999 * 24 * 16, 16), (999 * 24 * 17, 24), (999 * 24 * 900, 504), (usize::MAX, 1000)] {
            let groups = groups(&shape, &(0..1000), held);
            assert_eq!(groups[0], 0..size, "{held}");
            assert!(groups.iter().map(|group| group.start).eq((0..1000).step_by(size)) && groups[groups.len() - 1].end == 1000, "{held}");
        }
        assert!(shape.pays_in_groups());
    }
}
