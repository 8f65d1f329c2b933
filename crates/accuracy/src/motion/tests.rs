//! Methods against their orders, the reference against closed forms and other programs, and the loop against the simulator.

use std::convert::Infallible;
use std::time::Duration;

use cohaptic_harness::{Model, Observer, Simulation, TickRow};
use cohaptic_peer::Plant;

use super::scenes::{COUPLED, FREE, PUSH, STIFF};
use super::*;
use crate::Unwatched;

const QUICK: Options = Options { quick: true };

fn work(motion: &MotionScene) -> Work {
    Work::prepare(motion, QUICK).unwrap()
}

fn position_error(work: &Work, method: Method) -> f64 {
    work.errors(method).0.unwrap()
}

/// Halving the step divides the error by 2 to the order, for position and energy, in every scene whose error is far above rounding.
#[test]
fn eulers_error_falls_with_the_step_and_runge_and_kuttas_with_its_fourth_power() {
    for motion in [FREE, COUPLED, PUSH] {
        let work = work(&motion);
        let orders = |way: fn(u32) -> Method, coarse: u32, fine: u32| {
            let ((x, e), (x2, e2)) = (work.errors(way(coarse)), work.errors(way(fine)));
            let halvings = f64::from(fine / coarse).log2();
            [(x.unwrap() / x2.unwrap()).log2() / halvings, (e.unwrap() / e2.unwrap()).log2() / halvings]
        };
        for (way, order, coarse, fine) in [
            (Method::Euler as fn(u32) -> Method, 1.0, 16, 64),
            (Method::EulerMap, 1.0, 16, 64),
            (Method::RungeKutta, 4.0, 1, 4),
            (Method::RungeKuttaMap, 4.0, 1, 4),
        ] {
            for found in orders(way, coarse, fine) {
                assert!((found - order).abs() < 0.1, "{}: {} has order {found}", motion.name, way(1).name());
            }
        }
    }
}

/// The predicted boundary converges with the same order.
#[test]
fn the_boundary_converges_with_the_order_too() {
    for motion in [COUPLED, STIFF] {
        let work = work(&motion);
        let (range, right) = (motion.boundary.unwrap(), work.critical.unwrap());
        let error = |method: Method| {
            let found = boundary::critical(&work.pair, range, &boundary::quadruple(&method.maps(&work.pair))).unwrap();
            absolute(found - right).rounded()
        };
        let order = |way: fn(u32) -> Method, coarse: u32| (error(way(coarse)) / error(way(2 * coarse))).log2();
        assert!((order(Method::EulerMap, 64) - 1.0).abs() < 0.1, "{}", motion.name);
        assert!((order(Method::RungeKuttaMap, 2) - 4.0).abs() < 0.1, "{}", motion.name);
        // The exact propagator is 1000 times nearer than Runge–Kutta in one step, and within some roundings of a number of that size, amplified by the loop.
        assert!(error(Method::Exact) < 1e-3 * error(Method::RungeKutta(1)));
        assert!(error(Method::Exact) < 1e-13 * right.rounded());
    }
}

/// A spring moved with the new velocity is stable up to K·h²·(1/mH + 1/mO) = 4, far beyond the limit of a sampled and held spring.
#[test]
fn one_step_of_euler_calls_stable_what_is_not() {
    let work = work(&STIFF);
    let found = boundary::critical(&work.pair, STIFF.boundary.unwrap(), &boundary::quadruple(&Method::Euler(1).maps(&work.pair))).unwrap();
    assert!(found.rounded() > 10.0 * work.critical.unwrap().rounded(), "{found:?}");
}

/// The closed form of a damped free mass under a constant force is v = f/b·(1 − e^{−bt/m}), x = f/b·(t − m/b·(1 − e^{−bt/m})), with the exponential of the
/// `qd` crate.
#[test]
fn the_reference_is_the_closed_form_of_a_free_device() {
    let work = work(&FREE);
    let (b, m) = (Quad::of(5.0), Quad::of(0.1));
    for (tick, bodies) in work.reference.iter().enumerate() {
        let t = Quad::of(f64_of(tick + 1)) / Quad::of(1000.0);
        let reached = Quad::ONE - (-(b * t / m)).exp();
        let x = (t - m / b * reached) / b;
        // A thousand additions of numbers below 0.2 are each rounded at 2⁻¹⁰⁴ or better.
        assert!(absolute(bodies[0].position - x).rounded() < 1000.0 * 0.2 * 5e-32, "tick {tick}");
        assert!(absolute(bodies[0].velocity - reached / b).rounded() < 1000.0 * 0.2 * 5e-32, "tick {tick}");
    }
}

