//! Statistics of the comparison.

pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Standard deviation of a sample.
pub(super) fn deviation(values: &[f64]) -> f64 {
    let mean = mean(values);
    (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64).sqrt()
}

/// Rank correlation (Spearman 1904): the correlation of the ranks, equal values with their mean rank.
pub(super) fn rank_correlation(one: &[f64], other: &[f64]) -> f64 {
    let ranks = |values: &[f64]| -> Vec<f64> {
        let below = |value: f64| values.iter().filter(|other| **other < value).count();
        let equal = |value: f64| values.iter().filter(|other| **other == value).count();
        values.iter().map(|value| below(*value) as f64 + (equal(*value) as f64 + 1.0) / 2.0).collect()
    };
    let (one, other) = (ranks(one), ranks(other));
    let (mean_one, mean_other) = (mean(&one), mean(&other));
    let product = |one: &[f64], by: f64, other: &[f64], and: f64| one.iter().zip(other).map(|(x, y)| (x - by) * (y - and)).sum::<f64>();
    product(&one, mean_one, &other, mean_other) / (product(&one, mean_one, &one, mean_one) * product(&other, mean_other, &other, mean_other)).sqrt()
}

/// The example of a published table of ranks would prove no more than these: order, reverse order, ties.
#[test]
fn ranks_alone_count() {
    assert_eq!(rank_correlation(&[1.0, 2.0, 10.0], &[-3.0, 0.0, 0.5]), 1.0);
    assert_eq!(rank_correlation(&[1.0, 2.0, 10.0], &[3.0, 2.0, 1.0]), -1.0);
    // Ranks 1, 2.5, 2.5, 4 and 1, 2, 3, 4: 4.5/√(4.5·5).
    assert!((rank_correlation(&[1.0, 2.0, 2.0, 4.0], &[1.0, 2.0, 3.0, 4.0]) - (0.9_f64).sqrt()).abs() < 1e-15);
    assert_eq!((mean(&[1.0, 2.0, 6.0]), deviation(&[1.0, 2.0, 6.0])), (3.0, 7.0_f64.sqrt()));
}
