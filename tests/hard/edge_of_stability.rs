//! Gains a ten-thousandth below and above the edge of stability, for a million ticks, by day for a quarter of them: the simulation decays and grows by the
//! spectral radius, frame by frame.
//!
//! With w a left eigenvector of the tick's matrix A, w·A = λ·w, the component c = w·s of the state obeys c⁺ = λ·c, however little else has died out. What comes
//! between, per frame and relative to |c|, is at most
//!
//! ```text
//! (‖w‖₁·(E + (12·R + 4)·u) + ‖r‖₁)·‖s‖∞/(|λ|·|c|)
//! ```
//!
//! with E the error of A that the analysis states, R = ‖A‖∞, and r = w·A − λ·w, the residual of the eigenvector as it was computed. A tick rounds at most 12
//! times in terms of what a row of |A| makes of the state (3 in FC, 3 in FT, one in their difference, 3 in the step's products and sums, one in the product with
//! the coefficient, one in a mean), and 4 times in terms of the state itself (each position and velocity when it is added to, and when this test takes
//! the difference from the first copy). All of these are computed along the run and added up: the logarithm of the growth over all frames is K·ln|λ| within
//! their sum, so the growth per frame is known to 10⁻¹³ or better.

use cohaptic_harness::{Model, Simulation, TickRow};
use cohaptic_peer::{Contact, Gains};
use cohaptic_stability::{Boundary, BoundaryOptions, Cell, KeyRange, Method, Monodromy, StateKind, Verdict, analyse, monodromy};
use cohaptic_tests::Draft;
use cohaptic_tests_common::quarter_by_day;

use crate::eigenvectors::{LeftEigenvector, left_eigenvectors};
use crate::hard::ROUNDING;
use crate::hard::watch::OnTick;

fn ticks() -> usize {
    quarter_by_day(1_000_000) as usize
}

/// One peer at a tick: its copy and its device; the other peer's are the same with the opposite sign.
#[derive(Clone, Copy, Default)]
struct Row {
    object: (f64, f64),
    device: (f64, f64),
}

/// Two peers that begin as mirror images and stay so to the bit: the common motion is zero, and a decay has no floor.
fn mirrored() -> Draft {
    let mut draft = Draft { duration: ticks() as u64, ..Draft::calm(2) };
    for (peer, x) in draft.peers.iter_mut().zip([0.01, -0.01]) {
        peer.position = Some([x, 0.0, 0.0]);
    }
    draft
}

/// Free copies over 12 ms, with that KT.
fn coordinated(stiffness: f64) -> Draft {
    Draft { gains: Gains { stiffness, damping: 5.0 }, link: "delay = \"12ms\"".to_owned(), ..mirrored() }
}

/// Copies in a grasp with that KC, over an ideal network. Without BT it is the mode in which peers are mirror images that loses its stability first.
fn grasped(stiffness: f64) -> Draft {
    let mut draft = Draft { gains: Gains { stiffness: 200.0, damping: 0.0 }, ..mirrored() };
    for peer in &mut draft.peers {
        (peer.contact, peer.coupling) = (Contact::Grasp, Gains { stiffness, damping: 5.0 });
    }
    draft
}

/// Where a scene loses its stability, as the analysis finds it.
fn edge(scene: fn(f64) -> Draft, low: f64, high: f64) -> f64 {
    let range = KeyRange { key: "stiffness".to_owned(), low, high, unit: String::new() };
    let options = BoundaryOptions { samples: 40, ..BoundaryOptions::of(&range) };
    let radius = |value: f64| analyse(&scene(value).scene(), Method::Reduced).map(|analysis| Cell::certain(analysis.radius));
    let boundary = Boundary::search(&range, options, &[], radius, |_| (), || false).unwrap();
    assert!(boundary.is_settled() && boundary.marginal.is_empty());
    let [crossing] = boundary.crossings[..] else { panic!("one edge between {low} and {high}: {boundary:?}") };
    assert_eq!((crossing.from, crossing.to), (Verdict::Stable, Verdict::Unstable));
    crossing.value
}

fn run(draft: &Draft) -> Vec<Row> {
    let mut rows = vec![Row::default(); ticks()];
    let mut tick = 0;
    let Ok(_) = Simulation::new(&draft.scene(), Model::Least).run(&mut OnTick(|row: &TickRow<'_>| {
        let here = Row { object: (row.object.position[0], row.object.velocity[0]), device: (row.device.position[0], row.device.velocity[0]) };
        if row.peer == 0 {
            rows[tick] = here;
        } else {
            let one = rows[tick];
            assert_eq!((one.object.0, one.object.1, one.device.0), (-here.object.0, -here.object.1, -here.device.0), "at {}", row.at);
            tick += 1;
        }
    }));
    assert_eq!(tick, rows.len());
    rows
}

