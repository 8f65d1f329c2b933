//! Reader of the access lines of a peer: `access`, a link of the library, and the keys of `uplink` and `downlink` laid over the link of the library.

use std::borrow::Cow;
use std::sync::Arc;

use cohaptic_linkfile::document::{Entry, Node, Table, Value, join};
use cohaptic_linkfile::library::{Direction, ProfileName};
use cohaptic_linkfile::link::read_link;
use cohaptic_linkfile::reading::{Context, TableReader, values};
use cohaptic_linkfile::schema::link::LINK_TABLE;
use cohaptic_linkfile::schema::{Form, Key, optional};
use cohaptic_wan::LinkModel;

/// Keys of the access lines of a peer.
pub(super) const ACCESS: [Key; 3] = [
    optional(
        "access",
        Form::Like(&["starlink", "none"]),
        "Access lines of the peer from the library of links; the keys of uplink and downlink are laid over those lines",
    ),
    optional("uplink", Form::Table(&LINK_TABLE), "Access line that every packet of the peer passes before the links"),
    optional("downlink", Form::Table(&LINK_TABLE), "Access line that every packet to the peer passes after the links"),
];

/// Access lines of a peer.
#[derive(Clone, Debug)]
pub(super) struct Access {
    pub(super) uplink: Option<Arc<LinkModel>>,
    pub(super) downlink: Option<Arc<LinkModel>>,
}

/// Reads the access lines of a peer. Returns `None` after a fault.
pub(super) fn read_access(table: &mut TableReader<'_>, context: Context<'_>) -> Option<Access> {
    let named = table.entry("access").map(|entry| read_name(entry, context));
    let line = |table: &mut TableReader<'_>, key: &'static str, direction: Direction| {
        // After a refused name the other keys are read without a link below them, so that their faults are found too.
        let below = named.as_ref().and_then(|named| named.as_ref()?.as_ref()).map(|(entry, name)| profile_of(entry, name, key, direction));
        let node = match (table.get(key), below) {
            (Some(own), Some(below)) => Cow::Owned(own.over(&below, &[])),
            (Some(own), None) => Cow::Borrowed(own),
            (None, Some(below)) => Cow::Owned(below),
            (None, None) => return Some(None),
        };
        read_link(&node, context).map(Arc::new).map(Some)
    };
    let (uplink, downlink) = (line(table, "uplink", Direction::Up), line(table, "downlink", Direction::Down));
    let named_well = named.is_none_or(|named| named.is_some());
    Some(Access { uplink: uplink?, downlink: downlink? }).filter(|_| named_well)
}

/// Reads the name of a link of the library. Returns `Some(None)` for `"none"`.
fn read_name<'a>(entry: &'a Entry, context: Context<'_>) -> Option<Option<(&'a Entry, String)>> {
    let text = values::text(&entry.node, context, "the name of a link of the library, such as \"starlink\", or \"none\"")?;
    if text == "none" {
        return Some(None);
    }
    let name = match text.parse::<ProfileName>() {
        Ok(name) => name,
        Err(error) => {
            context.fault_at(&entry.node, error.to_string());
            return None;
        }
    };
    if name.direction.is_some() {
        context.fault_at(&entry.node, format!("an access line has both directions: expected \"{}\"", name.profile.title()));
        return None;
    }
    Some(Some((entry, name.profile.title())))
}

/// Returns the keys of one access line from the library: the key `profile` alone, at the place where the user wrote `access`.
fn profile_of(access: &Entry, name: &str, key: &str, direction: Direction) -> Node {
    let place = access.node.place;
    // The path has another parent than the paths of the keys under `uplink`. Keys of another table are laid over the profile, so the keys of `uplink` are.
    let path = access.node.path.clone();
    let profile = Node { value: Value::Text(format!("{name}/{}", direction.word())), place, path: join(&path, "profile") };
    let entry = Entry { name: "profile".to_owned(), key: access.key, node: Arc::new(profile) };
    let parent = path.rsplit_once('.').map_or("", |(parent, _)| parent);
    Node { value: Value::Table(Table(vec![entry])), place, path: join(parent, key) }
}
