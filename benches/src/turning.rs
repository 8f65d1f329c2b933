//! A tick of a copy that turns, drawn to a mean that stays: as peers compute it, and by hand with the same arithmetic.

use std::time::Duration;

use cohaptic_peer::rotation::{Attitude, Matrix3, RotationStep, Spin, Triple, aligning_torque};
use cohaptic_peer::{Gains, Integrator};

/// A copy and what it holds of the others.
#[derive(Clone, Copy, Debug)]
pub struct Copy {
    /// J and bR.
    pub spin: Spin,
    /// KR and BR.
    pub gains: Gains<Triple>,
    /// M̄ and w̄.
    pub mean: (Matrix3, Triple),
}

impl Copy {
    /// The program's step of a millisecond.
    #[must_use]
    pub fn step(&self) -> RotationStep {
        self.spin.step(Duration::from_millis(1), Integrator::Exact, 1)
    }

    /// The numbers of the loop by hand.
    #[must_use]
    pub fn by_hand(&self) -> ByHand {
        let ([jx, jy, jz], h) = (self.spin.inertia, 1e-3);
        let [kx, ky, kz] = self.gains.stiffness;
        let half = 0.5 * (kx + ky + kz);
        let phi = |axis: usize, n: u32, h: f64| {
            let x = h * self.spin.damping[axis] / self.spin.inertia[axis];
            let (mut term, mut sum) = (1.0 / (1..=n).map(f64::from).product::<f64>(), 0.0);
            for k in 1..25 {
                sum += term;
                term *= -x / f64::from(k + n);
            }
            sum
        };
        let each = |of: &dyn Fn(usize) -> f64| [of(0), of(1), of(2)];
        ByHand {
            gyration: [(jy - jz) / jx, (jz - jx) / jy, (jx - jy) / jz],
            mobility: [1.0 / jx, 1.0 / jy, 1.0 / jz],
            weights: [half - kx, half - ky, half - kz],
            damping: self.gains.damping,
            e: each(&|axis| phi(axis, 0, h)),
            g: each(&|axis| h * phi(axis, 1, h)),
            e_half: each(&|axis| phi(axis, 0, 0.5 * h)),
            g_half: each(&|axis| 0.5 * h * phi(axis, 1, 0.5 * h)),
            a: each(&|axis| h * (2.0 * phi(axis, 2, h) - 4.0 * phi(axis, 3, h))),
            b: each(&|axis| h * (4.0 * phi(axis, 3, h) - phi(axis, 2, h))),
            c: each(&|axis| h * h * (2.0 * phi(axis, 3, h) - 4.0 * phi(axis, 4, h))),
            d: each(&|axis| h * h * (4.0 * phi(axis, 4, h) - phi(axis, 3, h))),
            drift: each(&|axis| h * h * phi(axis, 2, h)),
            magnus: h * h / 12.0,
        }
    }
}

/// A number of ticks as peers compute them.
#[inline(never)]
pub fn program(step: &RotationStep, copy: &Copy, body: &mut Attitude, ticks: u32) {
    for _ in 0..ticks {
        let torque = aligning_torque((&body.matrix(), body.rate), (&copy.mean.0, copy.mean.1), &copy.gains);
        step.advance(body, torque.map(|component| -component));
    }
}

/// The coefficients of a tick by hand.
#[derive(Clone, Copy, Debug)]
pub struct ByHand {
    gyration: Triple,
    mobility: Triple,
    weights: Triple,
    damping: Triple,
    e: Triple,
    g: Triple,
    e_half: Triple,
    g_half: Triple,
    a: Triple,
    b: Triple,
    c: Triple,
    d: Triple,
    drift: Triple,
    magnus: f64,
}

/// The same number of ticks by hand.
#[inline(never)]
pub fn by_hand(tick: &ByHand, copy: &Copy, body: &mut Attitude, ticks: u32) {
    for _ in 0..ticks {
        self::tick(tick, copy, body);
    }
}

