//! Random pictures.

use cohaptic_picture::testing::faults;
use cohaptic_picture::{Axis, Band, Fill, HeatMap, LegendPlace, Line, Look, Marker, Panel, Picture, Region, Rug, Size};
use cohaptic_tests_common::properties;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

fn words() -> impl Strategy<Value = String> {
    prop_oneof![
        "[a-zA-Z0-9 .,=_<>&\"'%μ·°→]{0,60}",
        "([a-z]{1,12} ){0,40}",
        "[W@M]{0,80}",
        proptest::collection::vec(any::<char>(), 0..40).prop_map(|letters| letters.into_iter().collect()),
    ]
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![4 => -100.0..100.0, 1 => Just(0.0), 1 => any::<f64>(), 1 => 1e-12..1e-6, 1 => 1e5..1e12]
}

fn points() -> impl Strategy<Value = Vec<(f64, f64)>> {
    proptest::collection::vec((number(), number()), 0..40)
}

fn axis() -> impl Strategy<Value = Axis> {
    (words(), prop_oneof![Just(""), Just("K_T"), Just("x_{long name}^2")], prop_oneof![Just(""), Just("N·s/m")], 0..5_u8, number(), number())
        .prop_map(|(name, symbol, unit, kind, low, high)| {
            let axis = Axis::new(name).symbol(symbol).unit(unit);
            match kind {
                0 => axis.logarithmic(),
                1 => axis.range(low, high),
                2 => axis.multiples_of(45).ends_at_ticks(),
                3 => axis.include(low).tight(),
                _ => axis,
            }
        })
}

fn panel() -> impl Strategy<Value = Panel> {
    let lines = proptest::collection::vec((points(), words()), 0..6);
    (axis(), axis(), words(), lines, any::<bool>(), any::<bool>()).prop_map(|(x, y, title, lines, at_ends, has_map)| {
        let mut panel = Panel::new(x.clone(), y).titled(title);
        if has_map {
            panel = panel.with(HeatMap::new(&[0.0, 1.0], &[1.0], vec![vec![1.0, 2.0]], x));
        }
        for (number, (points, name)) in lines.into_iter().enumerate() {
            panel = match number % 4 {
                1 => panel.with(Band::new(points.iter().map(|(x, y)| (*x, *y, y + 1.0)), Fill::Tint(number)).named(name)),
                2 => panel.with(Region::new([points], Fill::Hatch).named(name)),
                3 => panel.with(Rug::new(points.into_iter().map(|(x, _)| x), Look::of(number)).named(name)),
                _ => panel.with(Line::new(points, Look::of(number)).marked(Marker::of(number)).named(name)),
            };
        }
        if at_ends { panel.labels_at_ends() } else { panel }
    })
}

fn picture() -> impl Strategy<Value = Picture> {
    let size = prop_oneof![
        Just(Size::ONE_COLUMN),
        Just(Size::TWO_COLUMNS),
        Just(Size::PAGE),
        (160.0..1500.0, 100.0..1200.0).prop_map(|(width, height)| Size::pixels(width, height).unwrap()),
    ];
    let legend = prop_oneof![Just(LegendPlace::Below), Just(LegendPlace::Right), Just(LegendPlace::Nowhere)];
    (words(), words(), size, proptest::collection::vec(panel(), 0..5), 1..4_usize, any::<(bool, bool)>(), legend).prop_map(
        |(title, note, size, panels, columns, (shared_x, shared_y), legend)| {
            let picture = Picture::new(title).note(note).size(size).panels(panels).columns(columns).legend(legend);
            let picture = if shared_x { picture.shared_x() } else { picture };
            if shared_y { picture.shared_y() } else { picture }
        },
    )
}

properties! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, rng_seed: RngSeed::Fixed(15), ..ProptestConfig::default() })]

    #[test]
    fn whatever_is_drawn_no_text_is_outside_or_on_another(picture in picture()) {
        let svg = picture.svg();
        let found = faults(&svg);
        prop_assert!(found.is_empty(), "{}", found.join("\n"));
        prop_assert_eq!(picture.svg(), svg);
    }
}

#[test]
fn the_check_sees_texts_that_are_outside_or_on_each_other() {
    let svg = |text: &str| format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 100 50\">{text}</svg>");
    assert!(faults(&svg("<text x=\"10\" y=\"20\" font-size=\"10\">fits</text>")).is_empty());
    assert_eq!(faults(&svg("<text x=\"10\" y=\"20\" font-size=\"10\">this is far too long</text>")).len(), 1);
    assert_eq!(faults(&svg("<text x=\"10\" y=\"20\" font-size=\"10\">one</text><text x=\"15\" y=\"22\" font-size=\"10\">two</text>")).len(), 1);
    assert_eq!(faults(&svg("<path d=\"M1.234,0\"/>")).len(), 1);
    assert_eq!(faults(&svg("<text>")).len(), 1);
}

#[test]
fn titles_and_labels_wrap_and_are_whole() {
    let title = "Section 5.1: two of three users, with arms, with coordination.strategy=proportional-derivative: position of each copy";
    let picture =
        Picture::new(title).size(Size::ONE_COLUMN).panel(Panel::new(Axis::new("Coordination stiffness").symbol("K_T").unit("N/m"), Axis::new("y")));
    let svg = picture.svg();
    for word in title.split(' ') {
        assert!(svg.split_once("</desc>").unwrap().1.contains(word), "{word}");
    }
    assert!(svg.contains("<tspan font-style=\"italic\">K</tspan><tspan dy=\"1.71\" font-size=\"7.47\">T</tspan>"), "{svg}");
}