/// The relative state before a tick, as the matrix has it.
fn state(monodromy: &Monodromy, rows: &[Row], tick: usize) -> Vec<f64> {
    let reference = rows[tick].object.0;
    let value = |peer: usize, kind: StateKind| {
        let sign = if peer == 0 { 1.0 } else { -1.0 };
        let at = |age: usize| rows[tick - age];
        match kind {
            StateKind::ObjectPosition { .. } => sign * at(0).object.0 - reference,
            StateKind::ObjectVelocity { .. } => sign * at(0).object.1 * monodromy.time,
            StateKind::SamplePosition { age, .. } => sign * at(age).object.0 - reference,
            StateKind::SampleVelocity { age, .. } => sign * at(age).object.1 * monodromy.time,
            StateKind::DevicePosition { .. } => sign * at(0).device.0 - reference,
            StateKind::DeviceVelocity { .. } => sign * at(0).device.1 * monodromy.time,
            kind => panic!("a scene with a {kind} is not one of these"),
        }
    };
    monodromy.states.iter().map(|state| value(state.peer, state.kind)).collect()
}

/// An eigenvalue of largest modulus among those that the mirrored state excites, with a left eigenvector and the sum of the sizes of its residual.
fn dominant(monodromy: &Monodromy, excited: &[f64]) -> (f64, Vec<(f64, f64)>, f64) {
    let scale = excited.iter().fold(0.0, |scale: f64, entry| scale.max(entry.abs()));
    let parts = |vector: &LeftEigenvector| vector.entries.iter().map(|entry| (entry.re, entry.im)).collect::<Vec<_>>();
    let is_excited = |vector: &LeftEigenvector| component(&parts(vector), excited) > 1e-6 * scale;
    let found = left_eigenvectors(&monodromy.matrix).find(is_excited).unwrap();
    (found.value.norm(), parts(&found), found.residual.iter().sum())
}

/// |w·s|.
fn component(left: &[(f64, f64)], state: &[f64]) -> f64 {
    let (real, imaginary) = left.iter().zip(state).fold((0.0, 0.0), |sum, (left, state)| (sum.0 + left.0 * state, sum.1 + left.1 * state));
    real.hypot(imaginary)
}

/// Runs a scene for a million ticks and asserts that it grows by its spectral radius, which is on that side of 1.
fn grows_by_its_radius(draft: &Draft, expected: Verdict) {
    let analysis = analyse(&draft.scene(), Method::Reduced).unwrap();
    let radius = analysis.radius;
    assert_eq!(analysis.verdict(), expected, "{radius:?}");
    let matrix = monodromy(&draft.scene()).unwrap();
    assert_eq!(matrix.frame.as_millis(), 1);
    let rows = run(draft);
    // Samples of all ages have been sent by then.
    let begin = 100;
    let (modulus, left, residual) = dominant(&matrix, &state(&matrix, &rows, begin));
    let size = matrix.matrix.rows();
    let largest_row = (0..size).map(|row| matrix.matrix.row(row).iter().map(|entry| entry.abs()).sum::<f64>()).fold(0.0, f64::max);
    let weight: f64 = left.iter().map(|entry| entry.0.hypot(entry.1)).sum();
    let per_frame = weight * (matrix.error + (12.0 * largest_row + 4.0) * ROUNDING) + residual;
    let mut between = 0.0;
    let mut last = 0.0;
    let first = component(&left, &state(&matrix, &rows, begin));
    for tick in begin..rows.len() {
        let state = state(&matrix, &rows, tick);
        last = component(&left, &state);
        between += per_frame * state.iter().fold(0.0, |size: f64, entry| size.max(entry.abs())) / (modulus * last);
    }
    let frames = (rows.len() - 1 - begin) as f64;
    let (growth, tolerance) = (libm::log(last / first) / frames, 1.001 * between / frames);
    // ln(ρ ± e) = ln ρ ± e/ρ; the eigenvalue itself is off by its residual, which is in the sum.
    let apart = (growth - libm::log(radius.value)).abs();
    assert!(apart <= tolerance + 1.001 * radius.error / radius.value, "e^{growth:e} a frame, the radius is {radius:?}, tolerance {tolerance:e}");
    // The tolerance tells the two sides apart a thousand times over.
    assert!(1e3 * tolerance < libm::log(radius.value).abs(), "{tolerance:e} of {:e}", libm::log(radius.value));
    assert_eq!(growth < 0.0, expected == Verdict::Stable);
}

#[test]
fn coordination_at_the_edge_decays_and_grows_by_the_spectral_radius_for_a_million_ticks() {
    let edge = edge(coordinated, 10.0, 3000.0);
    grows_by_its_radius(&coordinated(edge * (1.0 - 1e-4)), Verdict::Stable);
    grows_by_its_radius(&coordinated(edge * (1.0 + 1e-4)), Verdict::Unstable);
}

#[test]
fn a_coupling_at_the_edge_decays_and_grows_by_the_spectral_radius_for_a_million_ticks() {
    let edge = edge(grasped, 1000.0, 60_000.0);
    grows_by_its_radius(&grasped(edge * (1.0 - 1e-4)), Verdict::Stable);
    grows_by_its_radius(&grasped(edge * (1.0 + 1e-4)), Verdict::Unstable);
}
