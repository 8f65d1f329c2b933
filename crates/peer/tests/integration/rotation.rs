//! Difficult rotations against closed forms, and torques against their potential.

use std::array::from_fn;
use std::f64::consts::{PI, TAU};
use std::time::Duration;

use cohaptic_peer::rotation::{Attitude, HeldAttitudes, RotationStep, Spin, Triple, aligning_torque, turning_torque};
use cohaptic_peer::{Gains, Integrator};
use cohaptic_tests_common::properties;
use proptest::prelude::*;

use crate::cases;

const FREE: Triple = [0.0; 3];
const TICK: Duration = Duration::from_millis(1);
/// Half a unit in the last place of 1, the greatest error of one rounding.
const U: f64 = 0.5 * f64::EPSILON;

pub(crate) fn turned(sigma: Triple) -> Attitude {
    let mut attitude = Attitude::REST;
    attitude.turn(sigma);
    attitude
}

fn exact(spin: &Spin, span: Duration) -> RotationStep {
    spin.step(span, Integrator::Exact, 1)
}

/// Returns Σ weightᵢ·aᵢ·bᵢ.
fn weighed(weights: &Triple, a: &Triple, b: &Triple) -> f64 {
    (0..3).map(|axis| weights[axis] * a[axis] * b[axis]).sum()
}

fn plus(a: &Triple, factor: f64, b: &Triple) -> Triple {
    from_fn(|axis| a[axis] + factor * b[axis])
}

/// Returns q·p.
fn product([a, b, c, d]: &[f64; 4], [w, x, y, z]: &[f64; 4]) -> [f64; 4] {
    [a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y, a * y + c * w + d * x - b * z, a * z + d * w + b * y - c * x]
}

fn world_momentum(inertia: &Triple, body: &Attitude) -> Triple {
    let matrix = body.matrix();
    from_fn(|row| (0..3).map(|axis| matrix[row][axis] * inertia[axis] * body.rate[axis]).sum())
}

/// Returns γ(ω) of a free top.
fn gyrate([a, b, c]: &Triple, [x, y, z]: &Triple) -> Triple {
    [(b - c) / a * y * z, (c - a) / b * z * x, (a - b) / c * x * y]
}

/// Returns the change of the quadratic invariant Σ weight·ω² in one step of RK4, which the step equals for a free top: −h²·Σ mᵢⱼ·kᵢ·kⱼ with mᵢⱼ = bᵢaᵢⱼ +
/// bⱼaⱼᵢ − bᵢbⱼ (Cooper 1987). With p = k2 − k1, q = k3 − k2 and r = k4 − k1 − 2p the sum is p·q/3 − q·q/9 + 2q·r/9 − r·r/36.
fn defect(inertia: &Triple, weights: &Triple, rate: &Triple, h: f64) -> f64 {
    let k1 = gyrate(inertia, rate);
    let k2 = gyrate(inertia, &plus(rate, 0.5 * h, &k1));
    let k3 = gyrate(inertia, &plus(rate, 0.5 * h, &k2));
    let k4 = gyrate(inertia, &plus(rate, h, &k3));
    let (p, q) = (plus(&k2, -1.0, &k1), plus(&k3, -1.0, &k2));
    let r = plus(&plus(&k4, -1.0, &k1), -2.0, &p);
    let of = |a: &Triple, b: &Triple| weighed(weights, a, b);
    -h * h * (of(&p, &q) / 3.0 - of(&q, &q) / 9.0 + 2.0 / 9.0 * of(&q, &r) - of(&r, &r) / 36.0)
}

