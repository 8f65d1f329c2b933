//! Words that are refused, and the word at which the error points.

use crate::netem::{Contradiction, CrossSource, CrossSpec, DelaySpec, LossSpec, Netem, NetemErrorKind, Percent, StateSpec};

/// Refused words, and the part of the words to which the error must point.
const REFUSED: &[(&str, &str)] = &[
    ("foo", "foo"),
    ("delay 1ms jitter 5", "jitter"),
    ("delay 1ms 1ms 1% 3%", "3%"),
    ("Delay 1ms", "Delay"),
    ("delay", "delay"),
    ("loss random", "random"),
    ("slot distribution normal 1ms", "1ms"),
    ("delay -5ms", "-5ms"),
    ("delay ms", "ms"),
    ("delay 1.5.2ms", "1.5.2ms"),
    ("delay 5m", "5m"),
    ("delay inf", "inf"),
    ("delay 1e400s", "1e400s"),
    ("delay 9223372036854775808ns", "9223372036854775808ns"),
    ("delay 1ms 2parsecs", "2parsecs"),
    ("delay 1ms .5ms", ".5ms"),
    ("loss 101%", "101%"),
    ("loss 100.5", "100.5"),
    ("loss -1%", "-1%"),
    ("loss 1%%", "1%%"),
    ("loss 5% 150", "150"),
    ("loss rand 5%", "rand"),
    ("loss gemodel 1% 150", "150"),
    ("limit -1", "-1"),
    ("limit 5000000000", "5000000000"),
    ("limit 1t", "1t"),
    ("rate 10%", "10%"),
    ("rate 1k", "1k"),
    ("rate 0", "0"),
    ("rate 7", "7"),
    ("rate -1", "-1"),
    ("rate 1e30", "1e30"),
    ("rate 1mbit 1.5", "1.5"),
    ("rate 1mbit -14 -5", "-5"),
    ("rate 1mbit 0 0", "0"),
    ("rate 1mbit 2147483648", "2147483648"),
    ("rate 1mbit --1", "--1"),
    ("rate 1mbit -+1", "-+1"),
    ("rate 1mbit 0 08", "08"),
    ("gap 0", "0"),
    ("seed -1", "-1"),
    ("seed 0x10", "0x10"),
    ("seed 18446744073709551616", "18446744073709551616"),
    ("slot 5ns -5", "-5"),
    ("slot packets 5", "packets"),
    ("slot 1us packets -1", "-1"),
    ("slot 1us packets 0", "0"),
    ("slot 1us bytes 3000000000", "3000000000"),
    ("slot 1us packets 5 packets 6", "packets"),
    ("rate 1mbit cross", "cross"),
    ("rate 1mbit cross 8kbit", "8kbit"),
    ("rate 1mbit cross pois 8kbit", "pois"),
    ("rate 1mbit cross poisson", "poisson"),
    ("rate 1mbit cross poisson 5%", "5%"),
    ("rate 1mbit cross poisson 8kbit size 0", "0"),
    ("rate 1mbit cross poisson 8kbit size 1.5x", "1.5x"),
    ("rate 1mbit cross on-off 0 2kbit 1s 1s", "0"),
    ("rate 1mbit cross on-off 65537 2kbit 1s 1s", "65537"),
    ("rate 1mbit cross on-off 5 2kbit 0s 1s", "0s"),
    ("rate 1mbit cross on-off 5 2kbit 9s", "9s"),
    ("rate 1mbit cross on-off 5 2kbit 9s 9", "9"),
    ("rate 1mbit cross on-off 5 2kbit 9s 9s 2", "2"),
    ("rate 1mbit cross on-off 5 2kbit 9s 9s 1", "1"),
    ("rate 1mbit cross on-off 5 2kbit 9s 9s 1.5 1.5", "1.5"),
    // Options given twice.
    ("delay 1ms loss 1% delay 2ms", "delay"),
    ("loss 1% drop 2%", "drop"),
    // Contradictions.
    ("delay 1ms cross poisson 8kbit", "cross"),
    ("cross poisson 1mbit rate 1mbit", "cross"),
    ("rate 1mbit cross poisson 1000kbit loss 1%", "cross"),
    ("rate 1mbit 1500 cross poisson 500kbit", "cross"),
    ("rate 1mbit cross on-off 2 1mbit 1s 1s", "cross"),
    ("rate 1mbit cross on-off 1 1mbit 11ms 1s", "cross"),
    ("rate 1tbit cross poisson 16gbit size 1", "cross"),
    ("loss 1% reorder 25%", "reorder"),
    ("reorder 25% delay 0ms", "reorder"),
    ("gap 5 delay 1ms", "gap"),
    ("reorder 0% delay 1ms gap 5", "gap"),
    ("ecn", "ecn"),
    ("ecn loss 0%", "ecn"),
    ("delay 1ms distribution normal", "distribution"),
    ("distribution normal", "distribution"),
    ("distribution normal delay 1ms 0", "distribution"),
    ("distribution normal delay 0 1ms", "distribution"),
    ("loss state 60% 10% 10% 10% 50%", "50%"),
    ("loss state 10% 60% 50%", "50%"),
    ("slot 100us 50us", "50us"),
    ("slot 1us 5ns", "5ns"),
    ("slot distribution normal 1ms 0", "0"),
];