/// A number with twice the digits of a double, as an unevaluated sum.
type Sum = (f64, f64);

/// The expected values after 500 ticks come from an independent program: mpmath 1.3.0 with 60 digits, its matrix exponential, and the loop written anew. Each
/// number is a sum of two doubles.
#[test]
fn the_reference_is_that_of_another_program() {
    let expected: [(MotionScene, [[Sum; 2]; 4]); 2] = [
        (
            COUPLED,
            [
                [(0.008_070_261_463_368_585, 7.458_817_157_225_964e-19), (0.007_069_465_682_370_614, -3.188_887_569_234_578e-19)],
                [(0.010_866_384_226_182_519, -2.805_606_940_493_602_2e-19), (0.007_819_231_248_701_703, -2.044_186_744_542_709_2e-20)],
                [(0.008_521_238_988_308_508, -7.889_362_526_359_145e-19), (0.007_106_458_169_150_311, -1.023_247_917_131_534_4e-19)],
                [(0.010_384_606_931_244_66, -8.662_102_754_467_559e-19), (0.007_615_269_984_670_453, -2.792_358_744_579_447e-19)],
            ],
        ),
        (
            STIFF,
            [
                [(0.008_876_465_092_369_58, -3.377_401_915_617_160_7e-19), (0.005_627_189_009_940_700_5, -5.569_515_964_495_633e-20)],
                [(0.010_944_143_833_558_833, -3.078_881_265_767_681e-19), (0.000_297_960_995_045_592_74, 3.135_297_873_883_717_7e-21)],
                [(0.008_939_734_309_111_732, 1.735_852_227_974_926_3e-19), (0.004_907_057_770_068_059, 6.412_080_176_801_998e-20)],
                [(0.010_860_451_886_040_231, 6.216_933_670_088_76e-19), (0.009_670_890_748_118_19, -5.607_056_371_37e-19)],
            ],
        ),
    ];
    for (motion, bodies) in expected {
        let found = work(&motion).reference[499];
        for (found, [x, v]) in found.iter().zip(bodies) {
            // The tolerance covers 500 ticks of some ten roundings of numbers below 0.02, by 2⁻¹⁰⁴ each, amplified over a tick by a coupling of 15 kN/m.
            assert!(absolute(found.position - Quad(x.0, x.1)).rounded() < 1e-28, "{}: {found:?}", motion.name);
            assert!(absolute(found.velocity - Quad(v.0, v.1)).rounded() < 1e-27, "{}: {found:?}", motion.name);
        }
    }
}

/// The halving of long steps is exact: one step of 100 ms against a hundred steps of 1 ms.
#[test]
fn a_long_exact_step_is_as_good_as_many_short_ones() {
    let plant = Plant { mass: 0.1, damping: 5.0, stiffness: 300.0 };
    let (long, short): (StepMap<Quad>, StepMap<Quad>) = (exponential::exact_map(&plant, 1e8), exponential::exact_map(&plant, 1e6));
    let mut at_once = Motion { position: Quad::of(0.3), velocity: Quad::of(-1.0) };
    let mut in_steps = at_once;
    long.advance(&mut at_once, Quad::of(2.0));
    for _ in 0..100 {
        short.advance(&mut in_steps, Quad::of(2.0));
    }
    let apart = at_once.relative_to(in_steps);
    assert!(absolute(apart.position).rounded() < 1e-28 && absolute(apart.velocity).rounded() < 1e-27);
}

/// The bound is that of rounding alone. With u = 2⁻⁵³, each tick rounds x once, by at most u·|x|. An increment has a relative error of at most 11·u (8 of a
/// coefficient, 3 of its use), which sums to 11·u·|x|. The error of v shrinks by e^{−0.05} per tick and grows by u·|v| + 11·u·2·g₁·f ≤ 0.42·u, so it stays
/// below 8.7·u m/s and adds at most 8.7·u·t to x.
#[test]
fn the_exact_propagator_errs_by_no_more_than_roundings_explain() {
    let work = Work::prepare(&FREE, Options { quick: false }).unwrap();
    let (ticks, last) = (f64_of(work.reference.len()), work.reference.last().unwrap()[0].position.rounded());
    let u = 0.5 * f64::EPSILON;
    assert!(position_error(&work, Method::Exact) <= u * ((ticks + 11.0) * last + 8.7 * ticks * 1e-3));
    for motion in [COUPLED, STIFF, PUSH] {
        let work = self::work(&motion);
        assert!(position_error(&work, Method::Exact) < 1e-4 * position_error(&work, Method::RungeKutta(1)), "{}", motion.name);
    }
}

