//! Closed form of a free top: angular velocity by Jacobi's elliptic functions, orientation by the constant angular momentum and one quadrature.
//!
//! Landau & Lifshitz, Mechanics, § 37, for J1 < J2 < J3 and L² > 2E·J2:
//!
//! ```text
//! ω = (a1·cn u, a2·sn u, a3·dn u),  u = λ·t + ε
//! a1² = (2E·J3 − L²)/(J1(J3 − J1)),  a2² = (2E·J3 − L²)/(J2(J3 − J2)),  a3² = (L² − 2E·J1)/(J3(J3 − J1))
//! λ² = (J3 − J2)(L² − 2E·J1)/(J1J2J3),  1 − m = (J3 − J1)(L² − 2E·J2)/((J3 − J2)(L² − 2E·J1))
//! ```
//!
//! In axes whose third axis is the angular momentum, the body is turned by φ about the third axis, then by θ about its first axis, then by ψ about its third
//! axis: cos θ = J3ω3/L, tan ψ = J1ω1/(J2ω2), φ̇ = L·(J1ω1² + J2ω2²)/(J1²ω1² + J2²ω2²).

use cohaptic_peer::rotation::{Attitude, Triple};
use qd::Quad;

use super::elliptic::{Jacobi, carlson_rf};

/// Length of a panel of the quadrature \[s\]. In the scene of this crate the nearest pole of φ̇ lies 0.69/λ = 0.1 s from the real axis, so φ̇ is analytic in
/// an ellipse of ρ = 200 around a panel, and below 100 rad/s there. Four points then err by less than 5·100·ρ⁻⁸ rad per second (Trefethen 2008, theorem 4.5),
/// 4·10⁻¹⁵ in 20 s.
const PANEL: f64 = 1e-3;

/// A free top.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FreeTop {
    /// Principal moments of inertia \[kg·m²\].
    inertia: Triple,
    /// Angular momentum L \[N·m·s\].
    momentum: f64,
    /// Amplitudes a1, a2 and a3 \[rad/s\].
    amplitudes: Triple,
    /// λ \[1/s\].
    pace: f64,
    /// ε \[1\].
    phase: f64,
    functions: Jacobi,
}

impl FreeTop {
    /// Returns the top with these principal moments \[kg·m²\] and this angular velocity at t = 0 \[rad/s\].
    ///
    /// # Panics
    ///
    /// Unless J1 < J2 < J3, L² > 2E·J2 and all three rates are above zero.
    pub(crate) fn new(inertia: Triple, rate: Triple) -> Self {
        let ([j1, j2, j3], [w1, w2, w3]) = (inertia, rate);
        assert!(j1 < j2 && j2 < j3 && w1 > 0.0 && w2 > 0.0 && w3 > 0.0, "the axes and signs of this closed form");
        // Sums of terms of one sign lose no digits. Only L² − 2E·J2 contains a cancellation.
        let above = j1 * (j3 - j1) * w1 * w1 + j2 * (j3 - j2) * w2 * w2;
        let below = j2 * (j2 - j1) * w2 * w2 + j3 * (j3 - j1) * w3 * w3;
        let between = j3 * (j3 - j2) * w3 * w3 - j1 * (j2 - j1) * w1 * w1;
        assert!(between > 0.0, "the angular velocity goes about the third axis");
        let amplitudes = [libm::sqrt(above / (j1 * (j3 - j1))), libm::sqrt(above / (j2 * (j3 - j2))), libm::sqrt(below / (j3 * (j3 - j1)))];
        // Carlson 1979: F(φ, m) = sin φ·RF(cos²φ, 1 − m·sin²φ, 1).
        let [cn, sn, dn] = [w1 / amplitudes[0], w2 / amplitudes[1], w3 / amplitudes[2]];
        Self {
            inertia,
            momentum: libm::sqrt(j1 * j1 * w1 * w1 + j2 * j2 * w2 * w2 + j3 * j3 * w3 * w3),
            amplitudes,
            pace: libm::sqrt((j3 - j2) * below / (j1 * j2 * j3)),
            phase: sn * carlson_rf([cn * cn, dn * dn, 1.0]),
            functions: Jacobi::of_complement((j3 - j1) * between / ((j3 - j2) * below)),
        }
    }

