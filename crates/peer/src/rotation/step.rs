//! Rotation between ticks, under a torque held in body axes: J·ω̇ + ω×Jω = τ − b∘ω, Ṙ = R·\[ω\].
//!
//! The damped motion without the gyroscopic term is exact. The gyroscopic term enters by a method of fourth order (Cox & Matthews 2002, ETDRK4), and the
//! orientation turns by a rotation vector of fourth order (Magnus). The linear part is the step map of one axis with mass J and damping b.

use core::array::from_fn;
use core::time::Duration;

use super::algebra::{add, by_component, cross, scale, subtract};
use super::{Attitude, Real, Triple};
use crate::{Integrator, Number};

/// Inertia and damping of a rotating body.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Spin {
    /// Principal moments of inertia J [kg·m²], each above zero.
    pub inertia: Triple,
    /// Viscous damping b towards ground about each axis [N·m·s/rad].
    pub damping: Triple,
}

/// Method that computes the rotation of a step.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum RotationMethod {
    /// Exact except for the gyroscopic term, which has order four.
    #[default]
    Exponential,
    /// Explicit Euler on quaternion and angular velocity. First order.
    Euler,
    /// The classical Runge–Kutta method on quaternion and angular velocity. Fourth order; unstable where h·b/J is above 2.8.
    RungeKutta4,
}

/// Step of one body over a span.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RotationStep<C = f64> {
    method: RotationMethod,
    /// Number of equal steps in the span.
    steps: u32,
    /// Length of one of the equal steps \[s\].
    h: C,
    /// (Jy − Jz)/Jx and its cyclic permutations: γ(ω) = gyration∘(ωy·ωz, ωz·ωx, ωx·ωy).
    gyration: Triple<C>,
    /// Inverse of each principal moment of inertia, 1/J [1/(kg·m²)].
    mobility: Triple<C>,
    /// Rate b/J at which the rotational damping slows a free turn about each axis [1/s].
    decay: Triple<C>,
    /// e = φ0 and g = h·φ1 over the step.
    whole: [Triple<C>; 2],
    /// e and g over half of the step.
    half: [Triple<C>; 2],
    /// Weights A = h·(2φ2 − 4φ3), B = h·(4φ3 − φ2), C = h²·(2φ3 − 4φ4), D = h²·(4φ4 − φ3), and h²·φ2.
    weights: [Triple<C>; 5],
}

/// Returns φn = Σ (−x)ᵏ/(k + n)! for n = 0 to 4 and x ≥ 0.
fn phis(x: f64) -> [f64; 5] {
    const FACTORIALS: [f64; 4] = [1.0, 1.0, 2.0, 6.0];
    let mut phis = [0.0; 5];
    if x < 2.0 {
        // The last term is below 2^26/30! = 3e-25.
        for (n, phi) in (0_u32..).zip(&mut phis) {
            let sum = (1..=26_u32).rev().fold(1.0, |sum, k| 1.0 - x * sum / f64::from(k + n));
            *phi = sum / [1.0, 1.0, 2.0, 6.0, 24.0][n as usize];
        }
    } else {
        // φ(n+1) = (1/n! − φn)/x loses no digits for x ≥ 2; for small x it cancels, hence the series above.
        phis[0] = libm::exp(-x);
        for n in 0..4 {
            phis[n + 1] = (1.0 / FACTORIALS[n] - phis[n]) / x;
        }
    }
    phis
}