/// Near its unstable axis a top flips every 2K/λ. After an hour the errors of energy and momentum equal the defect of the method, except for roundings.
#[test]
fn a_top_turns_over_for_an_hour() {
    let (inertia, start) = ([3e-5, 5e-5, 9e-5], Attitude { rate: [0.02, 12.0, 0.02], ..Attitude::REST });
    let squares = inertia.map(|j| j * j);
    let first = [inertia, squares].map(|weights| weighed(&weights, &start.rate, &start.rate));
    let momentum = world_momentum(&inertia, &start);
    // Landau & Lifshitz, Mechanics, § 37: L² − 2E·J1, L² − 2E·J2, λ and K.
    let [below, between] = [0, 1].map(|axis| first[1] - first[0] * inertia[axis]);
    let pace = libm::sqrt((inertia[2] - inertia[1]) * below / (inertia[0] * inertia[1] * inertia[2]));
    let (mut a, mut b) = (1.0, libm::sqrt((inertia[2] - inertia[0]) * between / ((inertia[2] - inertia[1]) * below)));
    for _ in 0..10 {
        (a, b) = (0.5 * (a + b), libm::sqrt(a * b));
    }
    let period = PI / a / pace;
    let mut turned = Vec::new();
    for millis in [1, 4] {
        let (span, steps) = (Duration::from_millis(millis), 3_600_000 / u32::try_from(millis).unwrap());
        let (h, step) = (span.as_secs_f64(), exact(&Spin { inertia, damping: FREE }, span));
        // A step has some ten roundings.
        let rounding = 10.0 * U * f64::from(steps);
        let (mut body, mut lost, mut flips) = (start, [0.0; 2], Vec::new());
        for done in 0..steps {
            lost[0] += defect(&inertia, &inertia, &body.rate, h) / first[0];
            lost[1] += defect(&inertia, &squares, &body.rate, h) / first[1];
            let before = body.rate[1];
            step.advance(&mut body, FREE);
            if (before < 0.0) != (body.rate[1] < 0.0) {
                flips.push(h * (f64::from(done) + before / (before - body.rate[1])));
            }
        }
        for (place, weights) in [inertia, squares].iter().enumerate() {
            let found = weighed(weights, &body.rate, &body.rate) / first[place] - 1.0;
            assert!((found - lost[place]).abs() < rounding, "{millis} ms: {found:e} is not {:e}", lost[place]);
        }
        // The rotation of a step leaves out terms of h⁵: products of five rates, or of their derivatives, with coefficients below 1/240.
        let apart = plus(&world_momentum(&inertia, &body), -1.0, &momentum);
        let apart = libm::sqrt(weighed(&[1.0; 3], &apart, &apart) / first[1]);
        assert!(apart < f64::from(steps) * libm::pow(h * 13.0, 5.0) / 240.0 + rounding, "{millis} ms: {apart:e}");
        turned.push(apart);
        // 2K is the logarithm of 16/(1 − m), except for 10⁻⁴. A period therefore moves by 1/λ per relative change of L² − 2E·J2, and by the relative change
        // of λ.
        let moved = ((lost[1] - lost[0]).abs() + 2.0 * rounding) * first[1] / between / pace + lost[0].abs() * (period + 1.0 / pace);
        assert!((flips.len() as f64 - 3600.0 / period).abs() <= 1.0 + 3600.0 / period * moved / period, "{} flips", flips.len());
        for pair in flips.windows(2) {
            assert!((pair[1] - pair[0] - period).abs() < moved + 1e-6, "{millis} ms: {} s, not {period} s", pair[1] - pair[0]);
        }
    }
    // A flip and the flip back are alike, so errors of h⁴ average out over a flip, and the accumulated error falls with h⁵.
    assert!((turned[1] / turned[0] / 1024.0 - 1.0).abs() < 0.1, "{turned:?}");
}

