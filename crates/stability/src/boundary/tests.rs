//! Boundaries of radii whose crossings of 1 are known in closed form.

use super::*;
use crate::Radius;

fn range() -> KeyRange {
    KeyRange { key: "key".to_owned(), low: 0.0, high: 10.0, unit: String::new() }
}

/// Returns the boundary along a key whose value gives the radius exp(`level(value)`), known up to rounding.
#[track_caller]
fn along(level: impl Fn(f64) -> f64 + Sync) -> Boundary {
    let radius = |value: f64| Ok::<_, ()>(Cell::certain(Radius { value: libm::exp(level(value)), error: 1e-14 }));
    let boundary = Boundary::search(&range(), BoundaryOptions::of(&range()), &[], radius, |_| (), || false).unwrap();
    assert!(boundary.is_settled());
    // A search that goes through every double would not end; these searches end after a few hundred values more than the first pass.
    assert!(boundary.samples < 1500, "{} values", boundary.samples);
    boundary
}

#[track_caller]
fn crosses(boundary: &Boundary, expected: &[f64]) {
    let found: Vec<f64> = boundary.crossings.iter().map(|crossing| crossing.value).collect();
    let close = found.len() == expected.len() && found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-8);
    assert!(close, "{found:?} is not {expected:?}");
    let mut verdict = boundary.first;
    for crossing in &boundary.crossings {
        assert_eq!(crossing.from, verdict);
        verdict = crossing.to;
    }
}

const CENTRE: f64 = 3.712_345_678_9;

#[test]
fn a_line_that_crosses_once_is_found_to_the_tolerance() {
    let boundary = along(|value| value - CENTRE);
    crosses(&boundary, &[CENTRE]);
    assert_eq!((boundary.crossings[0].from, boundary.crossings[0].to), (Verdict::Stable, Verdict::Unstable));
    assert!(boundary.finest <= 1e-8 && boundary.coarsest <= 10.0 / 399.0 * 1.000_001);
    assert_eq!(boundary.samples, boundary.known.len());
}

/// Islands of 10⁻³ and 10⁻⁶ of the range, far below the distance of 2.5·10⁻³ of the first samples, in smooth valleys and on smooth hills.
#[test]
fn islands_between_the_samples_are_found() {
    for width in [1e-2_f64, 1e-5] {
        let half = 0.5 * width;
        for sign in [1.0, -1.0] {
            let level = |value: f64| sign * 0.3 * ((value - CENTRE).powi(2) - half * half);
            crosses(&along(level), &[CENTRE - half, CENTRE + half]);
        }
    }
}

/// The larger of two branches has a corner where they cross, so that a valley is sharp.
#[test]
fn islands_in_sharp_valleys_are_found() {
    for half in [5e-3, 5e-6] {
        crosses(&along(|value| 2.0 * (CENTRE - value - half).max(0.1 * (value - CENTRE - half))), &[CENTRE - half, CENTRE + half]);
    }
}

#[test]
fn islands_at_the_ends_of_the_range_are_found() {
    for end in [0.0, 10.0] {
        let expected = if end == 0.0 { 1e-4 } else { 10.0 - 1e-4 };
        crosses(&along(|value| (value - end).powi(2) - 1e-8), &[expected]);
    }
}

#[test]
fn many_crossings_are_all_found() {
    let expected: Vec<f64> = (1..=32).map(|number| (f64::from(number) * std::f64::consts::PI - 1.0) / 10.0).collect();
    crosses(&along(|value| 0.2 * libm::sin(10.0 * value + 1.0)), &expected);
}

#[test]
fn a_hill_that_stays_just_below_is_no_crossing() {
    for below in [1e-3, 1e-6, 1e-9] {
        for sign in [1.0, -1.0] {
            let boundary = along(|value| sign * (-0.3 * (value - CENTRE).powi(2) - below));
            crosses(&boundary, &[]);
            assert!(boundary.marginal.is_empty());
        }
    }
}

#[test]
fn a_tangency_is_marginal_and_no_crossing() {
    let boundary = along(|value| -0.3 * (value - CENTRE).powi(2));
    assert!(boundary.crossings.iter().all(|crossing| (crossing.value - CENTRE).abs() < 1e-6));
    assert!(boundary.marginal.len() == 1 && (boundary.marginal[0].low - CENTRE).abs() < 1e-6, "{:?}", boundary.marginal);
}

/// On a very narrow island the radius is hardly below 1. The stretches on which the radius cannot be told from 1 are reported, and no crossings beyond the real
/// ones.
#[test]
fn an_island_within_the_bound_of_the_error_has_marginal_shores() {
    let half = 5e-7;
    let boundary = along(|value| 0.3 * ((value - CENTRE).powi(2) - half * half));
    let verdicts: Vec<Verdict> = boundary.crossings.iter().map(|crossing| crossing.to).collect();
    assert_eq!(verdicts, [Verdict::Marginal, Verdict::Stable, Verdict::Marginal, Verdict::Unstable]);
    assert!(boundary.marginal.iter().all(|stretch| ((0.5 * (stretch.low + stretch.high) - CENTRE).abs() - half).abs() < 1e-8));
}

