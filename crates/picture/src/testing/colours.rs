//! Checks the contrast of the colours in style sheets, on a light and on a dark background.
//!
//! The contrast of two colours is that of the Web Content Accessibility Guidelines 2.2: (L₁ + 0.05) / (L₂ + 0.05), with the relative luminances L₁ ≥ L₂.
//! The least contrast is 4.5 for text (criterion 1.4.3), and 3 for parts needed to understand a picture (1.4.11).

use std::collections::BTreeMap;

/// Least contrast of text.
const TEXT: f64 = 4.5;
/// Least contrast of lines, markers and areas.
const LINE: f64 = 3.0;

/// Returns the faults in the colours of all pictures and pages as sentences; empty without a fault. A fault is a colour of the light style not replaced by
/// the dark style, or a colour with too little contrast to the background.
///
/// Backgrounds, and lines that only guide the eye (grid of a plot, borders of a table), need no contrast.
#[must_use]
pub fn colour_faults() -> Vec<String> {
    let picture = of_style(&crate::look::style(), "paper", &["paper", "grid"], |name| ["ink", "quiet"].contains(&name));
    let page = of_style(crate::page::STYLE, "--ground", &["--ground", "--line"], |_| true);
    picture.into_iter().chain(page).collect()
}

fn of_style(style: &str, ground: &str, guides: &[&str], is_text: impl Fn(&str) -> bool) -> Vec<String> {
    let (light, dark) = style.split_once("@media (prefers-color-scheme: dark)").unwrap_or((style, ""));
    let (light, dark) = (colours(light), colours(dark));
    let mut faults = Vec::new();
    for (mode, colours, others) in [("light", &light, &dark), ("dark", &dark, &light)] {
        let Some(below) = colours.get(ground).and_then(|colour| luminance(colour)) else {
            faults.push(format!("{mode}: there is no ground {ground}"));
            continue;
        };
        for (name, colour) in colours {
            let Some(own) = luminance(colour) else {
                faults.push(format!("{mode}: {name} is {colour}, which is no colour of three or six digits"));
                continue;
            };
            if others.get(name).is_none_or(|other| other == colour) {
                faults.push(format!("{mode}: {name} is {colour}, and no other colour in the other mode"));
            }
            let least = if is_text(name) { TEXT } else { LINE };
            let ratio = ratio(own, below);
            if ratio < least && !guides.contains(&name.as_str()) {
                faults.push(format!("{mode}: {name} is {colour}, with a contrast of {ratio:.2} to the ground: expected at least {least}"));
            }
        }
    }
    faults
}

/// Returns the colours of a style sheet, by the last class of their selector or by the name of a variable. A class has a single colour.
fn colours(style: &str) -> BTreeMap<String, String> {
    let mut colours = BTreeMap::new();
    for rule in style.split('}') {
        let Some((selector, declarations)) = rule.rsplit_once('{') else { continue };
        let class = selector.rsplit(['.', '{', '\n']).next().unwrap_or_default().trim();
        for declaration in declarations.split(';') {
            let Some((property, value)) = declaration.split_once(':') else { continue };
            let (property, value) = (property.trim(), value.trim());
            if value.starts_with('#') {
                let name = if property.starts_with("--") { property } else { class };
                colours.insert(name.to_owned(), value.to_owned());
            }
        }
    }
    colours
}

/// Returns the contrast of two colours such as `#777` and `#14181d`, from 1 to 21; `None` for a colour in another notation.
#[must_use]
pub fn contrast(one: &str, other: &str) -> Option<f64> {
    Some(ratio(luminance(one)?, luminance(other)?))
}

fn ratio(one: f64, other: f64) -> f64 {
    (one.max(other) + 0.05) / (one.min(other) + 0.05)
}

fn luminance(colour: &str) -> Option<f64> {
    let digits = colour.strip_prefix('#')?;
    let parts: Vec<&str> = match digits.len() {
        3 => (0..3).map(|place| digits.get(place..=place)).collect::<Option<_>>()?,
        6 => (0..3).map(|place| digits.get(2 * place..2 * place + 2)).collect::<Option<_>>()?,
        _ => return None,
    };
    let linear = |part: &str| {
        let value = u8::from_str_radix(part, 16).ok()?;
        let share = f64::from(if part.len() == 1 { 17 * value } else { value }) / 255.0;
        Some(if share <= 0.040_45 { share / 12.92 } else { libm::pow((share + 0.055) / 1.055, 2.4) })
    };
    Some(0.2126 * linear(parts[0])? + 0.7152 * linear(parts[1])? + 0.0722 * linear(parts[2])?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Black on white has the contrast 21 by the formula. #777 on white has 4.48, as in the tables of the guidelines.
    #[test]
    fn contrasts_are_those_of_the_guidelines() {
        for (one, other, expected) in [("#000", "#ffffff", 21.0), ("#777", "#fff", 4.48), ("#777777", "#fff", 4.48), ("#abc", "#aabbcc", 1.0)] {
            let found = contrast(one, other).unwrap();
            assert!((found - expected).abs() < 5e-3, "{one} {other}: {found}");
        }
        assert_eq!(contrast("red", "#fff"), None);
    }

    #[test]
    fn every_colour_is_seen_on_both_grounds() {
        assert_eq!(colour_faults(), [""; 0]);
    }

    #[test]
    fn the_check_sees_what_is_faint_and_what_has_no_counterpart() {
        let found = |style: &str| of_style(style, "--ground", &["--ground"], |name| name == "--ink");
        let good = ":root { --ground: #fff; --ink: #222; --a: #888; }\n@media (prefers-color-scheme: dark) { :root { --ground: #111; --ink: #eee; --a: #999; } }";
        assert_eq!(found(good), [""; 0]);
        // #888 on white has a contrast of 3.5, enough for a line and too little for text.
        for (old, new, expected) in [
            ("--ink: #222", "--ink: #888", "light: --ink is #888, with a contrast of 3.54"),
            ("--a: #888", "--a: #aaa", "light: --a is #aaa, with a contrast of 2.32"),
            (" --a: #999;", "", "light: --a is #888, and no other colour"),
            ("--a: #999", "--a: #888", "light: --a is #888, and no other colour"),
            ("--ground: #111", "--ground: #888", "dark: --a is #999, with a contrast of 1.2"),
            ("--ink: #eee", "--ink: #eeee", "dark: --ink is #eeee, which is no colour"),
        ] {
            let style = good.replace(old, new);
            assert!(found(&style).iter().any(|fault| fault.starts_with(expected)), "{expected}: {:?}", found(&style));
        }
    }
}
