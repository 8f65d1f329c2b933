use cohaptic_tests_common::properties;

use super::*;

fn texts(text: &str) -> Vec<String> {
    Variation::parse(text).unwrap().values.into_iter().map(|value| value.text).collect()
}

#[test]
fn a_range_has_both_ends_and_equal_steps() {
    let vary = Variation::parse(" coordination.stiffness = 0..6000/4 ").unwrap();
    assert_eq!((vary.key(), vary.count(), vary.column().as_str()), ("coordination.stiffness", 4, "coordination.stiffness"));
    assert_eq!(texts("a=0..6000/4"), ["0", "2000", "4000", "6000"]);
    assert_eq!(vary.overrides(2), ["coordination.stiffness=4000"]);
    assert_eq!((vary.kind(), &vary.values()[1].value), (Kind::Number, &Value::Number(2000.0)));
    // Tenths are exactly the `f64` nearest to the written tenths.
    assert_eq!(texts("a=0..1/11"), ["0", "0.1", "0.2", "0.3", "0.4", "0.5", "0.6", "0.7", "0.8", "0.9", "1"]);
    assert_eq!(texts("a=-1..1/3"), ["-1", "0", "1"]);
    assert_eq!(texts("a=-8e307..8e307/3"), ["-8e307", "0", "8e307"]);
}

#[test]
fn a_range_with_log_has_equal_ratios() {
    assert_eq!(texts("a=1..1000/4:log"), ["1", "10", "100", "1000"]);
    assert_eq!(texts("link.delay=0.5ms..50ms/3:log"), ["0.5ms", "5ms", "50ms"]);
    let values: Vec<f64> = texts("a=2..7/6:log").iter().map(|text| text.parse().unwrap()).collect();
    for pair in values.windows(2) {
        // Compares with (7/2)^(1/5), by repeated multiplication. Each end has 15 digits, so the ratio is wrong by at most 10⁻¹⁴, and its fifth power by 5·10⁻¹⁴
        // of 3.5.
        assert!(((pair[1] / pair[0]).powi(5) - 3.5).abs() < 3.5 * 6e-14, "{values:?}");
    }
}

#[test]
fn a_range_with_a_unit_keeps_it() {
    let vary = Variation::parse("link.delay=0ms..50ms/3").unwrap();
    assert_eq!((texts(vary.text()), vary.column().as_str()), (vec!["0ms".to_owned(), "25ms".to_owned(), "50ms".to_owned()], "link.delay_ms"));
    assert_eq!(vary.values()[1].value, Value::Number(25.0));
    assert_eq!(Variation::parse("link.loss=0%..5%/2").unwrap().column(), "link.loss_percent");
}

#[test]
fn a_list_takes_anything_and_its_column_what_all_are() {
    let kind = |text| Variation::parse(text).map(|vary| (vary.kind(), vary.column())).unwrap();
    assert_eq!(kind("scene.count=2,3,5"), (Kind::Integer, "scene.count".to_owned()));
    assert_eq!(kind("a=2,3.5"), (Kind::Number, "a".to_owned()));
    assert_eq!(kind("link.delay=8ms, \"24ms\""), (Kind::Number, "link.delay_ms".to_owned()));
    assert_eq!(kind("link.delay=500us,8ms"), (Kind::Text, "link.delay".to_owned()));
    assert_eq!(kind("coordination.strategy=average-position,proportional-derivative"), (Kind::Text, "coordination.strategy".to_owned()));
    assert_eq!(kind("a=true,false").0, Kind::Text);
    assert_eq!(kind("link.trace=../one.trace,../two.trace").0, Kind::Text);
    assert_eq!(texts("peer.hand={ force = [1.0, 2.0] },{ force = [0.0, 0.0] }"), ["{ force = [1.0, 2.0] }", "{ force = [0.0, 0.0] }"]);
    let quoted = Variation::parse("scene.title=\"a, b\",'c'").unwrap();
    assert_eq!(quoted.values()[0].value, Value::Text("a, b".into()));
    assert_eq!(quoted.overrides(0), ["scene.title=\"a, b\""]);
    assert_eq!(texts("a=5"), ["5"]);
}