/// The body is a needle whose inertia about its axis is a billionth of the inertia across: R = Exp(t·Jω/J2)·Exp(t(1 − J1/J2)·ω1·e1).
#[test]
fn inertias_nine_orders_apart_do_no_harm() {
    let rate = [20.0, 3.0, -1.0];
    let step = exact(&Spin { inertia: [1e-9, 1.0, 1.0], damping: FREE }, Duration::from_micros(100));
    let mut body = Attitude { rate, ..Attitude::REST };
    for _ in 0..10_000 {
        step.advance(&mut body, FREE);
    }
    let mut expected = turned([1e-9 * rate[0], rate[1], rate[2]]);
    expected.turn([(1.0 - 1e-9) * rate[0], 0.0, 0.0]);
    // Each step errs by (h·ω)⁵/120 of a rotation, and by some ten roundings.
    let bound = 1e4 * (libm::pow(1e-4 * 20.3, 5.0) / 120.0 + 10.0 * U);
    assert!(body.angle_to(&expected.orientation) < bound, "{:e}, bound {bound:e}", body.angle_to(&expected.orientation));
    // With 2³⁰ times the inertia, the damping and the torque, all numbers are equal to the bit.
    let run = |scale: f64| {
        let step = exact(&Spin { inertia: [3e-5, 5e-5, 7e-5].map(|j| j * scale), damping: [1e-4 * scale; 3] }, TICK);
        let mut body = Attitude { rate, ..Attitude::REST };
        for _ in 0..1000 {
            step.advance(&mut body, [1e-3 * scale, -2e-3 * scale, 1.5e-3 * scale]);
        }
        body
    };
    let scale = f64::from(1_u32 << 30);
    assert_eq!(run(1.0), run(scale));
}

/// Half a radian per step is a number without rounding. Each step errs by one unit of sine and cosine, and by six roundings of a product of quaternions. An
/// angle has twice the error of its quaternion.
#[test]
fn a_million_radians_about_one_axis_are_counted() {
    let steps = 2_000_000;
    for axis in 0..3 {
        let step = exact(&Spin { inertia: [1e-4, 2e-4, 2.5e-4], damping: FREE }, Duration::from_nanos(1_953_125));
        let mut body = Attitude { rate: from_fn(|of| if of == axis { 256.0 } else { 0.0 }), ..Attitude::REST };
        for _ in 0..steps {
            step.advance(&mut body, FREE);
        }
        let (sine, cosine) = libm::sincos(0.5e6);
        let mut expected = [cosine, 0.0, 0.0, 0.0];
        expected[1 + axis] = sine;
        let apart = body.angle_to(&expected);
        assert!(apart < 2.0 * 8.0 * U * f64::from(steps), "{apart:e}");
    }
}

/// The top turns 100 times per second about the stiffest axis, six tenths of a radian per tick. The wobble follows an ellipse with the ratio of the
/// amplitudes a1 and a2, and RK4 at 0.8 rad per step lets the wobble fall, not rise.
#[test]
fn a_fast_top_stays_upright() {
    let inertia = [3e-5, 5e-5, 9e-5];
    let step = exact(&Spin { inertia, damping: FREE }, TICK);
    let mut body = Attitude { rate: [0.02, 0.02, 100.0 * TAU], ..Attitude::REST };
    let wobble = |body: &Attitude| {
        // J1(J3 − J1)·ω1² + J2(J3 − J2)·ω2² is constant.
        libm::sqrt(inertia[0] * 6e-5 * body.rate[0] * body.rate[0] + inertia[1] * 4e-5 * body.rate[1] * body.rate[1])
    };
    let mut before = wobble(&body);
    for _ in 0..60_000 {
        step.advance(&mut body, FREE);
        let now = wobble(&body);
        assert!(now <= before * (1.0 + 1e-12) + 1e-15, "{now:e} after {before:e}");
        before = now;
    }
    assert!(body.is_finite() && body.is_unit() && (body.rate[2] / (100.0 * TAU) - 1.0).abs() < 1e-6, "{body:?}");
}

fn stiff(stiffness: Triple) -> Gains<Triple> {
    Gains { stiffness, damping: FREE }
}

fn torque(own: &Attitude, others: &[Attitude], gains: &Gains<Triple>) -> Triple {
    aligning_torque((&own.matrix(), own.rate), HeldAttitudes::new(others.iter().copied()).mean(), gains)
}