impl Spin {
    /// Returns the step over `span`. `steps`, the number of steps for rotations, multiplies the steps of the integrator.
    #[must_use]
    pub fn step(&self, span: Duration, integrator: Integrator, steps: u32) -> RotationStep {
        let (method, within) = match integrator {
            Integrator::Exact => (RotationMethod::Exponential, 1),
            Integrator::SemiImplicitEuler { steps } => (RotationMethod::Euler, steps),
            Integrator::RungeKutta4 { steps } => (RotationMethod::RungeKutta4, steps),
        };
        // Euler and Runge–Kutta divide each of the rotation's steps again, as they do for translations.
        let steps = steps.saturating_mul(within);
        let (h, j) = (span.as_secs_f64() / f64::from(steps), self.inertia);
        // φ functions of the whole and of the half step, per axis, as ETDRK4 needs them.
        let decay: Triple = from_fn(|axis| self.damping[axis] / j[axis]);
        let over = |h: f64| decay.map(|decay| phis(h * decay));
        let (whole, half) = (over(h), over(0.5 * h));
        let of = |weight: &dyn Fn(&[f64; 5]) -> f64| from_fn(|axis| weight(&whole[axis]));
        RotationStep {
            method,
            steps,
            h,
            gyration: [(j[1] - j[2]) / j[0], (j[2] - j[0]) / j[1], (j[0] - j[1]) / j[2]],
            mobility: j.map(|j| 1.0 / j),
            decay,
            whole: [of(&|phi| phi[0]), of(&|phi| h * phi[1])],
            half: [half.map(|phi| phi[0]), half.map(|phi| 0.5 * h * phi[1])],
            weights: [
                of(&|phi| h * (2.0 * phi[2] - 4.0 * phi[3])),
                of(&|phi| h * (4.0 * phi[3] - phi[2])),
                of(&|phi| h * h * (2.0 * phi[3] - 4.0 * phi[4])),
                of(&|phi| h * h * (4.0 * phi[4] - phi[3])),
                of(&|phi| h * h * phi[2]),
            ],
        }
    }
}

impl<N: Real> RotationStep<N> {
    /// Turns a body over the span under a torque held in body axes \[N·m\].
    #[inline(always)]
    pub fn advance(&self, body: &mut Attitude<N>, torque: Triple<N>) {
        self.travel(body, torque);
    }

    /// Like [`RotationStep::advance`], and returns the integral of the angular velocity in body axes over the span \[rad\]. Its scalar product with the
    /// torque is the work of the torque.
    #[inline(always)]
    pub(crate) fn travel(&self, body: &mut Attitude<N>, torque: Triple<N>) -> Triple<N> {
        let forced = self.forced(torque);
        let mut travel = [N::of(0.0); 3];
        for _ in 0..self.steps {
            let more = match self.method {
                RotationMethod::Exponential => {
                    let before = body.rate;
                    let (rate, sigma) = self.exponential(before, forced);
                    body.rate = rate;
                    body.turn(sigma);
                    // σ without the Magnus term is the integral of the angular velocity.
                    subtract(sigma, self.magnus(before, rate))
                }
                RotationMethod::Euler => self.euler(body, forced),
                RotationMethod::RungeKutta4 => self.runge_kutta(body, forced),
            };
            travel = add(travel, more);
        }
        travel
    }

    /// Returns the angular acceleration by a torque, τ/J [rad/s²].
    #[must_use]
    #[inline(always)]
    fn forced(&self, torque: Triple<N>) -> Triple<N> {
        by_component(torque, self.mobility)
    }

    /// Returns γ(ω), the angular acceleration by the gyroscopic term [rad/s²].
    #[inline(always)]
    fn gyrate(&self, rate: Triple<N>) -> Triple<N> {
        by_component(self.gyration, [rate[1] * rate[2], rate[2] * rate[0], rate[0] * rate[1]])
    }

    /// Returns the Magnus term h²/12·ω×ω⁺ \[rad\]: the difference between the rotation vector about a moving axis and the integral of the angular velocity.
    #[inline(always)]
    fn magnus(&self, before: Triple<N>, after: Triple<N>) -> Triple<N> {
        scale(cross(before, after), self.h * self.h * N::of(1.0 / 12.0))
    }