/// Words with a number that notations read differently, the faulty word, and parts of the message with both readings. iproute2 6.6 (`get_time`,
/// `get_percent`) reads µs in `delay`, ns in `slot`, and hundredths. iproute2 6.9 (`get_time64`) reads ns in `delay`. A number in a scene is a fraction.
const WITHOUT_UNIT: &[(&str, &str, &[&str])] = &[
    ("loss 1", "1", &["tc reads 1 %", "fraction 1, which is 100 %", "expected 1%"]),
    ("loss 0.07", "0.07", &["tc reads 0.07 %", "which is 7 %", "expected 0.07%"]),
    ("loss random 1% 25", "25", &["tc reads 25 %", "2500 %", "expected 25%"]),
    ("loss gemodel 1% 10 70%", "10", &["tc reads 10 %"]),
    ("loss state 1% 2% 3", "3", &["tc reads 3 %"]),
    ("duplicate 1 ", "1", &["duplicate", "tc reads 1 %"]),
    ("corrupt 1", "1", &["corrupt", "tc reads 1 %"]),
    ("delay 1ms reorder 25 50%", "25", &["reorder", "tc reads 25 %"]),
    ("delay 20", "20", &["tc reads 20 us up to version 6.8 and 20 ns from 6.9 on", "expected 20us or 20ns"]),
    ("delay 20ms 1e3", "1e3", &["tc reads 1e3 us", "expected 1e3us or 1e3ns"]),
    ("delay 20ms 5ms 25", "25", &["tc reads 25 %"]),
    ("slot 800", "800", &["tc reads 800 ns", "expected 800ns"]),
    ("slot 1us 800", "800", &["tc reads 800 ns"]),
    ("slot distribution normal 1ms 5", "5", &["tc reads 5 ns"]),
];

#[test]
fn a_number_without_unit_is_refused_with_both_readings() {
    for (words, blamed, parts) in WITHOUT_UNIT {
        let error = Netem::parse(words).expect_err(words);
        assert!(matches!(error.kind, NetemErrorKind::NoUnit { .. }) && words[error.span.clone()] == **blamed, "{words}: {error:?}");
        for part in *parts {
            assert!(error.to_string().contains(part), "no {part:?} in {error}");
        }
        assert!(error.excerpt(words).contains("^ no unit: tc reads "), "{}", error.excerpt(words));
    }
    // Zero means the same in all notations, and a value that has no unit in any notation needs none.
    for words in ["loss 0 0", "delay 0 0 0%", "slot 0 0 packets 5 bytes 100", "limit 10", "rate 1000", "loss gemodel 0 0 0 0", "seed 5"] {
        assert!(Netem::parse(words).is_ok(), "{words}");
    }
}

