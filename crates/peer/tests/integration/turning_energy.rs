//! Energy of copies that hold attitudes of each other with an age of at most m ticks. With the damping κ·(m + 1)·h no energy is gained from rotation. With
//! half of the damping, with a torque by the logarithm, or with a mean made a rotation, energy is gained.

use std::array::from_fn;
use std::f64::consts::PI;
use std::time::Duration;

use cohaptic_peer::rotation::{Attitude, HeldAttitudes, RotationStep, Spin, Triple, aligning_torque};
use cohaptic_peer::{Gains, Integrator};
use cohaptic_tests_common::properties;
use proptest::collection::vec;
use proptest::prelude::*;

use crate::cases;
use crate::rotation::{pairs, turned};

const TICK: Duration = Duration::from_millis(1);

/// Torque on a copy by the attitudes that the copy holds.
type Law = fn(&Attitude, &[Attitude], &Triple) -> Triple;
/// Potential of a pair of copies.
type Potential = fn(&Attitude, &Attitude, &Triple) -> f64;

/// Copies with simultaneous ticks.
struct Copies {
    inertia: Vec<Triple>,
    /// KR towards the mean of the other copies [N·m/rad].
    stiffness: Triple,
    damping: f64,
    law: Law,
    potential: Potential,
}

impl Copies {
    /// Returns κ·(m + 1)·h, where κ is the largest entry of KR: N − 1 pairs of KR/(N − 1).
    fn bound(stiffness: &Triple, oldest: usize) -> f64 {
        stiffness.iter().fold(0.0, |most: f64, gain| most.max(*gain)) * (oldest + 1) as f64 * TICK.as_secs_f64()
    }

    fn energy(&self, bodies: &[Attitude]) -> f64 {
        let moving =
            self.inertia.iter().zip(bodies).map(|(j, body)| 0.5 * (0..3).map(|axis| j[axis] * body.rate[axis] * body.rate[axis]).sum::<f64>());
        let pairs = bodies.iter().enumerate().flat_map(|(place, one)| bodies[..place].iter().map(move |other| (one, other)));
        moving.sum::<f64>() + pairs.map(|(one, other)| (self.potential)(one, other, &self.stiffness)).sum::<f64>() / (bodies.len() - 1) as f64
    }

    /// Returns the largest energy divided by the first energy. `age` returns the age of a held attitude \[ticks\].
    fn growth(&self, start: &[Attitude], ticks: usize, mut age: impl FnMut() -> usize) -> f64 {
        let steps: Vec<RotationStep> =
            self.inertia.iter().map(|inertia| Spin { inertia: *inertia, damping: [self.damping; 3] }.step(TICK, Integrator::Exact, 1)).collect();
        let mut past = vec![start.to_vec()];
        let first = self.energy(start);
        let mut most = first;
        for tick in 0..ticks {
            let mut bodies = past[tick].clone();
            for (place, body) in bodies.iter_mut().enumerate() {
                let held: Vec<Attitude> =
                    (0..start.len()).filter(|other| *other != place).map(|other| past[tick.saturating_sub(age())][other]).collect();
                let torque = (self.law)(body, &held, &self.stiffness);
                steps[place].advance(body, torque);
            }
            most = most.max(self.energy(&bodies));
            past.push(bodies);
        }
        most / first
    }
}

/// Returns the torque of the program without BR.
fn chordal(own: &Attitude, held: &[Attitude], stiffness: &Triple) -> Triple {
    let gains = Gains { stiffness: *stiffness, damping: [0.0; 3] };
    aligning_torque((&own.matrix(), own.rate), HeldAttitudes::new(held.iter().copied()).mean(), &gains).map(|component| -component)
}

/// Returns tr P(I − RᵢᵀRⱼ) with P = diag(½ΣKR − KR).
fn chord(one: &Attitude, other: &Attitude, stiffness: &Triple) -> f64 {
    let (one, other, half) = (one.matrix(), other.matrix(), 0.5 * stiffness.iter().sum::<f64>());
    (0..3).map(|axis| (half - stiffness[axis]) * (1.0 - (0..3).map(|row| one[row][axis] * other[row][axis]).sum::<f64>())).sum()
}

/// Returns the rotation vector from one orientation to the other, shorter than half a turn.
fn logarithm(one: &Attitude, other: &Attitude) -> Triple {
    let ([a, b, c, d], [w, x, y, z]) = (one.orientation, other.orientation);
    let (cosine, u) = (a * w + b * x + c * y + d * z, [a * x - b * w - c * z + d * y, a * y - c * w - d * x + b * z, a * z - d * w - b * y + c * x]);
    let sine = libm::sqrt(u.iter().map(|component| component * component).sum());
    let angle = 2.0 * libm::atan2(sine, cosine.abs()) * cosine.signum();
    u.map(|component| if sine == 0.0 { 0.0 } else { component * angle / sine })
}

/// Returns a torque that grows with the angle up to half a turn, for equal entries of KR.
fn by_logarithm(own: &Attitude, held: &[Attitude], stiffness: &Triple) -> Triple {
    let turns: Vec<Triple> = held.iter().map(|other| logarithm(own, other)).collect();
    from_fn(|axis| stiffness[axis] * turns.iter().map(|turn| turn[axis]).sum::<f64>() / held.len() as f64)
}

