//! The programs of the soak: started, looked at from outside, and waited for.

use std::collections::BTreeSet;
use std::error::Error;
use std::fs;
use std::io::{self, BufRead as _, BufReader};
use std::net::{Ipv4Addr, SocketAddr};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use serde_json::Value;

use super::Sample;
use crate::machine;

/// Longest wait for a program: to start takes seconds at most, with the homing of simulated Falcons, but the machine may be busy.
const PATIENCE: Duration = Duration::from_secs(60);

/// A program that runs. It is ended when it is dropped, whatever comes of the soak.
#[derive(Debug)]
pub(super) struct Process {
    child: Option<Child>,
    lines: Receiver<String>,
}

/// The ports at which a process takes something in.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(super) struct Ports {
    pub(super) udp: Vec<SocketAddr>,
    /// Sockets that listen.
    pub(super) tcp: Vec<SocketAddr>,
}

impl Process {
    /// Starts a program in a folder with arguments that are separated by spaces.
    pub(super) fn start(program: &Path, folder: &Path, arguments: &str) -> Result<Self, String> {
        let mut command = Command::new(program);
        command.args(arguments.split(' ')).current_dir(folder).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(|error| format!("cannot run {}: {error}", program.display()))?;
        let (line, lines) = channel();
        let stderr = child.stderr.take();
        // Read to its end, so that the program never waits for a reader.
        std::thread::spawn(move || {
            for said in stderr.into_iter().flat_map(|stderr| BufReader::new(stderr).lines()).map_while(Result::ok) {
                let _ = line.send(said);
            }
        });
        Ok(Self { child: Some(child), lines })
    }

    /// The text between `beginning` and the first of `ends` in the next line on standard error that begins so: an address.
    pub(super) fn address(&self, beginning: &str, ends: [char; 2]) -> Result<SocketAddr, Box<dyn Error>> {
        let (begin, mut others) = (Instant::now(), String::new());
        loop {
            let left = PATIENCE.saturating_sub(begin.elapsed());
            let line = self.lines.recv_timeout(left).map_err(|_| format!("no line began with \"{beginning}\", but there were:{others}"))?;
            if let Some(rest) = line.strip_prefix(beginning) {
                return Ok(rest.split(ends).next().unwrap_or_default().parse()?);
            }
            others.push_str(&format!("\n{line}"));
        }
    }

    fn id(&self) -> String {
        self.child.as_ref().map_or_else(String::new, |child| child.id().to_string())
    }

    pub(super) fn sample(&self) -> Sample {
        Sample { memory: machine::memory_of(&self.id()), files: machine::open_files_of(&self.id()) }
    }

    /// The ports that are open now.
    pub(super) fn ports(&self) -> io::Result<Ports> {
        ports(&self.id())
    }

    pub(super) fn has_ended(&mut self) -> io::Result<bool> {
        self.child.as_mut().map_or(Ok(true), |child| Ok(child.try_wait()?.is_some()))
    }

    /// Waits until it has ended by itself, and reads its document.
    pub(super) fn end(mut self) -> Result<Value, Box<dyn Error>> {
        let begin = Instant::now();
        while !self.has_ended()? {
            if begin.elapsed() > PATIENCE {
                return Err("a program does not end".into());
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        let output = self.child.take().ok_or("a program ends once")?.wait_with_output()?;
        let said: Vec<String> = self.lines.try_iter().collect();
        serde_json::from_slice(&output.stdout).map_err(|error| format!("{}, no document ({error}): {}", output.status, said.join("\n")).into())
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        if let Some(mut child) = self.child.take() {
            // The process may have ended meanwhile.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// The ports of a process: its number, or `self`.
fn ports(process: &str) -> io::Result<Ports> {
    let sockets: BTreeSet<u64> = fs::read_dir(format!("/proc/{process}/fd"))?
        .filter_map(|entry| fs::read_link(entry.ok()?.path()).ok())
        .filter_map(|link| link.to_str()?.strip_prefix("socket:[")?.strip_suffix(']')?.parse().ok())
        .collect();
    let table = |name: &str| fs::read_to_string(format!("/proc/{process}/net/{name}"));
    Ok(Ports { udp: ports_of(&table("udp")?, &sockets, None), tcp: ports_of(&table("tcp")?, &sockets, Some(LISTENS)) })
}

/// The state of a TCP socket that listens, as `/proc/net/tcp` writes it.
const LISTENS: &str = "0A";

/// The local IPv4 addresses of these sockets in a table of `/proc/net`, in its order: the second column is the address, the fourth the state, the tenth the inode.
fn ports_of(table: &str, sockets: &BTreeSet<u64>, state: Option<&str>) -> Vec<SocketAddr> {
    let port = |line: &str| {
        let columns: Vec<&str> = line.split_whitespace().collect();
        let is_its = sockets.contains(&columns.get(9)?.parse().ok()?) && state.is_none_or(|state| columns[3] == state);
        let (ip, port) = columns[1].split_once(':').filter(|_| is_its)?;
        // The number is printed as this machine stores the four bytes.
        let ip = Ipv4Addr::from(u32::from_str_radix(ip, 16).ok()?.to_ne_bytes());
        Some(SocketAddr::from((ip, u16::from_str_radix(port, 16).ok()?)))
    };
    table.lines().skip(1).filter_map(port).collect()
}

#[cfg(test)]
mod tests {
    use std::net::{TcpListener, UdpSocket};

    use super::*;

    /// This process looked at by itself.
    #[test]
    fn every_port_of_a_process_is_found() {
        let (udp, tcp) = (UdpSocket::bind("127.0.0.1:0").unwrap(), TcpListener::bind("127.0.0.1:0").unwrap());
        let found = ports("self").unwrap();
        assert!(found.udp.contains(&udp.local_addr().unwrap()) && found.tcp.contains(&tcp.local_addr().unwrap()), "{found:?}");
        let (udp, tcp) = ([udp.local_addr().unwrap()], [tcp.local_addr().unwrap()]);
        assert!(!found.tcp.contains(&udp[0]) && !found.udp.contains(&tcp[0]), "{found:?}");
    }
}
