//! Integration by Gauss–Legendre panels.

/// Nodes in (0, 1) of the ten-point rule on [−1, 1], each with its weight. The rule is symmetric.
const NODES: [(f64, f64); 5] = [
    (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
    (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
    (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
    (0.433_395_394_129_247_2, 0.269_266_719_309_996_35),
    (0.148_874_338_981_631_22, 0.295_524_224_714_752_87),
];

/// Calls `at(x, weight)` for the ten nodes of the panel [low, high].
pub(in crate::laws::delay) fn panel(low: f64, high: f64, mut at: impl FnMut(f64, f64)) {
    let (centre, half) = (0.5 * (low + high), 0.5 * (high - low));
    for (node, weight) in NODES {
        // Each node stands for two, because the rule is symmetric.
        at(centre - half * node, half * weight);
        at(centre + half * node, half * weight);
    }
}

/// Returns ∫ f from `low` to `high`, in panels of width 1 at most.
pub(in crate::laws::delay) fn integral(low: f64, high: f64, f: impl Fn(f64) -> f64) -> f64 {
    // Equal panels, so the last panel is not a thin rest.
    let panels = libm::ceil(high - low).max(1.0);
    let width = (high - low) / panels;
    let (mut sum, mut i) = (0.0, 0.0);
    while i < panels {
        panel(low + i * width, low + (i + 1.0) * width, |x, weight| sum += weight * f(x));
        i += 1.0;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_of_degree_nineteen_are_integrated_exactly() {
        for k in 0..20 {
            let mut sum = 0.0;
            panel(0.0, 1.0, |x, weight| sum += weight * x.powi(k));
            assert!((sum * f64::from(k + 1) - 1.0).abs() < 1e-14, "x^{k}");
        }
    }

    #[test]
    fn the_normal_density_has_area_one() {
        let area = integral(-12.0, 12.0, super::super::normal::density);
        assert!((area - 1.0).abs() < 1e-14, "{area}");
    }
}
