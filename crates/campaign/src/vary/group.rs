//! A strategy with settings, `NAME{KEY=VALUE,…}`, as one value of `coordination.strategy`.

use super::commas::split_at_commas;

/// A name with settings: one value of a list.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Group {
    /// Value of the key itself.
    pub(super) name: String,
    /// Settings as overrides `KEY=VALUE` with dotted paths, in written order.
    pub(super) settings: Vec<String>,
    /// The written value without needless space.
    pub(super) text: String,
}

impl Group {
    /// Reads a value with settings. `Ok(None)`: the value has no settings. `Err`: the braces do not hold `KEY=VALUE` separated by commas.
    ///
    /// A key without a dot is a parameter in the name's own table beside `key`: for `coordination.strategy`, a key of `coordination.NAME`. A dotted path is any
    /// key of the scene.
    pub(super) fn parse(key: &str, text: &str) -> Result<Option<Self>, ()> {
        let Some((name, rest)) = text.split_once('{').filter(|(name, _)| !name.trim().is_empty() && !name.contains(['"', '\''])) else {
            return Ok(None);
        };
        let name = name.trim();
        let inside = rest.strip_suffix('}').ok_or(())?.trim();
        if inside.is_empty() {
            return Ok(Some(Self { name: name.to_owned(), settings: Vec::new(), text: name.to_owned() }));
        }
        let (mut settings, mut words) = (Vec::new(), Vec::new());
        for part in split_at_commas(inside) {
            let (own, value) = part.split_once('=').ok_or(())?;
            let (own, value) = (own.trim(), value.trim());
            if own.is_empty() || value.is_empty() {
                return Err(());
            }
            settings.push(if own.contains('.') { format!("{own}={value}") } else { format!("{}{name}.{own}={value}", table_of(key)) });
            words.push(format!("{own}={value}"));
        }
        Ok(Some(Self { name: name.to_owned(), settings, text: format!("{name}{{{}}}", words.join(",")) }))
    }
}

/// Returns the dotted path of a key's table, including the dot at its end.
fn table_of(key: &str) -> &str {
    key.rfind('.').map_or("", |dot| &key[..=dot])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(text: &str) -> Result<Option<Group>, ()> {
        Group::parse("coordination.strategy", text)
    }

    #[test]
    fn settings_are_keys_of_the_own_table_or_dotted_paths() {
        let found = group("extrapolated { horizon = 50ms, coordination.damping=0 }").unwrap().unwrap();
        assert_eq!(found.name, "extrapolated");
        assert_eq!(found.settings, ["coordination.extrapolated.horizon=50ms", "coordination.damping=0"]);
        assert_eq!(found.text, "extrapolated{horizon=50ms,coordination.damping=0}");
        assert_eq!(group("wave{on-loss=\"a,b\"}").unwrap().unwrap().settings, ["coordination.wave.on-loss=\"a,b\""]);
    }

    #[test]
    fn values_without_settings_are_no_groups() {
        for text in ["average-position", "\"a{b}\"", "{ force = 1 }", "[1, 2]", "'x'"] {
            assert_eq!(group(text), Ok(None), "{text}");
        }
        // Empty braces are no settings.
        assert_eq!(group("wave{ }").unwrap().unwrap(), Group { name: "wave".to_owned(), settings: Vec::new(), text: "wave".to_owned() });
    }

    #[test]
    fn braces_with_anything_else_are_refused() {
        for text in ["wave{", "wave{b}", "wave{b=}", "wave{=1}", "wave{b=1,}", "wave{b=1}x"] {
            assert_eq!(group(text), Err(()), "{text}");
        }
    }
}
