//! The unit of a key, for axes.

use cohaptic_stability::KeyRange;

/// The key with the unit that its range has, or else that of the key itself: `coordination.stiffness [N/m]`, `link.delay [ms]`.
pub(crate) fn label(range: &KeyRange) -> String {
    let written = Some(range.unit.as_str()).filter(|unit| !unit.is_empty());
    match written.or_else(|| unit(&range.key)) {
        Some(unit) => format!("{} [{unit}]", range.key),
        None => range.key.clone(),
    }
}

/// The unit of the plain numbers of a key; `None` where they have none.
fn unit(key: &str) -> Option<&'static str> {
    let mut words = key.rsplit('.').map(|word| word.trim().trim_matches('"'));
    match words.next().unwrap_or_default() {
        "mass" => Some("kg"),
        "stiffness" => Some("N/m"),
        "damping" => Some("N·s/m"),
        "force" | "amplitude" if words.any(|word| word == "hand") => Some("N"),
        "frequency" => Some("Hz"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_shown_with_its_unit() {
        for (range, shown) in [
            ("coordination.stiffness=0..1", "coordination.stiffness [N/m]"),
            ("peers.left.device.mass=0..1", "peers.left.device.mass [kg]"),
            ("link.delay=0ms..1ms", "link.delay [ms]"),
            ("link.loss=0%..5%", "link.loss [%]"),
            ("scene.count=2..5", "scene.count"),
        ] {
            assert_eq!(label(&KeyRange::parse(range).unwrap()), shown);
        }
    }
}
