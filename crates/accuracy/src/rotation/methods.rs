//! Methods for a free top from step to step.

use std::array::from_fn;
use std::time::Duration;

use cohaptic_peer::Integrator;
use cohaptic_peer::rotation::{Attitude, RotationStep, Spin, Triple};

/// A method for a free top over one step.
pub(crate) trait Advance {
    fn advance(&self, body: &mut Attitude);
}

/// The methods of the program.
impl Advance for RotationStep {
    #[inline(always)]
    fn advance(&self, body: &mut Attitude) {
        Self::advance(self, body, [0.0; 3]);
    }
}

/// Moments \[kg·m²\] and step length \[s\] of the methods of this file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Free {
    inertia: Triple,
    h: f64,
}

impl Free {
    fn momentum(&self, rate: Triple) -> Triple {
        from_fn(|axis| self.inertia[axis] * rate[axis])
    }

    fn rate(&self, momentum: Triple) -> Triple {
        from_fn(|axis| momentum[axis] / self.inertia[axis])
    }
}

/// Rotations about the axes x/2, y/2, z, y/2, x/2, each exact for the energy of that axis alone (Touma & Wisdom 1994). Second order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Split(pub(crate) Free);

impl Split {
    /// Rotates by the motion over a span with the energy of one axis alone: a rotation about this axis at its rate.
    #[inline(always)]
    fn turn(&self, axis: usize, span: f64, q: &mut [f64; 4], momentum: &mut Triple) {
        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
        let (sine, cosine) = libm::sincos(0.5 * span * momentum[axis] / self.0.inertia[axis]);
        let (w, u) = (q[0], [q[1], q[2], q[3]]);
        q[0] = w * cosine - u[axis] * sine;
        q[1 + axis] = u[axis] * cosine + w * sine;
        q[1 + j] = u[j] * cosine + u[k] * sine;
        q[1 + k] = u[k] * cosine - u[j] * sine;
        // Double-angle formulas: the momentum turns by the whole angle, the quaternion by half of it.
        let (sine, cosine) = (2.0 * sine * cosine, 1.0 - 2.0 * sine * sine);
        (momentum[j], momentum[k]) = (momentum[j] * cosine + momentum[k] * sine, momentum[k] * cosine - momentum[j] * sine);
    }
}

impl Advance for Split {
    #[inline(always)]
    fn advance(&self, body: &mut Attitude) {
        let (mut momentum, half) = (self.0.momentum(body.rate), 0.5 * self.0.h);
        for (axis, span) in [(0, half), (1, half), (2, self.0.h), (1, half), (0, half)] {
            self.turn(axis, span, &mut body.orientation, &mut momentum);
        }
        body.rate = self.0.rate(momentum);
    }
}

/// The implicit midpoint rule on the angular momentum in body axes, with Cayley's rotation by the rate at its middle (Austin, Krishnaprasad & Wang 1993).
/// Conserves energy and momentum. Second order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Midpoint(pub(crate) Free);

impl Advance for Midpoint {
    #[inline(always)]
    fn advance(&self, body: &mut Attitude) {
        let before = self.0.momentum(body.rate);
        let (mut after, mut middle, mut moved) = (before, body.rate, f64::INFINITY);
        // The fixed-point map contracts by h·ω, so the change falls until only rounding is left.
        for _ in 0..100 {
            let sum: Triple = from_fn(|axis| before[axis] + after[axis]);
            middle = self.0.rate(sum.map(|sum| 0.5 * sum));
            let turning = cross(sum, middle);
            let next: Triple = from_fn(|axis| before[axis] + 0.5 * self.0.h * turning[axis]);
            let change = next.iter().zip(&after).map(|(next, after)| (next - after).abs()).fold(0.0, f64::max);
            after = next;
            // A change that no longer falls is rounding: the iteration has converged.
            if change >= moved || change == 0.0 {
                break;
            }
            moved = change;
        }
        // Cayley's rotation is q·(1, ½h·ω), normalised.
        let half = middle.map(|rate| 0.5 * self.0.h * rate);
        let q = product(&body.orientation, half);
        let norm = libm::sqrt(q.iter().map(|q| q * q).sum());
        *body = Attitude { orientation: q.map(|q| q / norm), rate: self.0.rate(after) };
    }
}