    /// Returns the result of one equal step by [`RotationMethod::Exponential`]: the angular velocity after the step, and the rotation vector σ of the step,
    /// in body axes. `forced` is the result of [`RotationStep::forced`].
    #[must_use]
    #[inline(always)]
    fn exponential(&self, rate: Triple<N>, forced: Triple<N>) -> (Triple<N>, Triple<N>) {
        let [e, g] = self.whole;
        let [e_half, g_half] = self.half;
        let [a, b, c, d, drift] = self.weights;
        // Four stages of ETDRK4. `second` to `fourth` are differences from the first gyroscopic term, which `push` contains already.
        let first = self.gyrate(rate);
        let push = add(forced, first);
        let decayed = by_component(e_half, rate);
        let pushed = by_component(g_half, push);
        let second = subtract(self.gyrate(add(decayed, pushed)), first);
        let third = subtract(self.gyrate(add(add(decayed, pushed), by_component(g_half, second))), first);
        let free = add(by_component(e, rate), by_component(g, push));
        let fourth = subtract(self.gyrate(add(free, scale(by_component(g_half, third), N::of(2.0)))), first);
        let middle = add(second, third);
        let after = add(free, add(by_component(a, middle), by_component(b, fourth)));
        let magnus = self.magnus(rate, after);
        // The integral of the angular velocity has the same stages with the weights C and D, one order of h higher.
        let free = add(by_component(g, rate), by_component(drift, push));
        let sigma = add(free, add(add(by_component(c, middle), by_component(d, fourth)), magnus));
        (after, sigma)
    }

    /// Returns ω̇ of the equation of motion [rad/s²].
    #[inline(always)]
    fn acceleration(&self, rate: Triple<N>, forced: Triple<N>) -> Triple<N> {
        subtract(add(forced, self.gyrate(rate)), by_component(self.decay, rate))
    }

    /// Makes one explicit Euler step, and returns the integral of the angular velocity \[rad\].
    #[inline(always)]
    fn euler(&self, body: &mut Attitude<N>, forced: Triple<N>) -> Triple<N> {
        let travel = scale(body.rate, self.h);
        // Both slopes before either is applied: explicit Euler uses the state at the beginning of the step.
        let (turning, rising) = (spun(&body.orientation, body.rate), self.acceleration(body.rate, forced));
        body.orientation = moved(&body.orientation, &turning, self.h);
        body.rate = add(body.rate, scale(rising, self.h));
        body.renormalise();
        travel
    }

    /// Makes one Runge–Kutta step, and returns the integral of the angular velocity \[rad\].
    #[inline(always)]
    fn runge_kutta(&self, body: &mut Attitude<N>, forced: Triple<N>) -> Triple<N> {
        let Attitude { orientation: q, rate } = *body;
        let half = self.h * N::of(0.5);
        let slope = |q: &[N; 4], rate: Triple<N>| (spun(q, rate), self.acceleration(rate, forced));
        let (q1, w1) = slope(&q, rate);
        let second = add(rate, scale(w1, half));
        let (q2, w2) = slope(&moved(&q, &q1, half), second);
        let third = add(rate, scale(w2, half));
        let (q3, w3) = slope(&moved(&q, &q2, half), third);
        let fourth = add(rate, scale(w3, self.h));
        let (q4, w4) = slope(&moved(&q, &q3, self.h), fourth);
        // Classical weights 1, 2, 2, 1 over six.
        let sixth = self.h * N::of(1.0 / 6.0);
        let two = N::of(2.0);
        body.orientation = from_fn(|i| q[i] + sixth * (q1[i] + two * (q2[i] + q3[i]) + q4[i]));
        body.rate = from_fn(|i| rate[i] + sixth * (w1[i] + two * (w2[i] + w3[i]) + w4[i]));
        body.renormalise();
        from_fn(|i| sixth * (rate[i] + two * (second[i] + third[i]) + fourth[i]))
    }
}

impl<N: Real> Attitude<N> {
    /// Restores the quaternion's norm of 1, to first order.
    #[inline(always)]
    fn renormalise(&mut self) {
        self.turn([N::of(0.0); 3]);
    }
}

/// Returns q̇ = ½·q·(0, ω).
#[inline(always)]
fn spun<N: Number>([w, x, y, z]: &[N; 4], rate: Triple<N>) -> [N; 4] {
    let (w, u, half) = (*w, [*x, *y, *z], N::of(0.5));
    let turned = cross(u, rate);
    let along = u[0] * rate[0] + u[1] * rate[1] + u[2] * rate[2];
    [-(half * along), half * (w * rate[0] + turned[0]), half * (w * rate[1] + turned[1]), half * (w * rate[2] + turned[2])]
}