/// The torque is the sine of the angle about any axis, independent of the signs of quaternions, and zero at half a turn.
#[test]
fn with_equal_gains_the_torque_is_a_sine_through_half_a_turn() {
    for axis in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.6, 0.0, -0.8], [2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0]] {
        for angle in [0.0, 1e-9, 0.3, 1.5, 3.0, PI - 1e-9, PI, PI + 1e-9, 4.0, TAU] {
            let other = turned(axis.map(|component| component * angle));
            // The torque acts on the copy with the opposite sign, towards the other copy.
            let acting = torque(&Attitude::REST, &[other], &stiff([0.5; 3])).map(|component| -component);
            let device = turning_torque((&Attitude::REST.matrix(), FREE), (&other.matrix(), FREE), &Gains { stiffness: 0.5, damping: 0.0 });
            for of in 0..3 {
                // Entries of a matrix err by some ten roundings of numbers up to 1.
                assert!((acting[of] - 0.5 * libm::sin(angle) * axis[of]).abs() < 10.0 * U, "{axis:?}, {angle}: {acting:?}");
                assert!((device[of] - 0.5 * libm::sin(angle) * axis[of]).abs() < 10.0 * U, "{axis:?}, {angle}: {device:?}");
            }
        }
    }
}

/// A copy at half a turn stays at rest, or leaves as slowly as roundings allow: the angle grows by e^(t·√(KR/J)) from 10⁻¹⁵.
#[test]
fn half_a_turn_apart_nothing_jumps() {
    let (spin, far) = (Spin { inertia: [5e-5; 3], damping: FREE }, turned([0.0, PI, 0.0]));
    let (step, mut body) = (exact(&spin, TICK), Attitude::REST);
    for tick in 0..1000 {
        let acting = torque(&body, &[far], &stiff([0.01; 3])).map(|component| -component);
        step.advance(&mut body, acting);
        let bound = 1e-14 * libm::exp(f64::from(tick + 1) * 1e-3 * libm::sqrt(0.01 / 5e-5));
        assert!(body.is_finite() && body.angle_to(&Attitude::REST.orientation) <= bound, "tick {tick}: {body:?}");
    }
}

fn attitude() -> impl Strategy<Value = Attitude> {
    ([-1.0..1.0, -1.0..1.0, -1.0..1.0, -1.0..1.0], [-20.0..20.0, -20.0..20.0, -20.0..20.0])
        .prop_filter("a direction", |(q, _)| q.iter().map(|q| q * q).sum::<f64>() > 0.01)
        .prop_map(|(q, rate)| {
            let norm = libm::sqrt(q.iter().map(|q| q * q).sum());
            Attitude { orientation: q.map(|q| q / norm), rate }
        })
}

/// Returns three numbers, each at most the sum of the two other numbers, made as sums of pairs.
pub(crate) fn pairs(scale: f64) -> impl Strategy<Value = Triple> {
    [0.1..1.0, 0.1..1.0, 0.1..1.0].prop_map(move |[a, b, c]| [b + c, c + a, a + b].map(|sum| scale * sum))
}