/// Steps multiplied into one map give the same result as single steps, except for roundings.
#[test]
fn one_map_is_many_steps() {
    for motion in SCENES {
        let work = work(&motion);
        for (stepped, mapped) in [(Method::Euler(4), Method::EulerMap(4)), (Method::RungeKutta(4), Method::RungeKuttaMap(4))] {
            let (stepped, mapped) = (stepped.run(&work.pair, |_, _| {}), mapped.run(&work.pair, |_, _| {}));
            for (one, other) in stepped.bodies.iter().zip(&mapped.bodies) {
                // The tolerance covers 1000 ticks of four steps with some ten roundings of numbers below 0.3.
                assert!((one.position - other.position).abs() < 4e4 * 0.3 * f64::EPSILON, "{}", motion.name);
            }
        }
    }
}

/// Observer that compares every number of a simulation with the loop of this crate.
struct Compare {
    bodies: Vec<[Motion; 4]>,
    compared: usize,
}

impl Observer for Compare {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        let tick = usize::try_from(row.at.as_nanos() / 1_000_000).unwrap();
        for (shown, place) in [(row.device, row.peer), (row.object, 2 + row.peer)] {
            let body = tick.checked_sub(1).map_or(Motion { position: 0.0, velocity: 0.0 }, |before| self.bodies[before][place]);
            assert_eq!(
                (shown.position[0].to_bits(), shown.velocity[0].to_bits()),
                (body.position.to_bits(), body.velocity.to_bits()),
                "tick {tick}, body {place}"
            );
            self.compared += 1;
        }
        Ok(())
    }
}

#[test]
fn the_loop_is_that_of_the_simulator_to_the_bit() {
    for motion in SCENES {
        let scene = motion.scene().unwrap();
        let pair = Pair::of(&motion, &scene, 4000);
        let mut bodies = Vec::new();
        Method::Exact.run(&pair, |_, now| bodies.push(*now));
        let mut compare = Compare { bodies, compared: 0 };
        Simulation::new(&scene, Model::General).run(&mut compare).unwrap();
        assert_eq!(compare.compared, 4 * 4000, "{}", motion.name);
    }
}

#[test]
fn the_scenes_are_as_hard_as_they_say() {
    let critical = work(&STIFF).critical.unwrap().rounded();
    let pair = work(&STIFF).pair;
    assert!((0.98..1.0).contains(&(pair.coupling.stiffness / critical)), "{critical}");
    let mut changes = 0;
    let mut touched = [false; 2];
    for bodies in Work::prepare(&PUSH, Options { quick: false }).unwrap().reference {
        let touches = [bodies[0].position > bodies[2].position, bodies[1].position < bodies[3].position];
        changes += u32::from(touches[0] != touched[0]) + u32::from(touches[1] != touched[1]);
        touched = touches;
    }
    assert!(changes >= 8, "contact was made or lost {changes} times");
}

/// The boundary of this module and the boundary of `cohaptic stability boundary` come from two matrices by different code.
#[test]
fn the_boundary_is_that_of_the_stability_analysis() {
    for motion in [COUPLED, STIFF] {
        let (along, low, high) = motion.boundary.unwrap();
        let found = program_boundary(&motion, (along.key(), low, high)).unwrap().unwrap();
        let right = work(&motion).critical.unwrap().rounded();
        // The analysis stops where its radius is within about 1e-11 of 1. The radius changes by 1e-6 or more per N/m.
        assert!((found - right).abs() < 1e-5, "{}: {found} {right}", motion.name);
    }
}

#[test]
fn the_tick_of_the_scenes_is_that_of_the_maps() {
    for motion in SCENES {
        let scene = motion.scene().unwrap();
        let tick = scene.peers[0].clock.spans();
        assert_eq!(tick, (Duration::from_millis(1), Duration::from_millis(1)));
        assert_eq!(scene.coordination.update, Duration::from_millis(u64::try_from(motion.update).unwrap()));
    }
}

#[test]
fn every_row_has_a_cost_and_an_error_or_a_reason() {
    let rows = rows(QUICK, &Unwatched).unwrap();
    assert!(rows.len() > 100);
    for row in rows {
        assert!(row.cost.is_some_and(|cost| cost.is_finite() && cost > 0.0), "{row:?}");
        assert!(row.error.is_some_and(|error| error.is_finite() && error >= 0.0) || !row.note.is_empty(), "{row:?}");
    }
}