    /// Returns the angular velocity at a time \[s\], in body axes [rad/s].
    pub(crate) fn rate(&self, time: f64) -> Triple {
        let [sn, cn, dn] = self.functions.at(self.pace * time + self.phase);
        [self.amplitudes[0] * cn, self.amplitudes[1] * sn, self.amplitudes[2] * dn]
    }

    /// Returns the angular momentum J∘ω in body axes \[N·m·s\].
    fn momentum_of(&self, rate: Triple) -> Triple {
        std::array::from_fn(|axis| self.inertia[axis] * rate[axis])
    }

    /// Returns φ̇ \[rad/s\] at a time \[s\].
    fn precession(&self, time: f64) -> f64 {
        let rate = self.rate(time);
        let [m1, m2, _] = self.momentum_of(rate);
        self.momentum * (m1 * rate[0] + m2 * rate[1]) / (m1 * m1 + m2 * m2)
    }

    /// Returns θ and ψ \[rad\].
    fn tilt(&self, rate: Triple) -> [f64; 2] {
        let [m1, m2, m3] = self.momentum_of(rate);
        [libm::atan2(libm::hypot(m1, m2), m3), libm::atan2(m1, m2)]
    }

    /// Returns the attitudes after one span \[s\], two spans and so on, of a body in the rest orientation at t = 0.
    pub(crate) fn attitudes(&self, span: f64, count: u32) -> Vec<Attitude> {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small positive number")]
        let panels = ((span / PANEL).round() as u32).max(1);
        let panel = span / f64::from(panels);
        let [theta, psi] = self.tilt(self.rate(0.0));
        // The inverse of the rotation by θ and ψ at t = 0, so that the body begins in the rest orientation.
        let mut start = Attitude::REST;
        start.turn([0.0, 0.0, -psi]);
        start.turn([-theta, 0.0, 0.0]);
        // The sum over many panels is kept in double-double numbers, so that only the panels themselves are rounded.
        let mut turned = Quad::ZERO;
        let mut attitudes = Vec::with_capacity(count as usize);
        for place in 0..count {
            for within in 0..panels {
                let middle = f64::from(place) * span + (f64::from(within) + 0.5) * panel;
                turned += Quad::from_f64(panel * self.mean_precession(middle, 0.5 * panel));
            }
            let rate = self.rate(f64::from(place + 1) * span);
            let [theta, psi] = self.tilt(rate);
            let mut attitude = Attitude { rate, ..start };
            for turn in [[0.0, 0.0, within_a_turn(turned)], [theta, 0.0, 0.0], [0.0, 0.0, psi]] {
                attitude.turn(turn);
            }
            attitudes.push(attitude);
        }
        attitudes
    }

    /// Returns the mean of φ̇ over a panel, by four points of Gauss and Legendre.
    fn mean_precession(&self, middle: f64, half: f64) -> f64 {
        let (inner, outer) = (-libm::sqrt(4.8), libm::sqrt(4.8));
        let pair = |root: f64, weight: f64| {
            let aside = half * libm::sqrt((3.0 + root) / 7.0);
            weight * (self.precession(middle - aside) + self.precession(middle + aside))
        };
        pair(inner, 18.0 + libm::sqrt(30.0)) / 72.0 + pair(outer, 18.0 - libm::sqrt(30.0)) / 72.0
    }
}

/// Returns an angle without its whole turns.
fn within_a_turn(angle: Quad) -> f64 {
    let turn = Quad::PI + Quad::PI;
    (angle - turn * Quad::from_f64((angle.0 / turn.0).floor())).0
}
