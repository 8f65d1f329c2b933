//! Contrast of the pages' colours on a light and on a dark background, by the Web Content Accessibility Guidelines 2.2: 4.5:1 for text (success criterion
//! 1.4.3), and 3:1 for drawings and for borders of controls (1.4.11).

use std::collections::BTreeMap;

const STYLE: &str = include_str!("../../page/style.css");

/// Pairs of a text colour and its background, by their names in the style sheet.
const TEXT: [(&str, &str); 16] = [
    ("ink", "card"),
    ("ink", "ground"),
    ("ink", "accent-ground"),
    ("soft", "card"),
    ("soft", "ground"),
    ("soft", "line"),
    ("soft", "accent-ground"),
    ("accent", "card"),
    ("accent", "ground"),
    ("good", "card"),
    ("good", "good-ground"),
    ("warn", "warn-ground"),
    ("bad", "card"),
    ("bad", "bad-ground"),
    // Buttons and pressed buttons.
    ("card", "accent"),
    ("card", "good"),
];

/// Pairs of the colour of a drawing or of a control's border, and the background.
const DRAWN: [(&str, &str); 15] = [
    ("c0", "card"),
    ("c1", "card"),
    ("c2", "card"),
    ("c3", "card"),
    ("c4", "card"),
    ("c5", "card"),
    ("c6", "card"),
    ("c7", "card"),
    ("accent", "card"),
    ("accent", "ground"),
    ("bad", "card"),
    ("soft", "card"),
    ("ink", "card"),
    ("faint", "card"),
    ("faint", "ground"),
];

/// Reads the colours of a part of the style sheet by name: `--name: #rrggbb`.
fn colours(style: &str) -> BTreeMap<&str, [u8; 3]> {
    let declared = style.split("--").skip(1).filter_map(|rest| rest.split_once(": #"));
    let is_name = |name: &str| name.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'-');
    declared
        .filter(|(name, _)| is_name(name))
        .map(|(name, rest)| {
            let digits: Vec<u8> = rest.bytes().map_while(|byte| char::from(byte).to_digit(16)).map(|digit| u8::try_from(digit).unwrap()).collect();
            let channel = |place: usize| if digits.len() == 3 { 17 * digits[place] } else { 16 * digits[2 * place] + digits[2 * place + 1] };
            (name, [channel(0), channel(1), channel(2)])
        })
        .collect()
}

/// Returns the relative luminance of WCAG 2.2, from 0 to 1.
fn luminance(colour: [u8; 3]) -> f64 {
    let linear = |channel: u8| {
        let share = f64::from(channel) / 255.0;
        if share <= 0.04045 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
    };
    let [red, green, blue] = colour.map(linear);
    0.2126 * red + 0.7152 * green + 0.0722 * blue
}

/// Returns the contrast of two colours, from 1 to 21.
fn contrast(one: [u8; 3], other: [u8; 3]) -> f64 {
    let (one, other) = (luminance(one), luminance(other));
    (one.max(other) + 0.05) / (one.min(other) + 0.05)
}

#[test]
fn the_ratio_is_that_of_the_guidelines() {
    assert!((contrast([255; 3], [0; 3]) - 21.0).abs() < 1e-12);
    assert!((contrast([7, 8, 9], [7, 8, 9]) - 1.0).abs() < 1e-12);
    // The lightest grey accepted as text on white is #767676 with 4.54; #777777 has 4.48.
    assert!(contrast([0x76; 3], [255; 3]) > 4.5 && contrast([0x77; 3], [255; 3]) < 4.5);
}

#[test]
fn colours_are_told_from_their_ground() {
    let (light, dark) = STYLE.split_once("@media (prefers-color-scheme: dark)").unwrap();
    let mut weak = Vec::new();
    for (scheme, style) in [("light", light), ("dark", dark)] {
        let colours = colours(style);
        assert_eq!(colours.len(), 23, "{scheme}: {:?}", colours.keys());
        for (pairs, least) in [(&TEXT[..], 4.5), (&DRAWN[..], 3.0)] {
            for (one, ground) in pairs {
                let ratio = contrast(colours[one], colours[ground]);
                if ratio < least {
                    weak.push(format!("{scheme}: {one} on {ground} has {ratio:.2}, expected {least}"));
                }
            }
        }
    }
    assert_eq!(weak, [""; 0]);
}
