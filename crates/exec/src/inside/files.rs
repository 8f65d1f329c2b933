//! Files of a host inside, in place of the machine's: names of hosts, the name server, and settings of the network.

use std::fs::{self, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use nix::mount::{MsFlags, mount};

use super::refusal;
use super::setup::Setup;

const NONE: Option<&str> = None;

/// Keeps later mounts of this namespace away from the machine.
pub(super) fn mount_privately() -> io::Result<()> {
    Ok(mount(NONE, "/", NONE, MsFlags::MS_REC | MsFlags::MS_PRIVATE, NONE)?)
}

/// Mounts a view of the processes of this namespace. Containers can forbid the mount; in the former /proc each process still finds itself (/proc/self).
pub(super) fn mount_processes() {
    let flags = MsFlags::MS_NOSUID | MsFlags::MS_NODEV | MsFlags::MS_NOEXEC;
    let _ = mount(Some("proc"), "/proc", Some("proc"), flags, NONE);
}

/// Lets the command send echo requests and listen at low ports. Nobody else uses the network. Where /proc/sys cannot be written, as in some containers, the
/// command has the rights of its user.
pub(super) fn allow_ordinary_users() {
    let group = nix::unistd::getegid();
    let _ = fs::write("/proc/sys/net/ipv4/ping_group_range", format!("{group} {group}"));
    let _ = fs::write("/proc/sys/net/ipv4/ip_unprivileged_port_start", "0");
}

/// Replaces /etc/hosts, /etc/resolv.conf and the line of hosts in /etc/nsswitch.conf. The error names the failed step in words.
pub(super) fn name_hosts(setup: &Setup) -> Result<(), String> {
    // Names stand for addresses of IPv4 alone. Many servers listen only there, and clients that try IPv6 first would be refused once.
    let v4 = || setup.addresses.iter().map(|network| network.address()).filter(|address| address.is_ipv4());
    let own = setup.name.iter().flat_map(|name| v4().map(move |address| (address, name.clone())));
    let names: Vec<String> = setup.hosts.iter().cloned().chain(own).map(|(address, name)| format!("{address}\t{name}\n")).collect();
    // Names of the machine stay known. Names of the network come first, because the first entry of a name counts.
    replace("/etc/hosts", |text| format!("{}{}", names.concat(), text))?;
    let server = setup.name_server.map_or_else(String::new, |address| format!("nameserver {address}\n"));
    replace("/etc/resolv.conf", |_| server)?;
    replace("/etc/nsswitch.conf", plain_names)
}

/// Returns the text of /etc/nsswitch.conf in which host names come from the files and the name server alone. Other services, such as that of systemd, answer
/// over sockets of the machine, past the link.
fn plain_names(text: &str) -> String {
    text.lines().map(|line| if line.trim_start().starts_with("hosts:") { "hosts: files dns\n".to_owned() } else { format!("{line}\n") }).collect()
}

/// Puts another text in the place of a file of the machine, for this namespace alone. A missing file is not made.
fn replace(path: &str, change: impl FnOnce(&str) -> String) -> Result<(), String> {
    if !Path::new(path).exists() {
        return Ok(());
    }
    // Bytes that are not UTF-8 occur only in comments of these files, so replacing such bytes changes no meaning.
    let text = fs::read(path).map_err(|error| format!("cannot read {path}: {error}"))?;
    // A full disk or a closed folder has nothing to do with namespaces, about which `refusal` advises.
    let folder = std::env::temp_dir();
    let own = write_temporary(&folder, &change(&String::from_utf8_lossy(&text)));
    let own = own.map_err(|error| format!("cannot write a copy of {path} into {}: {error}; TMPDIR names another folder", folder.display()))?;
    let mounted = mount(Some(&own), path, NONE, MsFlags::MS_BIND, NONE);
    // The mount keeps the content; the name is needed no longer.
    let _ = fs::remove_file(&own);
    mounted.map_err(|error| refusal::words(&format!("replace {path}"), &error.into()))
}

/// Writes a file for all readers into `folder`, under an unused name. An error leaves no file.
fn write_temporary(folder: &Path, text: &str) -> io::Result<PathBuf> {
    for number in 0..u32::MAX {
        let path = folder.join(format!("cohaptic-{}-{number}", std::process::id()));
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            Ok(mut file) => {
                let written = file.write_all(text.as_bytes());
                let done = written.and_then(|()| fs::set_permissions(&path, std::os::unix::fs::PermissionsExt::from_mode(0o644)));
                if done.is_err() {
                    let _ = fs::remove_file(&path);
                }
                return done.map(|()| path);
            }
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
        }
    }
    Err(io::ErrorKind::AlreadyExists.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn host_names_come_from_files_and_the_name_server_alone() {
        let text = "passwd: files systemd\nhosts:          files resolve [!UNAVAIL=return] dns\nservices: db files\n";
        assert_eq!(plain_names(text), "passwd: files systemd\nhosts: files dns\nservices: db files\n");
    }

    #[test]
    fn temporary_files_do_not_meet() {
        let [one, other] = [(); 2].map(|()| write_temporary(&std::env::temp_dir(), "text").unwrap());
        assert_ne!(one, other);
        for path in [one, other] {
            assert_eq!(fs::read_to_string(&path).unwrap(), "text");
            fs::remove_file(path).unwrap();
        }
    }
}
