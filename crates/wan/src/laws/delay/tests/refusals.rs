use super::*;

fn reason(distribution: &Distribution, mean: f64, sd: f64, floor: f64) -> String {
    Law::new(distribution, mean, sd, Some(floor)).unwrap_err().to_string()
}

#[test]
fn numbers_that_make_no_law_are_refused() {
    let normal = &Distribution::Normal;
    assert_eq!(reason(normal, f64::NAN, 1.0, 0.0), "the mean is NaN: expected a finite number");
    assert_eq!(reason(normal, 1.0, f64::INFINITY, 0.0), "the standard deviation is inf: expected a finite number");
    assert_eq!(reason(normal, 1.0, 1.0, f64::NEG_INFINITY), "the floor is -inf: expected a finite number");
    assert_eq!(reason(normal, 1.0, -2.0, 0.0), "the standard deviation is -2: expected zero or more");
    assert_eq!(reason(normal, 1.0, 1.0, 3.0), "the mean is 1, below the floor of 3: expected a mean at or above it");
}

#[test]
fn a_law_that_would_begin_below_the_floor_is_refused_with_the_largest_deviation() {
    let values = empirical(&[0.0, 1.0, 5.0]);
    for distribution in [&Distribution::Uniform, &Distribution::Pareto, &values] {
        let Err(LawError::ReachesBelowFloor { largest_sd, least, floor: 20.0, .. }) = Law::new(distribution, 24.0, 20.0, Some(20.0)) else {
            panic!("{distribution:?} reaches below");
        };
        assert!(least < 20.0);
        let widest = Law::new(distribution, 24.0, largest_sd, Some(20.0)).unwrap();
        assert!((widest.least() - 20.0).abs() < 1e-12 && widest.least() >= 20.0, "{distribution:?}");
    }
    assert_eq!(
        reason(&Distribution::Pareto, 0.5, 1.0, 0.0),
        "the Pareto law with mean 0.5 and standard deviation 1 begins at -0.0773503, below the floor of 0: \
         the deviation can be at most 0.866025"
    );
}

#[test]
fn a_law_from_the_floor_needs_room_above_it() {
    for distribution in [Distribution::LogNormal, Distribution::Gamma, Distribution::Weibull] {
        assert!(reason(&distribution, 5.0, 1.0, 5.0).ends_with("the deviation can be at most 0"));
        assert!(matches!(Law::new(&distribution, 1.0, 101.0, None), Err(LawError::TooVaried { largest_sd: 100.0, .. })));
        assert!(Law::new(&distribution, 1.0, 100.0, None).is_ok());
    }
}

#[test]
fn a_deviation_of_zero_is_a_constant_whatever_the_law() {
    for distribution in [Distribution::Normal, Distribution::Uniform, Distribution::Gamma, empirical(&[0.0, 1.0]), table("100")] {
        let law = Law::new(&distribution, 5.0, 0.0, Some(5.0)).unwrap();
        assert_eq!([law.draw(7, || 7), law.at_normal(3.0), law.quantile(0.1), law.mean(), law.least()], [5.0; 5]);
        assert_eq!([law.cdf(4.9), law.cdf(5.0), law.sd()], [0.0, 1.0, 0.0]);
        assert_eq!(law.gaussian_correlation(0.5), Ok(0.5));
    }
}

#[test]
fn values_are_used_as_they_are_if_asked_for_with_their_own_moments() {
    let values = [0.0, 0.1, 0.7, 12.3];
    let law = Empirical::new(values.to_vec()).unwrap();
    let (mean, sd) = (law.mean(), law.sd());
    let law = Law::new(&Distribution::Empirical(Arc::new(law)), mean, sd, None).unwrap();
    assert_eq!([0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|p| law.quantile(p)).map(|x| libm::rint(x * 1e12) / 1e12), values);
}

/// A table delivers its own moments: here two entries at ±½ deviation.
#[test]
fn a_table_reports_its_own_deviation() {
    let law = Law::new(&table("-4096 4096"), 24.0, 2.0, None).unwrap();
    assert_eq!((law.mean(), law.sd(), law.least()), (24.0, 1.0, 23.0));
}