#[test]
fn anything_else_is_refused_and_says_why() {
    let message = |text: &str| Variation::parse(text).unwrap_err().to_string();
    for (text, part) in [
        ("", "no key"),
        ("coordination.stiffness", "no key"),
        ("=0..1/3", "no key"),
        ("a=0..1", "the number of values is missing"),
        ("a=0..1/x", "the number of values is missing"),
        ("a=0..1/-3", "the number of values is missing"),
        ("a=0..1/3:lin", "the number of values is missing"),
        ("a=0..1/0", "a range of 0"),
        ("a=0..1/1", "a range of 1"),
        ("a=0..1/1000001", "too many"),
        ("a=0..1/99999999999999999999999", "the number of values is missing"),
        ("a=1..1/5", "is empty: 1 is not below 1"),
        ("a=2..1/5", "is empty: 2 is not below 1"),
        ("a=-1.7e308..1.7e308/5", "is empty"),
        ("a=0..x/3", "\"x\" in"),
        ("a=0../3", "\"\" in"),
        ("a=0..inf/3", "\"inf\" in"),
        ("a=0..50ms/3", "units \"\" and \"ms\""),
        ("a=0..5/3:log", "0 in \"a=0..5/3:log\" is not above zero"),
        ("a=", "is missing"),
        ("a=1,,2", "is missing"),
        ("a=1,2,", "is missing"),
        ("a=1,2,1", "1 stands twice"),
    ] {
        assert!(message(text).contains(part), "{text}: {}", message(text));
        assert!(message(text).contains("expected"), "{text}");
    }
}

#[test]
fn commas_within_values_do_not_split() {
    assert_eq!(split_at_commas("scene.count=2"), ["scene.count=2"]);
    assert_eq!(split_at_commas("peer.hand={ force = [1.0, 2.0], a = 1 },x=1"), ["peer.hand={ force = [1.0, 2.0], a = 1 }", "x=1"]);
    assert_eq!(split_at_commas("scene.title=\"a, b\",x='[,'"), ["scene.title=\"a, b\"", "x='[,'"]);
    assert_eq!(split_at_commas("a=1,"), ["a=1", ""]);
}

#[test]
fn a_strategy_may_have_settings() {
    let vary =
        Variation::parse("coordination.strategy=average-position,local-damping{ damping = 58 },extrapolated{horizon=50ms,object.mass=1}").unwrap();
    assert_eq!(vary.texts().collect::<Vec<&str>>(), ["average-position", "local-damping{damping=58}", "extrapolated{horizon=50ms,object.mass=1}"]);
    assert_eq!(vary.overrides(0), ["coordination.strategy=average-position"]);
    assert_eq!(vary.overrides(1), ["coordination.strategy=local-damping", "coordination.local-damping.damping=58"]);
    assert_eq!(vary.overrides(2), ["coordination.strategy=extrapolated", "coordination.extrapolated.horizon=50ms", "object.mass=1"]);
    assert_eq!(vary.label(1), "coordination.strategy=local-damping{damping=58}");
    assert_eq!((vary.column(), vary.kind()), ("coordination.strategy".to_owned(), Kind::Text));
    for (values, part) in [("a{b}", "is not a strategy with settings"), ("a{b=1},a{ b=1 }", "stands twice")] {
        let error = Variation::parse(&format!("coordination.strategy={values}")).unwrap_err().to_string();
        assert!(error.contains(part) && error.contains("expected"), "{error}");
    }
    // Braces in values of other keys are no settings.
    assert_eq!(Variation::parse("scene.title=a{b}").unwrap().overrides(0), ["scene.title=a{b}"]);
}

#[test]
fn keys_are_the_same_however_they_are_quoted() {
    let vary = Variation::parse("scene.\"seed\"=1,2").unwrap();
    assert!(vary.is_key("scene.seed") && !vary.is_key("scene.count"));
}

properties! {
    /// Every text is read or refused, and the value in the table equals the value in the scene.
    #[test]
    fn no_text_breaks_it(text in "\\PC{0,30}", range in "[a.]{1,3}=[-0-9.e]{1,6}\\.\\.[-0-9.e]{1,6}(ms)?/[0-9]{1,3}(:log)?") {
        for text in [text, range] {
            if let Ok(vary) = Variation::parse(&text) {
                for value in vary.values() {
                    if let Value::Number(number) = value.value {
                        let read = cohaptic_linkfile::number_and_unit(value.text.trim_matches(['"', '\''])).unwrap().0;
                        proptest::prop_assert_eq!((read + 0.0).to_bits(), number.to_bits());
                    }
                }
            }
        }
    }
}
