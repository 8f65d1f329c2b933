//! Refusals of the system in words, with the responsible setting.

use std::fs;
use std::io;
use std::path::Path;

use cohaptic_router::Failed;

/// Setting of the system about namespaces of ordinary users.
struct Setting {
    /// File below `/proc/sys`.
    file: &'static str,
    /// `true` if zero forbids namespaces, `false` if every other value forbids namespaces.
    zero_forbids: bool,
    /// Value that allows namespaces.
    allows: &'static str,
    /// Systems that forbid namespaces by default.
    known_from: &'static str,
}

const SETTINGS: [Setting; 3] = [
    Setting { file: "kernel/apparmor_restrict_unprivileged_userns", zero_forbids: false, allows: "0", known_from: "Ubuntu from 23.10 on" },
    Setting { file: "kernel/unprivileged_userns_clone", zero_forbids: true, allows: "1", known_from: "Debian before 12" },
    Setting { file: "user/max_user_namespaces", zero_forbids: true, allows: "10000", known_from: "hardened systems" },
];

/// Returns the words for a refused step, with the way out.
pub(super) fn words(what: &str, error: &io::Error) -> String {
    let refused = format!("cannot {what}: {error}");
    if what.contains("/dev/net/tun") {
        return format!(
            "{refused}\n/dev/net/tun must exist (`modprobe tun`; in a container `--device /dev/net/tun`) and be open to you; `cohaptic relay`, for UDP or with `--tcp`, needs no device"
        );
    }
    let is_refusal = matches!(
        error.kind(),
        io::ErrorKind::PermissionDenied | io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::Unsupported
    ) || error.raw_os_error() == Some(nix::errno::Errno::EINVAL as i32)
        || error.raw_os_error() == Some(nix::errno::Errno::ENOSPC as i32);
    if is_refusal { format!("{refused}\n{}", way_out(Path::new("/proc/sys"))) } else { refused }
}

/// Returns the words for a kernel that does not lead packets of a host to itself into a device, with the way out.
pub(super) fn of_loopback(failed: &Failed) -> String {
    format!(
        "{failed}\n--loopback needs a kernel with several tables of routes (CONFIG_IP_MULTIPLE_TABLES); without --loopback, the command reaches a server that \
        is started beside it by the name host"
    )
}

/// Returns the settings under `folder` that forbid namespaces, each with the command to allow namespaces, and an alternative without namespaces.
fn way_out(folder: &Path) -> String {
    let forbids = |setting: &Setting| {
        let value: u64 = fs::read_to_string(folder.join(setting.file)).ok()?.trim().parse().ok()?;
        let Setting { file, zero_forbids, allows, known_from } = setting;
        ((value == 0) == *zero_forbids).then(|| format!("`sysctl -w {}={allows}` ({known_from})", file.replace('/', ".")))
    };
    let found: Vec<String> = SETTINGS.iter().filter_map(forbids).collect();
    let first = if found.is_empty() {
        "this system, or the container around it, does not allow namespaces to this user; root may make them, and a container with `--privileged`"
            .to_owned()
    } else {
        format!("this system does not allow namespaces to ordinary users. As root, allow them with {}", found.join(" and "))
    };
    format!("{first}; without namespaces, `cohaptic relay` passes datagrams of UDP, and with `--tcp` connections")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_setting_in_the_way_is_named() {
        let folder = std::env::temp_dir().join(format!("cohaptic-refusal-{}", std::process::id()));
        let set = |file: &str, value: &str| {
            fs::create_dir_all(folder.join(file).parent().unwrap()).unwrap();
            fs::write(folder.join(file), value).unwrap();
        };
        assert!(way_out(&folder).starts_with("this system, or the container around it,"));
        set("kernel/apparmor_restrict_unprivileged_userns", "1\n");
        set("user/max_user_namespaces", "7000\n");
        let text = way_out(&folder);
        assert!(text.contains("`sysctl -w kernel.apparmor_restrict_unprivileged_userns=0`") && !text.contains("max_user"), "{text}");
        set("user/max_user_namespaces", "0\n");
        set("kernel/unprivileged_userns_clone", "0\n");
        let text = way_out(&folder);
        assert!(
            text.contains("user.max_user_namespaces=10000") && text.contains("kernel.unprivileged_userns_clone=1") && text.contains("cohaptic relay"),
            "{text}"
        );
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_missing_device_is_another_matter() {
        let error = io::Error::from_raw_os_error(13);
        assert!(words("open it through /dev/net/tun", &error).contains("modprobe tun"));
        assert!(words("make namespaces", &error).contains("cohaptic relay"));
        assert_eq!(words("make namespaces", &io::ErrorKind::OutOfMemory.into()), "cannot make namespaces: out of memory");
    }
}