#[test]
fn a_plateau_at_one_is_a_marginal_stretch() {
    let boundary = along(|value| (value - 6.0).max(0.0) - (2.0 - value).max(0.0));
    crosses(&boundary, &[2.0, 6.0]);
    assert!(boundary.marginal.len() == 1 && (boundary.marginal[0].low - 2.0).abs() < 1e-7 && (boundary.marginal[0].high - 6.0).abs() < 1e-7);
    // Noise within the bound of the error is none.
    let noise = along(|value| 5e-15 * libm::sin(1e9 * value));
    assert!(noise.crossings.is_empty() && noise.marginal == [Stretch { low: 0.0, high: 10.0 }]);
    assert!(noise.samples < 1000);
}

#[test]
fn a_search_goes_on_where_it_was_stopped() {
    let level = |value: f64| 0.2 * libm::sin(10.0 * value);
    let whole = along(level);
    let computed = AtomicUsize::new(0);
    let radius = |value: f64| {
        computed.fetch_add(1, Ordering::Relaxed);
        Ok::<_, ()>(Cell::certain(Radius { value: libm::exp(level(value)), error: 1e-14 }))
    };
    let options = BoundaryOptions::of(&range());
    let stop = || computed.load(Ordering::Relaxed) >= 700;
    let part = Boundary::search(&range(), options, &[], radius, |_| (), stop).unwrap();
    assert!(!part.is_settled() && part.samples >= 700);
    computed.store(0, Ordering::Relaxed);
    let rest = Boundary::search(&range(), options, &part.known, radius, |_| (), || false).unwrap();
    assert_eq!(rest, whole);
    assert_eq!(computed.load(Ordering::Relaxed), whole.samples - part.samples);
}

#[test]
fn one_thread_finds_what_many_find() {
    let find = || along(|value| 0.2 * libm::sin(10.0 * value));
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    assert_eq!(pool(1).install(find), pool(7).install(find));
}

#[test]
fn a_search_that_may_not_look_any_further_says_so() {
    let radius = |value: f64| Ok::<_, FamilyError>(Cell::certain(Radius { value: libm::exp(value - CENTRE), error: 0.0 }));
    let options = BoundaryOptions { most: 410, ..BoundaryOptions::of(&range()) };
    let boundary = Boundary::search(&range(), options, &[], radius, |_| (), || false).unwrap();
    assert!(!boundary.is_settled() && boundary.samples == 410);
    let refused = |options| Boundary::search(&range(), options, &[], radius, |_| (), || false).unwrap_err().to_string();
    assert!(refused(BoundaryOptions { samples: 1, ..options }).contains("expected at least 2 samples"));
    assert!(refused(BoundaryOptions { tolerance: 0.0, ..options }).contains("tolerance above zero"));
}

/// Blocks look at almost all that a search looks at, and the search finds the same with and without them.
#[test]
fn blocks_leave_a_search_little_to_do() {
    let text = r#"
        scene = { duration = "1s", count = 2 }
        object = { mass = 0.45 }
        coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
        peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    "#;
    let range = KeyRange::parse("link.delay=0ms..100ms").unwrap();
    let family = Family::new(text, "two.toml".as_ref(), &[], vec![range.clone()]).unwrap();
    let options = BoundaryOptions { samples: 100, ..BoundaryOptions::of(&range) };
    let whole = Boundary::find(&family, options, &[], |_| (), || false).unwrap();
    assert!(!whole.crossings.is_empty());
    let blocks = Boundary::blocks(&range, options);
    assert_eq!((blocks.len(), blocks[0].first_values().len(), blocks[12].first_values().len()), (13, 9, 4));
    let known = std::sync::Mutex::new(Vec::new());
    for (place, block) in blocks.iter().enumerate() {
        let before = known.lock().unwrap().clone();
        assert!(!block.is_known(&range, options, &before), "{place}");
        let keep = |value, cell| known.lock().unwrap().push((value, cell));
        Boundary::search_blocks(&family, options, std::slice::from_ref(block), &before, keep, |_| (), &crate::Unwatched).unwrap();
        assert!(block.is_known(&range, options, &known.lock().unwrap()), "{place}");
    }
    let known = known.into_inner().unwrap();
    let rest = whole.known.iter().filter(|(value, _)| known.iter().all(|(known, _)| known.to_bits() != value.to_bits())).count();
    assert!(10 * rest < whole.samples, "{rest} of {} values are left", whole.samples);
    assert_eq!(Boundary::find(&family, options, &known, |_| (), || false).unwrap(), whole);
}

/// A stretch of unknown radii shows no bend, and further values would tell nothing.
#[test]
fn a_stretch_in_which_nothing_is_known_is_not_halved_to_the_tolerance() {
    let known = |value: f64| Radius { value: libm::exp(value - 9.0), error: 1e-14 };
    let radius = |value: f64| Ok::<_, ()>(Cell::certain(if value > CENTRE { Radius::UNKNOWN } else { known(value) }));
    let boundary = Boundary::search(&range(), BoundaryOptions::of(&range()), &[], radius, |_| (), || false).unwrap();
    assert!(boundary.is_settled() && boundary.samples < 1500, "{} values", boundary.samples);
    crosses(&boundary, &[CENTRE]);
    assert_eq!((boundary.crossings[0].from, boundary.crossings[0].to), (Verdict::Stable, Verdict::Overflow));
}