/// Returns ½·KR·θ².
fn square(one: &Attitude, other: &Attitude, stiffness: &Triple) -> f64 {
    0.5 * logarithm(one, other).iter().zip(stiffness).map(|(angle, gain)| gain * angle * angle).sum::<f64>()
}

/// Returns the torque towards the rotation nearest to the mean of two matrices, whose quaternion is parallel to the sum of the two quaternions.
fn projected(own: &Attitude, held: &[Attitude], stiffness: &Triple) -> Triple {
    let [one, other] = held else { unreachable!("three copies") };
    let sign = one.orientation.iter().zip(&other.orientation).map(|(a, b)| a * b).sum::<f64>().signum();
    let sum: [f64; 4] = from_fn(|place| one.orientation[place] + sign * other.orientation[place]);
    let norm = libm::sqrt(sum.iter().map(|q| q * q).sum());
    chordal(own, &[Attitude { orientation: sum.map(|q| q / norm), ..Attitude::REST }], stiffness)
}

/// Returns the energy growth of two copies of 5·10⁻⁵ kg·m² that hold attitudes 8 ticks old, `apart` about z. The first copy rotates.
fn two(law: Law, potential: Potential, (stiffness, share): (f64, f64), apart: f64, rate: Triple, ticks: usize) -> f64 {
    let damping = share * Copies::bound(&[stiffness; 3], 8);
    let copies = Copies { inertia: vec![[5e-5; 3]; 2], stiffness: [stiffness; 3], damping, law, potential };
    copies.growth(&[Attitude { rate, ..Attitude::REST }, turned([0.0, 0.0, apart])], ticks, || 8)
}

#[test]
fn half_of_the_damping_is_too_little() {
    let growth = |share: f64| two(chordal, chord, (0.02, share), PI / 3.0, [0.1, 0.0, 0.0], 3000);
    assert_eq!(growth(1.0), 1.0);
    assert!((growth(0.5) - 3.4568).abs() < 1e-4, "{}", growth(0.5));
}

#[test]
fn a_torque_by_the_logarithm_gains_energy_at_the_bound() {
    let growth = |law: Law, potential: Potential| two(law, potential, (0.01, 1.0), 178_f64.to_radians(), [20.0, 0.0, 0.0], 700);
    assert_eq!(growth(chordal, chord), 1.0);
    let found = growth(by_logarithm, square);
    assert!((found - 21.9).abs() < 0.05, "{found}");
}

#[test]
fn a_mean_that_is_made_a_rotation_gains_energy_at_the_bound() {
    let start = [[0.0; 3], [0.0, 0.5, 0.0], [-3.0, 0.5, 0.0]].map(turned);
    let growth = |law: Law| {
        let (stiffness, inertia) = ([0.005; 3], vec![[5e-5; 3]; 3]);
        Copies { inertia, stiffness, damping: Copies::bound(&stiffness, 8), law, potential: chord }.growth(&start, 300, || 8)
    };
    assert!(growth(chordal) <= 1.0 + 1e-12);
    assert!((growth(projected) - 1.476).abs() < 1e-3, "{}", growth(projected));
}

/// Returns an inertia and an attitude.
fn copy() -> impl Strategy<Value = (Triple, Attitude)> {
    (pairs(5e-5), [-2.0..2.0, -2.0..2.0, -2.0..2.0], [-20.0..20.0, -20.0..20.0, -20.0..20.0])
        .prop_map(|(inertia, sigma, rate)| (inertia, Attitude { rate, ..turned(sigma) }))
}

properties! {
    #![proptest_config(cases(300))]

    /// Ages are drawn anew up to m ticks, as delay, jitter, loss and reordering would make them.
    #[test]
    fn turning_gains_no_energy(
        copies in vec(copy(), 2..6), gains in pairs(1.0), magnitude in -4.0..-2.0, still in any::<bool>(), oldest in 0_usize..12, seed in any::<u64>(),
    ) {
        let stiffness = gains.map(|gain| gain * libm::exp10(magnitude));
        let (inertia, mut start): (Vec<Triple>, Vec<Attitude>) = copies.into_iter().unzip();
        if still {
            start.iter_mut().for_each(|body| body.rate = [0.0; 3]);
        }
        let copies = Copies { damping: Copies::bound(&stiffness, oldest), inertia, stiffness, law: chordal, potential: chord };
        // The step is exact except for the gyroscopic term: no copy may exceed 0.1 rad per tick with the whole energy.
        let lightest = copies.inertia.iter().flatten().fold(f64::INFINITY, |least: f64, j| least.min(*j));
        prop_assume!(libm::sqrt(2.0 * copies.energy(&start) / lightest) * TICK.as_secs_f64() <= 0.1);
        // Knuth's generator, of which only the upper bits are used.
        let mut state = seed;
        let growth = copies.growth(&start, 300, || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            usize::try_from(state >> 33).unwrap() % (oldest + 1)
        });
        prop_assert!(growth <= 1.0 + 1e-12, "{growth}");
    }
}