/// Returns q + span·slope.
#[inline(always)]
fn moved<N: Number>(q: &[N; 4], slope: &[N; 4], span: N) -> [N; 4] {
    from_fn(|i| q[i] + span * slope[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    const FREE: Triple = [0.0; 3];

    fn run(spin: Spin, start: Attitude, torque: Triple, h: Duration, steps: u32, integrator: Integrator) -> Attitude {
        let step = spin.step(h, integrator, 1);
        (0..steps).fold(start, |mut body, _| {
            step.advance(&mut body, torque);
            body
        })
    }

    fn exact(spin: Spin, start: Attitude, torque: Triple, h: Duration, steps: u32) -> Attitude {
        run(spin, start, torque, h, steps, Integrator::Exact)
    }

    /// The reference is the closed form by elliptic functions, to twelve digits.
    #[test]
    fn a_free_top_turns_as_the_closed_form_says() {
        let spin = Spin { inertia: [3.0, 5.0, 9.0], damping: FREE };
        let end = exact(spin, Attitude { rate: [1.0, 2.0, -3.0], ..Attitude::REST }, FREE, Duration::from_micros(100), 20_000);
        let q = [0.929_554_241_943, 0.268_068_584_514, 0.090_362_592_172, -0.236_437_618_026];
        let rate = [2.220_953_964_224, -0.678_695_174_521, -3.107_320_295_453];
        let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // q and −q are the same orientation, so the sign of w is fixed for the comparison.
        let sign = end.orientation[0].signum();
        assert!(apart(&end.orientation.map(|q| sign * q), &q) < 2e-12, "{:?}", end.orientation);
        assert!(apart(&end.rate, &rate) < 2e-12, "{:?}", end.rate);
    }

    /// With J₁ = J₂ the solution is R = Exp(t·Jω/J₁)·Exp(t(1 − J₃/J₁)·ω₃·e₃).
    #[test]
    fn a_symmetric_top_precesses() {
        let (spin, rate) = (Spin { inertia: [2.0, 2.0, 0.5], damping: FREE }, [0.7, -0.3, 5.0]);
        let end = exact(spin, Attitude { rate, ..Attitude::REST }, FREE, Duration::from_millis(1), 3000);
        let mut expected = Attitude::REST;
        expected.turn([3.0 * rate[0], 3.0 * rate[1], 3.0 * 0.25 * rate[2]]);
        expected.turn([0.0, 0.0, 3.0 * 0.75 * rate[2]]);
        assert!(end.angle_to(&expected.orientation) < 1e-10, "{}", end.angle_to(&expected.orientation));
    }

    /// The angle errors are 1.10e-7, 6.74e-9 and 4.18e-10 rad at 4, 2 and 1 ms, against steps of 31.25 µs.
    #[test]
    fn the_order_is_four() {
        let spin = Spin { inertia: [3e-5, 5e-5, 9e-5], damping: FREE };
        let start = Attitude { rate: [3.0, -4.0, 6.0], ..Attitude::REST };
        let at = |nanos: u64, integrator| {
            let steps = u32::try_from(1_000_000_000 / nanos).unwrap();
            run(spin, start, [2e-4, -3e-4, 4e-4], Duration::from_nanos(nanos), steps, integrator)
        };
        // At a 32nd of the step a method of fourth order errs a million times less.
        let reference = at(31_250, Integrator::Exact);
        for (nanos, error) in [(4_000_000, 1.10e-7), (2_000_000, 6.74e-9), (1_000_000, 4.18e-10)] {
            let found = at(nanos, Integrator::Exact).angle_to(&reference.orientation);
            assert!((found / error - 1.0).abs() < 0.02, "{nanos} ns: {found:e}");
        }
        let found = [2_000_000, 1_000_000].map(|nanos| at(nanos, Integrator::RungeKutta4 { steps: 1 }).angle_to(&reference.orientation));
        assert!((libm::log2(found[0] / found[1]) - 4.0).abs() < 0.2, "{found:?}");
        let found = [100_000, 50_000].map(|nanos| at(nanos, Integrator::SemiImplicitEuler { steps: 1 }).angle_to(&reference.orientation));
        assert!((libm::log2(found[0] / found[1]) - 1.0).abs() < 0.1, "{found:?}");
    }

    /// Without damping the kinetic energy changes by the work of the torque: with fourth order, and exactly for a rotation about one axis.
    #[test]
    fn the_work_of_a_torque_is_what_the_energy_changes_by() {
        let spin = Spin { inertia: [3e-5, 5e-5, 9e-5], damping: FREE };
        let torque = [2e-4, -3e-4, 4e-4];
        let missed = |rate: Triple, torque: Triple, micros: u32, integrator| {
            let step = spin.step(Duration::from_micros(micros.into()), integrator, 1);
            let mut body = Attitude { rate, ..Attitude::REST };
            let energy = |body: &Attitude| (0..3).map(|axis| 0.5 * spin.inertia[axis] * body.rate[axis] * body.rate[axis]).sum::<f64>();
            let (before, mut work) = (energy(&body), 0.0);
            for _ in 0..200_000 / micros {
                work += crate::rotation::algebra::dot(step.travel(&mut body, torque), torque);
            }
            (energy(&body) - before - work).abs() / energy(&body)
        };
        for integrator in [Integrator::Exact, Integrator::RungeKutta4 { steps: 1 }] {
            let found = [2000, 1000].map(|micros| missed([3.0, -4.0, 6.0], torque, micros, integrator));
            assert!(found[1] < 1e-9 && (libm::log2(found[0] / found[1]) - 4.0).abs() < 0.5, "{found:?}");
            // The sum of 200 steps has some hundred roundings.
            assert!(missed([0.0, 2.0, 0.0], [0.0, 1e-3, 0.0], 1000, integrator) < 1e-13);
        }
        // Euler has first order: each step misses ½h²·J⁻¹τ·τ.
        let (euler, tau) = (missed([0.0; 3], [0.0, 1e-3, 0.0], 1000, Integrator::SemiImplicitEuler { steps: 1 }), 1e-3);
        let (rate, steps) = (0.2 * tau / 5e-5, 200.0);
        assert!((euler / (steps * 0.5e-6 * tau * tau / 5e-5 / (0.5 * 5e-5 * rate * rate)) - 1.0).abs() < 1e-9, "{euler}");
    }

    /// About one axis there is no gyroscopic term, and the step equals the step of a damped mass, at any damping.
    #[test]
    fn about_one_axis_it_is_the_map_of_a_translation() {
        for damping in [0.0, 1e-6, 1e-3, 0.1, 10.0] {
            let spin = Spin { inertia: [2e-4, 1e-4, 3e-4], damping: [damping; 3] };
            let map = crate::Plant { mass: 1e-4, damping, stiffness: 0.0 }.step(Duration::from_millis(1), Integrator::Exact);
            let mut body = crate::Motion { position: 0.0, velocity: 0.7 };
            map.advance(&mut body, 0.02);
            let end = exact(spin, Attitude { rate: [0.0, 0.7, 0.0], ..Attitude::REST }, [0.0, 0.02, 0.0], Duration::from_millis(1), 1);
            assert!((end.rate[1] - body.velocity).abs() <= 1e-13 * body.velocity.abs().max(1.0), "{damping}");
            assert!((2.0 * libm::atan2(end.orientation[2], end.orientation[0]) - body.position).abs() <= 1e-15, "{damping}");
        }
    }

    #[test]
    fn the_series_and_the_recursion_are_one_function() {
        for n in 0..5_u32 {
            let [below, above] = [2.0 - 1e-9, 2.0].map(|x| phis(x)[n as usize]);
            assert!((below - above).abs() < 1e-9, "φ{n}: {below} {above}");
        }
        assert_eq!(phis(0.0), [1.0, 1.0, 0.5, 1.0 / 6.0, 1.0 / 24.0]);
        assert!((phis(1e5)[4] - 1.0 / 6e5).abs() < 1e-10);
    }

    #[test]
    fn a_quaternion_stays_a_unit() {
        let spin = Spin { inertia: [3e-5, 5e-5, 9e-5], damping: FREE };
        let end = exact(spin, Attitude { rate: [0.02, 600.0, 0.02], ..Attitude::REST }, FREE, Duration::from_millis(1), 100_000);
        assert!(end.is_finite() && (end.orientation.iter().map(|q| q * q).sum::<f64>() - 1.0).abs() < 1e-15);
    }
}