#[test]
fn every_error_points_at_the_word_to_blame() {
    for (words, blamed) in REFUSED {
        let error = Netem::parse(words).expect_err(words);
        assert_eq!(&words[error.span.clone()], *blamed, "{words}: {error}");
        let excerpt = error.excerpt(words);
        let (line, marks) = excerpt.split_once('\n').unwrap();
        assert_eq!(line, *words);
        let (indent, carets) = (marks.find('^').unwrap(), marks.matches('^').count());
        assert_eq!((indent, carets), (error.span.start, blamed.len()), "{excerpt}");
        assert!(marks.contains("expected "), "{excerpt}");
        assert!(error.to_string().contains("expected "), "{error}");
    }
}

#[test]
fn what_is_said_twice_is_blamed_the_second_time() {
    let words = "delay 1ms loss 1% delay 2ms";
    assert_eq!(Netem::parse(words).unwrap_err().span, 18..23);
}

#[test]
fn an_excerpt_shows_the_line_of_the_word() {
    let words = "delay 24ms\n\tloss µ5%\r\nlimit 5";
    let error = Netem::parse(words).unwrap_err();
    assert_eq!(error.excerpt(words), "\tloss µ5%\n\t     ^^^ expected a percentage from 0 to 100");
    assert_eq!(error.to_string(), "\"µ5%\" is not what loss takes here: expected a percentage from 0 to 100");
    let missing = Netem::parse("delay 1ms rate").unwrap_err();
    assert!(missing.excerpt("delay 1ms rate").starts_with("delay 1ms rate\n          ^^^^ expected a rate of at least 8bit"));
}

#[test]
fn an_excerpt_of_another_text_does_not_panic() {
    let error = Netem::parse("delay 24ms loss µ5%").unwrap_err();
    for other in ["", "µ", "µµµµµµµµµµµµµµ", "\n\n", "delay 24ms loss \n5%"] {
        assert!(error.excerpt(other).contains('^'));
    }
}

/// Some shares sum to 1 only up to rounding.
#[test]
fn ways_out_of_a_state_may_sum_to_all() {
    for tenth in 0..=1000 {
        let words = format!(
            "loss state {}% {}% {}% 50% {}%",
            f64::from(tenth) / 10.0,
            f64::from(tenth) / 10.0,
            f64::from(1000 - tenth) / 10.0,
            f64::from(1000 - tenth) / 10.0
        );
        assert!(Netem::parse(&words).is_ok(), "{words}");
    }
}

#[test]
fn what_cannot_be_said_is_found_in_values_made_by_hand() {
    let percent = Percent::new(1.0);
    let skipped = StateSpec { p13: Percent::ZERO, p31: None, p32: percent, p23: None, p14: None };
    let netem = Netem { loss: Some(LossSpec::State(skipped)), ..Netem::default() };
    assert_eq!(netem.check(), Err(Contradiction::ProbabilitySkipped));
    let netem = Netem { delay: Some(DelaySpec { time: core::time::Duration::MAX, jitter: None }), ..Netem::default() };
    assert_eq!(netem.check(), Err(Contradiction::TimeTooLong));
    let words = Netem::parse("rate 1mbit cross on-off 2 9kbit 9s 9s").unwrap();
    let check = |change: fn(&mut u32, &mut f64)| {
        let mut netem = words.clone();
        let Some(CrossSpec { source: CrossSource::OnOff { sources, shape, .. }, .. }) = &mut netem.cross else { panic!() };
        let (mut number, mut law) = (sources.get(), 1.5);
        change(&mut number, &mut law);
        (*sources, *shape) = (number.try_into().unwrap(), Some(law));
        netem.check()
    };
    assert_eq!(check(|_, _| ()), Ok(()));
    assert_eq!(check(|sources, _| *sources = 65_537), Err(Contradiction::CrossSources));
    assert_eq!(check(|_, shape| *shape = f64::NAN), Err(Contradiction::CrossShape));
}

#[test]
fn an_unknown_word_says_what_is_known() {
    let error = Netem::parse("help").unwrap_err();
    assert!(matches!(&error.kind, NetemErrorKind::UnknownWord { word } if word == "help"));
    assert!(error.to_string().contains("expected limit, delay"));
    for words in ["delay 20ms fq_codel", "delay 20ms dualpi2"] {
        let error = Netem::parse(words).unwrap_err();
        assert!(error.to_string().contains(" is a qdisc of its own") && error.to_string().ends_with("with rate and queue.discipline"), "{error}");
    }
}