/// The gyroscopic term is held over the step, and the rest is exact, which for a free top is ω⁺ = ω + h·γ0 and a rotation by h·ω + ½h²·γ0. First order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Held(pub(crate) Free);

impl Advance for Held {
    #[inline(always)]
    fn advance(&self, body: &mut Attitude) {
        let Free { inertia, h } = self.0;
        let turning = cross(self.0.momentum(body.rate), body.rate);
        let gained: Triple = from_fn(|axis| h * turning[axis] / inertia[axis]);
        body.turn(from_fn(|axis| h * (body.rate[axis] + 0.5 * gained[axis])));
        body.rate = from_fn(|axis| body.rate[axis] + gained[axis]);
    }
}

pub(crate) fn cross(a: Triple, b: Triple) -> Triple {
    from_fn(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
}

/// Returns q·(1, u).
#[inline(always)]
fn product([w, x, y, z]: &[f64; 4], u: Triple) -> [f64; 4] {
    let turned = cross([*x, *y, *z], u);
    [w - x * u[0] - y * u[1] - z * u[2], w * u[0] + x + turned[0], w * u[1] + y + turned[1], w * u[2] + z + turned[2]]
}

/// A method of rotation.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Method {
    /// The program's `exact`.
    Exponential,
    /// The program's `rk4`.
    RungeKutta,
    Split,
    Midpoint,
    Held,
    /// The program's `semi-implicit-euler`.
    Euler,
}

impl Method {
    pub(crate) const ALL: [Self; 6] = [Self::Exponential, Self::RungeKutta, Self::Split, Self::Midpoint, Self::Held, Self::Euler];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Exponential => "exponential, order 4",
            Self::RungeKutta => "RK4",
            Self::Split => "axis split",
            Self::Midpoint => "Lie midpoint",
            Self::Held => "exponential Euler",
            Self::Euler => "explicit Euler",
        }
    }

    pub(crate) const fn note(self) -> &'static str {
        match self {
            Self::Exponential => "ETDRK4 and a Magnus turn; the program's `exact`",
            Self::RungeKutta => "on quaternion and angular velocity; the program's `rk4`",
            Self::Split => "x/2, y/2, z, y/2, x/2; keeps the momentum",
            Self::Midpoint => "Cayley's turn, solved to rounding; keeps energy and momentum",
            Self::Held => "the gyroscopic term held over the step",
            Self::Euler => "on quaternion and angular velocity; the program's `semi-implicit-euler`",
        }
    }

    /// Runs a free top, and shows it after every step.
    pub(crate) fn run(self, inertia: Triple, start: Attitude, span: Duration, steps: u32, show: impl FnMut(u32, &Attitude)) {
        let free = Free { inertia, h: span.as_secs_f64() };
        let own = |integrator| Spin { inertia, damping: [0.0; 3] }.step(span, integrator, 1);
        match self {
            Self::Exponential => run(&own(Integrator::Exact), start, steps, show),
            Self::RungeKutta => run(&own(Integrator::RungeKutta4 { steps: 1 }), start, steps, show),
            Self::Euler => run(&own(Integrator::SemiImplicitEuler { steps: 1 }), start, steps, show),
            Self::Split => run(&Split(free), start, steps, show),
            Self::Midpoint => run(&Midpoint(free), start, steps, show),
            Self::Held => run(&Held(free), start, steps, show),
        }
    }
}

#[inline(always)]
fn run(step: &impl Advance, mut body: Attitude, steps: u32, mut show: impl FnMut(u32, &Attitude)) {
    for done in 1..=steps {
        step.advance(&mut body);
        show(done, &body);
    }
    std::hint::black_box(body);
}