properties! {
    #![proptest_config(cases(200))]

    /// The potential is the mean of tr P(I − RᵢᵀRⱼ) over the other copies, differentiated by rotations of the copy about its axes.
    #[test]
    fn the_torque_is_the_gradient_of_the_potential(own in attitude(), others in [attitude(), attitude(), attitude()], gains in pairs(1.0)) {
        let sum = 0.5 * (gains[0] + gains[1] + gains[2]);
        let potential = |own: &Attitude| -> f64 {
            let mine = own.matrix();
            let of = |other: &Attitude| -> f64 {
                let theirs = other.matrix();
                (0..3).map(|axis| (sum - gains[axis]) * (1.0 - (0..3).map(|row| mine[row][axis] * theirs[row][axis]).sum::<f64>())).sum()
            };
            others.iter().map(of).sum::<f64>() / 3.0
        };
        let found = torque(&own, &others, &stiff(gains));
        for (axis, found) in found.into_iter().enumerate() {
            let at = |angle: f64| {
                let mut own = own;
                own.turn(from_fn(|of| if of == axis { angle } else { 0.0 }));
                potential(&own)
            };
            let slope = (at(1e-4) - at(-1e-4)) / 2e-4;
            // The central difference errs by a sixth of the third derivative, at most ΣKR ≤ 6 N·m, times 10⁻⁸. Rounding adds ten roundings of a potential up
            // to 12 N·m, divided by 2·10⁻⁴.
            prop_assert!((found - slope).abs() < 1e-8 + 10.0 * 12.0 * U / 2e-4, "axis {axis}: {found} is not {slope}");
        }
    }

    /// No direction of the world is special, and neither is the sign of a quaternion or the name of a body axis.
    #[test]
    fn the_world_may_be_turned_and_the_axes_renamed(
        bodies in [attitude(), attitude()], by in attitude(), inertia in pairs(1e-4), gains in pairs(1e-2), loss in 0.0..1e-3,
    ) {
        let spin = Spin { inertia, damping: [loss, 0.5 * loss, 2.0 * loss] };
        let gains = Gains { stiffness: gains, damping: [1e-4, 2e-4, 3e-4] };
        let run = |mut bodies: [Attitude; 2], spin: &Spin, gains: &Gains<Triple>| {
            let step = exact(spin, TICK);
            for _ in 0..50 {
                let acting = [0, 1].map(|own| torque(&bodies[own], &[bodies[1 - own]], gains).map(|component| -component));
                bodies.iter_mut().zip(acting).for_each(|(body, torque)| step.advance(body, torque));
            }
            bodies
        };
        let plain = run(bodies, &spin, &gains);
        let elsewhere = run(bodies.map(|body| Attitude { orientation: product(&by.orientation, &body.orientation), ..body }), &spin, &gains);
        let negated = run(bodies.map(|body| Attitude { orientation: body.orientation.map(|q| -q), ..body }), &spin, &gains);
        // The axes y, z and x become the first, second and third axis: bodies turn by a third of a turn about (1, 1, 1) first.
        let renamed = |triple: Triple| [triple[1], triple[2], triple[0]];
        let third = [0.5; 4];
        let name = |body: Attitude| Attitude { orientation: product(&body.orientation, &third), rate: renamed(body.rate) };
        let other_spin = Spin { inertia: renamed(spin.inertia), damping: renamed(spin.damping) };
        let other = run(bodies.map(name), &other_spin, &gains.map(|gain| renamed(*gain)));
        for peer in 0..2 {
            let by_q = product(&by.orientation, &plain[peer].orientation);
            prop_assert!(elsewhere[peer].angle_to(&by_q) < 1e-12);
            prop_assert_eq!(negated[peer].orientation.map(|q| -q), plain[peer].orientation);
            prop_assert_eq!(negated[peer].matrix(), plain[peer].matrix());
            prop_assert!(other[peer].angle_to(&name(plain[peer]).orientation) < 1e-12);
            for axis in 0..3 {
                prop_assert!((elsewhere[peer].rate[axis] - plain[peer].rate[axis]).abs() < 1e-12 * 40.0);
                prop_assert!((other[peer].rate[axis] - renamed(plain[peer].rate)[axis]).abs() < 1e-12 * 40.0);
            }
        }
    }

    /// Four steps in a tick equal four steps of a quarter tick, except for the rounding of their length.
    #[test]
    fn steps_of_a_tick_are_shorter_steps(body in attitude(), inertia in pairs(1e-4), loss in 0.0..1e-3, torque in [-1e-3..1e-3, -1e-3..1e-3, -1e-3..1e-3]) {
        let spin = Spin { inertia, damping: [loss; 3] };
        for integrator in [Integrator::Exact, Integrator::RungeKutta4 { steps: 1 }, Integrator::SemiImplicitEuler { steps: 1 }] {
            let (mut at_once, mut by_quarters) = (body, body);
            spin.step(TICK, integrator, 4).advance(&mut at_once, torque);
            let quarter = spin.step(TICK / 4, integrator, 1);
            (0..4).for_each(|_| quarter.advance(&mut by_quarters, torque));
            prop_assert!(at_once.angle_to(&by_quarters.orientation) < 1e-15);
            prop_assert!((0..3).all(|axis| (at_once.rate[axis] - by_quarters.rate[axis]).abs() < 1e-14 * 40.0));
        }
    }
}
