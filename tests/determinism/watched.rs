//! Runs of which only ticks and instants are looked at are run in arrays: what an observer sees is what events show, row by row, to the bit.

use std::time::Duration;

use cohaptic_harness::{Ending, InstantRow, Model, Observer, Simulation, Summary, TickRow, Ticks, same_shape};
use cohaptic_peer::Contact;
use cohaptic_scene::Scene;
use cohaptic_tests::drafts;
use cohaptic_tests_common::{cases, properties};
use cohaptic_units::Instant;
use proptest::prelude::*;

use super::arrays::{difference, mesh};

/// Keeps the bits of all rows, until it has had enough.
pub(super) struct Keeper {
    /// Wants rows of samples held as well, for which a run has events.
    has_events: bool,
    /// Until when it wants the run to go on, and how many rows it takes before it fails.
    pub(super) until: Instant,
    pub(super) most_rows: usize,
    rows: Vec<Vec<u64>>,
    called_together: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Full;

impl Keeper {
    fn new(has_events: bool) -> Self {
        Self { has_events, until: Instant::MAX, most_rows: usize::MAX, rows: Vec::new(), called_together: false }
    }

    fn keep(&mut self, row: Vec<u64>) -> Result<(), Full> {
        self.rows.push(row);
        if self.rows.len() < self.most_rows { Ok(()) } else { Err(Full) }
    }
}

fn bits<'a>(numbers: impl IntoIterator<Item = &'a f64>) -> impl Iterator<Item = u64> {
    numbers.into_iter().map(|number| number.to_bits())
}

impl Observer for Keeper {
    type Error = Full;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn wants_instants(&self) -> bool {
        true
    }

    fn wants_holds(&self) -> bool {
        self.has_events
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Full> {
        let mut kept = vec![row.at.as_nanos(), row.peer as u64];
        for state in [row.device, row.object, row.target] {
            kept.extend(bits(state.position.iter().chain(state.velocity)));
        }
        kept.extend(bits(row.coupling_force.iter().chain(row.coordination_force)));
        self.keep(kept)
    }

    /// What the view of all peers says is what their rows say.
    fn on_ticks(&mut self, ticks: &Ticks<'_>) -> Result<(), Full> {
        self.called_together = true;
        ticks.each(|row| {
            for (axis, position) in row.object.position.iter().enumerate() {
                assert_eq!(ticks.position(row.peer, axis).to_bits(), position.to_bits());
                assert_eq!(ticks.positions(axis).nth(row.peer).map(f64::to_bits), Some(position.to_bits()));
            }
            assert_eq!(ticks.at(), row.at);
            self.on_tick(row)
        })
    }

    fn on_instant(&mut self, row: &InstantRow) -> Result<(), Full> {
        self.keep(vec![row.at.as_nanos(), row.discrepancy.to_bits()])
    }

    fn keep_going(&mut self, now: Instant) -> bool {
        now < self.until
    }
}

/// Runs the scene with two such observers, and gives the first thing in which they differ.
pub(super) fn found(scene: &Scene, change: impl Fn(&mut Keeper)) -> Option<String> {
    let run = |has_events| {
        let mut keeper = Keeper::new(has_events);
        change(&mut keeper);
        let summary: Result<Summary, Full> = Simulation::new(scene, Model::Least).run(&mut keeper);
        assert_eq!(keeper.called_together, !has_events, "it is run in arrays if it needs no events");
        assert!(same_shape(scene, scene), "it is run in arrays");
        (summary, keeper.rows)
    };
    let ((one, rows), (other, expected)) = (run(false), run(true));
    if let Some((place, (row, expected))) = rows.iter().zip(&expected).enumerate().find(|(_, (a, b))| a != b) {
        let numbers = |row: &[u64]| row.iter().map(|bits| f64::from_bits(*bits)).collect::<Vec<_>>();
        return Some(format!("row {place}: {:?} {:?}\nis not {:?} {:?}", &row[..2], numbers(&row[2..]), &expected[..2], numbers(&expected[2..])));
    }
    if rows.len() != expected.len() {
        return Some(format!("{} rows are not {}", rows.len(), expected.len()));
    }
    match (one, other) {
        (Ok(one), Ok(other)) => difference(&one, &other),
        (one, other) => (one.is_ok() != other.is_ok()).then(|| format!("{one:?} is not {other:?}")),
    }
}

properties! {
    #![proptest_config(cases(400))]

    #[test]
    fn rows_of_a_run_in_arrays_are_those_of_its_events(drafts in drafts::alike(Just(1))) {
        let found = found(&drafts[0].scene(), |_| ());
        prop_assert!(found.is_none(), "{}", found.unwrap());
    }
}

properties! {
    #![proptest_config(cases(30))]

    /// An observer that ends a run, or fails, has seen what it would have seen of events.
    #[test]
    fn who_has_had_enough_has_seen_the_same(mut drafts in drafts::alike(Just(1)), seconds in 0..3_u64, most_rows in prop_oneof![1..200_usize, Just(usize::MAX)]) {
        drafts[0].duration = 2500;
        let until = Instant::from_nanos(seconds * 1_000_000_000);
        let found = found(&drafts[0].scene(), |keeper| (keeper.until, keeper.most_rows) = (until, most_rows));
        prop_assert!(found.is_none(), "{}", found.unwrap());
    }
}

/// A device that touches nothing moves by its hand if the run is watched, and one without a hand rests, with the sign of its zero.
#[test]
fn devices_that_touch_nothing_are_seen() {
    for link in ["delay = \"3ms\"", "delay = \"3ms\", jitter = \"400us\""] {
        let mut scene = mesh(3, link);
        scene.duration = Duration::from_millis(50);
        for peer in &mut scene.peers {
            peer.contact = Contact::None;
            peer.position[0] = -0.0;
        }
        assert!(scene.peers[0].hand.is_some() && scene.peers[1].hand.is_none());
        assert_eq!(found(&scene, |_| ()), None, "{link}");
        let mut keeper = Keeper::new(false);
        Simulation::new(&scene, Model::Least).run(&mut keeper).unwrap();
        let device = |row: usize| f64::from_bits(keeper.rows[row][2]);
        assert!(device(4 * 49) > 1e-3, "{}", device(4 * 49));
        assert_eq!(keeper.rows[4 * 49 + 1][2], (-0.0_f64).to_bits());
    }
}

/// Rows of a run that diverges are given once.
#[test]
fn runs_that_diverge_are_seen_to_their_end() {
    for link in
        ["delay = \"9ms\"", "delay = \"9ms\", jitter = \"2ms\", rate = \"100kbit\", queue = { limit = \"3 packets\", discipline = \"codel\" }"]
    {
        for peers in [3, 20] {
            let mut scene = mesh(peers, link);
            scene.coordination.gains.stiffness = 3e7;
            assert_eq!(found(&scene, |_| ()), None, "{link}, {peers} peers");
            let mut keeper = Keeper::new(false);
            let summary = Simulation::new(&scene, Model::Least).run(&mut keeper).unwrap();
            assert!(matches!(summary.ending, Ending::Diverged(_)), "{link}");
        }
    }
}

/// Of 257 peers on the means are exact.
#[test]
fn rows_of_many_peers_are_those_of_their_events() {
    for link in ["delay = \"3ms\"", "delay = \"3ms\", jitter = \"400us\", loss = \"5%\""] {
        let mut scene = mesh(260, link);
        scene.duration = Duration::from_millis(24);
        assert_eq!(found(&scene, |_| ()), None, "{link}");
    }
}