#[inline(always)]
fn tick(t: &ByHand, copy: &Copy, body: &mut Attitude) {
    let ([w, x, y, z], [p, q, r], (m, v)) = (body.orientation, body.rate, &copy.mean);
    let f = 2.0 / (w * w + x * x + y * y + z * z);
    let (r00, r01, r02) = (1.0 - f * (y * y + z * z), f * (x * y - w * z), f * (x * z + w * y));
    let (r10, r11, r12) = (f * (x * y + w * z), 1.0 - f * (x * x + z * z), f * (y * z - w * x));
    let (r20, r21, r22) = (f * (x * z - w * y), f * (y * z + w * x), 1.0 - f * (x * x + y * y));
    // The six entries of RᵀM̄·P that are needed.
    let a21 = t.weights[1] * (r02 * m[0][1] + r12 * m[1][1] + r22 * m[2][1]);
    let a12 = t.weights[2] * (r01 * m[0][2] + r11 * m[1][2] + r21 * m[2][2]);
    let a02 = t.weights[2] * (r00 * m[0][2] + r10 * m[1][2] + r20 * m[2][2]);
    let a20 = t.weights[0] * (r02 * m[0][0] + r12 * m[1][0] + r22 * m[2][0]);
    let a10 = t.weights[0] * (r01 * m[0][0] + r11 * m[1][0] + r21 * m[2][0]);
    let a01 = t.weights[1] * (r00 * m[0][1] + r10 * m[1][1] + r20 * m[2][1]);
    let tx = t.damping[0] * (r00 * v[0] + r10 * v[1] + r20 * v[2] - p) + (a21 - a12);
    let ty = t.damping[1] * (r01 * v[0] + r11 * v[1] + r21 * v[2] - q) + (a02 - a20);
    let tz = t.damping[2] * (r02 * v[0] + r12 * v[1] + r22 * v[2] - r) + (a10 - a01);
    // k1 to k4 of ETDRK4, the first one within T.
    let (gx, gy, gz) = (t.gyration[0] * (q * r), t.gyration[1] * (r * p), t.gyration[2] * (p * q));
    let (sx, sy, sz) = (t.mobility[0] * tx + gx, t.mobility[1] * ty + gy, t.mobility[2] * tz + gz);
    let (hx, hy, hz) = (t.e_half[0] * p + t.g_half[0] * sx, t.e_half[1] * q + t.g_half[1] * sy, t.e_half[2] * r + t.g_half[2] * sz);
    let (bx, by, bz) = (t.gyration[0] * (hy * hz) - gx, t.gyration[1] * (hz * hx) - gy, t.gyration[2] * (hx * hy) - gz);
    let (ix, iy, iz) = (hx + t.g_half[0] * bx, hy + t.g_half[1] * by, hz + t.g_half[2] * bz);
    let (cx, cy, cz) = (t.gyration[0] * (iy * iz) - gx, t.gyration[1] * (iz * ix) - gy, t.gyration[2] * (ix * iy) - gz);
    let (fx, fy, fz) = (t.e[0] * p + t.g[0] * sx, t.e[1] * q + t.g[1] * sy, t.e[2] * r + t.g[2] * sz);
    let (ox, oy, oz) = (fx + 2.0 * (t.g_half[0] * cx), fy + 2.0 * (t.g_half[1] * cy), fz + 2.0 * (t.g_half[2] * cz));
    let (dx, dy, dz) = (t.gyration[0] * (oy * oz) - gx, t.gyration[1] * (oz * ox) - gy, t.gyration[2] * (ox * oy) - gz);
    let (mx, my, mz) = (bx + cx, by + cy, bz + cz);
    let (np, nq, nr) = (fx + t.a[0] * mx + t.b[0] * dx, fy + t.a[1] * my + t.b[1] * dy, fz + t.a[2] * mz + t.b[2] * dz);
    let ux = t.g[0] * p + t.drift[0] * sx + t.c[0] * mx + t.d[0] * dx + t.magnus * (q * nr - r * nq);
    let uy = t.g[1] * q + t.drift[1] * sy + t.c[1] * my + t.d[1] * dy + t.magnus * (r * np - p * nr);
    let uz = t.g[2] * r + t.drift[2] * sz + t.c[2] * mz + t.d[2] * dz + t.magnus * (p * nq - q * np);
    let (cosine, sine) = half_turn(ux * ux + uy * uy + uz * uz);
    let (lx, ly, lz) = (ux * sine, uy * sine, uz * sine);
    let nw = w * cosine - (x * lx + y * ly + z * lz);
    let nx = w * lx + x * cosine + (y * lz - z * ly);
    let ny = w * ly + y * cosine + (z * lx - x * lz);
    let nz = w * lz + z * cosine + (x * ly - y * lx);
    let unit = 0.5 * (3.0 - (nw * nw + nx * nx + ny * ny + nz * nz));
    *body = Attitude { orientation: [nw * unit, nx * unit, ny * unit, nz * unit], rate: [np, nq, nr] };
}

