//! First process inside: makes the namespaces, the device and the files of names, and starts process 1.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::io;
use std::os::fd::AsFd as _;
use std::process::{Command, Stdio};

use cohaptic_router::{Failed, Join, Tun, lead_all, lead_own};
use nix::sched::{CloneFlags, unshare};
use rustix::thread::{CapabilitySet, capabilities, configure_capability_in_ambient_set, set_capabilities};

use super::setup::Setup;
use super::{INIT, MARK, OWN_FAILURE, files, refusal};
use crate::channel::{Channel, Report};

/// Numbers of the offloads of a device in [`Report::Device`].
const OFFLOADS: [Option<Join>; 3] = [None, Some(Join::Tcp), Some(Join::TcpAndUdp)];

/// Returns the offloads of a device by the number in a report.
pub(crate) fn offloads(number: u8) -> Option<Join> {
    OFFLOADS.get(usize::from(number)).copied().flatten()
}

/// Makes the host, and waits for the end of the host. Reports failures through the channel.
pub(super) fn enter(setup: &OsStr, command: &[OsString]) -> io::Result<()> {
    let channel = Channel::of_standard_input()?;
    let setup = setup.to_str().and_then(Setup::of_text).ok_or(io::ErrorKind::InvalidInput)?;
    let begun = begin(&setup, &channel, command);
    let mut init = match begun {
        Ok(init) => init,
        Err(why) => return channel.report(&Report::Failed(OWN_FAILURE, why), None),
    };
    // The end of the channel must be the end of process 1, so this process lets go of its own ends.
    drop(channel);
    rustix::stdio::dup2_stdin(fs::File::open("/dev/null")?)?;
    init.wait()?;
    Ok(())
}

fn begin(setup: &Setup, channel: &Channel, command: &[OsString]) -> Result<std::process::Child, String> {
    separate(setup.name.is_some()).map_err(|error| refusal::words("make namespaces", &error))?;
    dies_with_parent().map_err(|error| refusal::words("ask to end with the program outside", &error))?;
    files::mount_privately().map_err(|error| refusal::words("make mounts private", &error))?;
    if let Some(name) = &setup.name {
        rustix::system::sethostname(name.as_bytes()).map_err(|error| refusal::words("set the name of the host", &error.into()))?;
    }
    // A kernel without IPv6 has no such folder.
    let device = setup.device(fs::exists("/proc/sys/net/ipv6").unwrap_or(false));
    let step = |failed: Failed| match &failed {
        Failed::System { what, source } => refusal::words(what, source),
        Failed::SameDevice | Failed::NoDevice { .. } | Failed::NotEthernet { .. } | _ => failed.to_string(),
    };
    let tun = Tun::open(&device).map_err(step)?;
    lead_all(&device).map_err(step)?;
    if setup.loopback {
        lead_own(&device).map_err(|failed| refusal::of_loopback(&failed))?;
    }
    files::allow_ordinary_users();
    files::name_hosts(setup)?;
    let (descriptor, which) = tun.into_descriptor();
    let number = OFFLOADS.iter().position(|offloads| *offloads == which).and_then(|place| u8::try_from(place).ok()).unwrap_or(0);
    channel.report(&Report::Device(number), Some(descriptor.as_fd())).map_err(|error| format!("cannot hand over the device: {error}"))?;
    drop(descriptor);
    let own = std::env::current_exe().map_err(|error| format!("cannot find the file of this program: {error}"))?;
    let mut init = Command::new(own);
    init.args([MARK, INIT, ""]).args(command).stdin(Stdio::inherit());
    init.spawn().map_err(|error| refusal::words("start process 1", &error))
}

/// Moves this process into new namespaces. A process without the right makes a user namespace too, in which the process has the right.
fn separate(names: bool) -> io::Result<()> {
    let spaces = CloneFlags::CLONE_NEWNET | CloneFlags::CLONE_NEWNS | CloneFlags::CLONE_NEWPID;
    let spaces = if names { spaces | CloneFlags::CLONE_NEWUTS } else { spaces };
    match unshare(spaces) {
        Err(nix::errno::Errno::EPERM) => {}
        done => return Ok(done?),
    }
    // The ids are read before the move, because a new user namespace maps no ids yet.
    let (user, group) = (nix::unistd::geteuid(), nix::unistd::getegid());
    unshare(spaces | CloneFlags::CLONE_NEWUSER)?;
    // Both ids are mapped to themselves, so that files and processes have the same owner inside and outside. A process without rights may map no other id, and
    // may map its group only after giving up `setgroups` (user_namespaces(7)).
    fs::write("/proc/self/setgroups", "deny")?;
    fs::write("/proc/self/uid_map", format!("{user} {user} 1"))?;
    fs::write("/proc/self/gid_map", format!("{group} {group} 1"))?;
    // Process 1 has to mount /proc. A user other than root loses the rights at the start of another program, unless the rights are ambient.
    let mut rights = capabilities(None)?;
    rights.inheritable = rights.permitted;
    set_capabilities(None, rights)?;
    configure_capability_in_ambient_set(CapabilitySet::SYS_ADMIN, true)?;
    Ok(())
}

/// Asks the system to kill this process when its parent ends. Comes after the namespaces, because a change of rights clears the request.
pub(super) fn dies_with_parent() -> io::Result<()> {
    Ok(rustix::process::set_parent_process_death_signal(Some(rustix::process::Signal::KILL))?)
}
