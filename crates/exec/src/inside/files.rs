//! Files of a host inside, in place of the machine's: names of hosts, the name server, and settings of the network.

use core::net::{IpAddr, Ipv4Addr};
use std::fs::{self, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use nix::mount::{MsFlags, mount};

use super::refusal;
use super::setup::Setup;

const NONE: Option<&str> = None;
/// Name of the loopback interface in all systems.
const LOCALHOST: &str = "localhost";

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
    let own = setup.loopback.then(rustix::system::uname);
    let own = own.as_ref().map(|system| system.nodename().to_string_lossy());
    // Names of the machine stay known. Names of the network come first, because the first entry of a name counts.
    replace("/etc/hosts", |text| format!("{}{}", names.concat(), own.map_or_else(|| text.to_owned(), |own| names_of_itself(text, &own))))?;
    let server = setup.name_server.map_or_else(String::new, |address| format!("nameserver {address}\n"));
    replace("/etc/resolv.conf", |_| server)?;
    replace("/etc/nsswitch.conf", plain_names)
}

/// Returns the text of /etc/hosts in which `localhost` and the name of the host stand for addresses of the network 127.0.0.0/8 alone, and `::1` has no name.
/// A program would speak past the links with `::1`, and with the address that the machine gives its name, which the host does not have.
fn names_of_itself(text: &str, name: &str) -> String {
    let mut missing = vec![LOCALHOST, name];
    missing.dedup();
    let mut lines = Vec::new();
    for line in text.lines() {
        let mut words = line.split('#').next().unwrap_or_default().split_whitespace();
        // Lines without an address stay, such as comments.
        let address: Option<IpAddr> = words.next().and_then(|word| word.parse().ok());
        let names: Vec<&str> = words.collect();
        let is_own = names.iter().any(|word| [LOCALHOST, name].contains(word));
        if address.is_some_and(|address| address.is_ipv6() && (is_own || address.is_loopback())) {
            continue;
        }
        missing.retain(|word| address.is_none() || !names.contains(word));
        let is_elsewhere = is_own && address.is_some_and(|address| !address.is_loopback());
        lines.push(if is_elsewhere { format!("{}\t{}\n", Ipv4Addr::LOCALHOST, names.join(" ")) } else { format!("{line}\n") });
    }
    let missing = missing.into_iter().map(|name| format!("{}\t{name}\n", Ipv4Addr::LOCALHOST));
    missing.chain(lines).collect()
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

    /// Lines of Debian, of Docker, and of a system whose names come from another service.
    #[test]
    fn own_names_stand_for_the_loopback_network() {
        let text = "127.0.0.1 localhost\n127.0.1.1\tvm.example.org vm # the machine\n::1 localhost ip6-localhost\nfe00::0 ip6-localnet\n# end\n";
        let expected = "127.0.0.1 localhost\n127.0.1.1\tvm.example.org vm # the machine\nfe00::0 ip6-localnet\n# end\n";
        assert_eq!(names_of_itself(text, "vm"), expected);
        let text = "::1 localhost\n127.0.0.1 localhost\n172.17.0.2 vm vm.example.org\nfd00::2 vm\n10.0.0.9 other\n";
        assert_eq!(names_of_itself(text, "vm"), "127.0.0.1 localhost\n127.0.0.1\tvm vm.example.org\n10.0.0.9 other\n");
        assert_eq!(names_of_itself("# none\n", "vm"), "127.0.0.1\tlocalhost\n127.0.0.1\tvm\n# none\n");
        assert_eq!(names_of_itself("", "localhost"), "127.0.0.1\tlocalhost\n");
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
