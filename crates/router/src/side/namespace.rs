//! Network namespaces: a device is opened inside its namespace, and can then be used from outside.

use std::fs::{self, File};
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

use nix::sched::{CloneFlags, setns};

use super::Failed;

/// Path of the namespace of the calling thread.
const OWN: &str = "/proc/thread-self/ns/net";

/// Folder of the namespaces named by `ip netns`.
const NAMED: &str = "/run/netns";

/// Runs `does` inside a namespace, on this thread alone, and returns to the former namespace. `None`: the namespace stays the same.
pub(super) fn within<T>(namespace: Option<&str>, does: impl FnOnce() -> Result<T, Failed>) -> Result<T, Failed> {
    let Some(namespace) = namespace else { return does() };
    let path = path(namespace);
    let open = |path: &Path| File::open(path).map_err(Failed::system(format!("open the network namespace {}", path.display())));
    // The own namespace is opened first: without it there would be no way back.
    let (own, other) = (open(Path::new(OWN))?, open(&path)?);
    let enter = |to: &File, what: String| setns(to, CloneFlags::CLONE_NEWNET).map_err(|error| Failed::system(what)(error.into()));
    enter(&other, format!("enter the network namespace {}", path.display()))?;
    let done = does();
    enter(&own, "return to the network namespace of the program".to_owned())?;
    done
}

/// Returns whether two namespaces are the same one. A namespace has several names: a name of `ip netns`, the path behind the name, and `None` for the program's
/// own namespace.
pub(super) fn are_one(one: Option<&str>, other: Option<&str>) -> Result<bool, Failed> {
    let identity = |namespace: Option<&str>| {
        let path = namespace.map_or_else(|| PathBuf::from(OWN), path);
        let metadata = fs::metadata(&path).map_err(Failed::system(format!("open the network namespace {}", path.display())))?;
        // Device number and inode identify a namespace.
        Ok((metadata.dev(), metadata.ino()))
    };
    Ok(one == other || identity(one)? == identity(other)?)
}

/// Returns the path of a namespace: with a slash it is a path already, otherwise a name of `ip netns`.
fn path(namespace: &str) -> PathBuf {
    if namespace.contains('/') { PathBuf::from(namespace) } else { Path::new(NAMED).join(namespace) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_looked_for_where_ip_netns_puts_it_and_a_path_is_a_path() {
        assert_eq!(path("blue"), Path::new("/run/netns/blue"));
        assert_eq!(path("/proc/1/ns/net"), Path::new("/proc/1/ns/net"));
    }

    #[test]
    fn a_namespace_that_is_not_there_is_named() {
        let error = within(Some("/no/such/namespace"), || Ok(())).unwrap_err();
        assert!(error.to_string().starts_with("cannot open the network namespace /no/such/namespace: "), "{error}");
    }
}