/// cos(½a) and sin(½a)/a of a² by seven terms each, or by the library.
#[inline(always)]
fn half_turn(square: f64) -> (f64, f64) {
    if square >= 0.25 {
        let angle = square.sqrt();
        let (sine, cosine) = (0.5 * angle).sin_cos();
        return (cosine, sine / angle);
    }
    let s = -0.25 * square;
    let over = |term: f64, number: f64| 1.0 + s * term / number;
    let cosine = over(over(over(over(over(over(1.0, 132.0), 90.0), 56.0), 30.0), 12.0), 2.0);
    let sine = over(over(over(over(over(over(1.0, 156.0), 110.0), 72.0), 42.0), 20.0), 6.0);
    (cosine, 0.5 * sine)
}

/// What the bench turns: 12 rad/s, tied to two others half a radian apart.
#[must_use]
pub fn example() -> (Copy, Attitude) {
    let held = [0.25, -0.25].map(|angle| {
        let mut attitude = Attitude { rate: [0.3, -0.2, 0.1], ..Attitude::REST };
        attitude.turn([angle, 0.1, -0.3 * angle]);
        attitude
    });
    let held = cohaptic_peer::rotation::HeldAttitudes::new(held);
    let (matrix, rate) = held.mean();
    let copy = Copy {
        spin: Spin { inertia: [3e-5, 5e-5, 9e-5], damping: [1e-4, 2e-4, 3e-4] },
        gains: Gains { stiffness: [0.01, 0.02, 0.015], damping: [1e-5, 2e-5, 3e-5] },
        mean: (*matrix, rate),
    };
    (copy, Attitude { rate: [3.0, 12.0, -5.0], ..Attitude::REST })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From equal states: some fifty roundings a tick, relative to the fastest rate, which turns near an unstable axis let grow thirty times in 100 ticks. At
    /// 600 rad/s they grow by far more, so ticks are compared one by one.
    #[test]
    fn both_ways_are_one_motion() {
        let (copy, start) = example();
        for (rate, ticks) in [(start.rate, 100_u32), ([30.0, 600.0, 0.0], 1)] {
            let mut one = Attitude { rate, ..start };
            let fastest = rate.iter().fold(1.0_f64, |fastest, rate| fastest.max(rate.abs()));
            let tolerance = 30.0 * f64::from(ticks) * 50.0 * f64::EPSILON / 2.0 * fastest;
            for _ in 0..10 {
                let mut other = one;
                program(&copy.step(), &copy, &mut one, ticks);
                by_hand(&copy.by_hand(), &copy, &mut other, ticks);
                assert!(one.angle_to(&other.orientation) < tolerance, "{one:?} {other:?}");
                assert!(one.rate.iter().zip(&other.rate).all(|(one, other)| (one - other).abs() < tolerance), "{one:?} {other:?}");
            }
        }
    }
}
