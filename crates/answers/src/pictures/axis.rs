//! Names, symbols and units of keys along an axis, as in the paper.

use cohaptic_picture::Axis;
use cohaptic_stability::KeyRange;

/// Returns the key with the unit of its range, or else with the unit of the key: `coordination.stiffness [N/m]`, `link.delay [ms]`.
pub(crate) fn label(range: &KeyRange) -> String {
    match shown_unit(&range.key, &range.unit) {
        Some(unit) => format!("{} [{unit}]", range.key),
        None => range.key.clone(),
    }
}

/// Returns the axis of a picture over a key: `Coordination stiffness K_T [N/m]`. A key without a symbol in the paper keeps the name of the key.
#[must_use]
pub fn axis_of(range: &KeyRange) -> Axis {
    axis_of_key(&range.key, &range.unit)
}

/// Like [`axis_of`], for a key with values in the given unit, possibly empty.
pub(crate) fn axis_of_key(key: &str, unit: &str) -> Axis {
    let named = NAMES.iter().find(|(known, _, _)| *known == key.trim());
    let axis = named.map_or_else(|| Axis::new(key), |(_, name, symbol)| Axis::new(*name).symbol(symbol));
    axis.unit(shown_unit(key, unit).unwrap_or_default())
}

/// Keys, names, and symbols of Rakhsha & Constantinescu 2015. N is the number of users, T_d the delay one way.
const NAMES: [(&str, &str, &str); 10] = [
    ("coordination.stiffness", "Coordination stiffness", "K_T"),
    ("coordination.damping", "Coordination damping", "B_T"),
    ("peer.coupling.stiffness", "Coupling stiffness", "K_C"),
    ("peer.coupling.damping", "Coupling damping", "B_C"),
    ("object.mass", "Mass of the object", "m_O"),
    ("peer.device.mass", "Mass of the device", "m_H"),
    ("scene.count", "Number of users", "N"),
    ("link.delay", "Delay of links", "T_d"),
    ("link.loss", "Loss on links", ""),
    ("link.jitter", "Jitter of links", ""),
];

fn shown_unit<'a>(key: &str, given: &'a str) -> Option<&'a str> {
    // The unit of the range goes before the unit of the key: `40ms` is in milliseconds.
    Some(given).filter(|unit| !unit.is_empty()).or_else(|| unit(key))
}

/// Returns the unit of a key's plain numbers; `None` for a key without a unit.
fn unit(key: &str) -> Option<&'static str> {
    let mut words = key.rsplit('.').map(|word| word.trim().trim_matches('"'));
    match words.next().unwrap_or_default() {
        "mass" => Some("kg"),
        "stiffness" => Some("N/m"),
        "damping" => Some("N·s/m"),
        // Only force and amplitude of a hand are in newtons.
        "force" | "amplitude" if words.any(|word| word == "hand") => Some("N"),
        "frequency" => Some("Hz"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_scene::Scene;

    use super::*;

    /// Source of the symbols: the table in docs/model.md, taken from the paper.
    #[test]
    fn an_axis_has_the_name_symbol_and_unit_of_the_paper() {
        let of = |range: &str| axis_of(&KeyRange::parse(range).unwrap());
        assert_eq!(of("coordination.stiffness=0..1"), Axis::new("Coordination stiffness").symbol("K_T").unit("N/m"));
        assert_eq!(of("link.delay=0ms..1ms"), Axis::new("Delay of links").symbol("T_d").unit("ms"));
        assert_eq!(of("peers.left.device.mass=0..1"), Axis::new("peers.left.device.mass").unit("kg"));
    }

    #[test]
    fn every_key_with_a_name_is_one_of_a_scene() {
        let text = "scene = { duration = '1s', count = 2 }\nobject.mass = 1.0\n\
            coordination = { strategy = 'average-position', stiffness = 1.0, damping = 1.0, update = '8ms' }\n\
            peer = { device = { mass = 1.0, damping = 1.0 }, coupling = { stiffness = 1.0, damping = 1.0 } }\nlink.delay = '8ms'\n";
        for (key, ..) in NAMES {
            let value = if ["link.delay", "link.jitter"].contains(&key) {
                "3ms"
            } else if key == "link.loss" {
                "3%"
            } else {
                "3"
            };
            let scene = Scene::parse(text, "scene.toml".as_ref(), &[format!("{key}={value}")]);
            assert!(scene.is_ok(), "{key}: {scene:?}");
        }
    }

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
