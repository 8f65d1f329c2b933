//! Calls of the script's program, made on the connection.

use std::time::Duration;

use cohaptic_tcp::{Connection, Error, State};

use crate::call::{Call, Outcome};
use crate::packet::octet;
use crate::stage::Stage;

impl Stage {
    /// Makes a call, and compares its result.
    pub(crate) fn call(&mut self, call: &Call) -> Result<(), String> {
        let result = self.make(call)?;
        self.flush();
        if result == call.result { Ok(()) } else { Err(format!("`{}` gives {result:?}, and not {:?}", call.name, call.result)) }
    }

    fn make(&mut self, call: &Call) -> Result<Outcome, String> {
        let done = Ok(Outcome::Value(0));
        let file = call.number(0);
        match call.name.as_str() {
            "socket" => {
                self.files.fresh = if let Outcome::Value(file) = call.result { Some(file) } else { None };
                return Ok(call.result.clone());
            }
            "bind" | "fcntl" => return done,
            "listen" => {
                (self.files.listener, self.files.fresh) = (file, None);
                return done;
            }
            "connect" => {
                (self.files.connection, self.files.fresh) = (file, None);
                self.connect();
                return Ok(Outcome::Error("EINPROGRESS".into()));
            }
            "accept" => return Ok(self.accept(call)),
            "setsockopt" if file == self.files.fresh || file == self.files.listener => {
                return self.set_option(call).map(|()| Outcome::Value(0)).ok_or_else(|| format!("the option {:?} is unknown", call.arguments));
            }
            "close" if file == self.files.listener => {
                self.files.listener = None;
                return done;
            }
            _ => {}
        }
        if file.is_none() || file != self.files.connection {
            return Err(format!("`{}` is unknown, or {:?} is no connection", call.name, call.arguments.first()));
        }
        self.make_on_connection(call)
    }

    fn accept(&mut self, call: &Call) -> Outcome {
        let is_there = self.files.connection.is_none() && self.end.as_ref().is_some_and(|end| end.state() != State::SynReceived);
        if let (Outcome::Value(file), true) = (&call.result, is_there) {
            self.files.connection = Some(*file);
            return call.result.clone();
        }
        Outcome::Error("EAGAIN".into())
    }

    fn make_on_connection(&mut self, call: &Call) -> Result<Outcome, String> {
        let now = self.now;
        let end = self.end.as_mut().ok_or("there is no connection")?;
        match (call.name.as_str(), call.arguments.get(1).map(String::as_str)) {
            ("write", _) => {
                let length = u32::try_from(call.number(2).ok_or("`write` needs a length")?).unwrap();
                let chunk: Vec<u8> = (self.written..self.written + length).map(octet).collect();
                let result = end.write(&chunk);
                self.written += u32::try_from(*result.as_ref().unwrap_or(&0)).unwrap();
                Ok(outcome(result))
            }
            ("read", _) => {
                let mut chunk = vec![0; usize::try_from(call.number(2).ok_or("`read` needs a length")?).unwrap()];
                let result = end.read(&mut chunk);
                let count = *result.as_ref().unwrap_or(&0);
                if !chunk[..count].iter().zip(self.read..).all(|(seen, at)| *seen == octet(at)) {
                    return Err("octets that never arrived were read".into());
                }
                self.read += u32::try_from(count).unwrap();
                Ok(outcome(result))
            }
            ("shutdown", Some("SHUT_WR")) => {
                end.shutdown();
                Ok(Outcome::Value(0))
            }
            ("close", _) => {
                if self.files.resets_on_close {
                    end.abort();
                }
                end.close(now);
                self.files.connection = None;
                Ok(Outcome::Value(0))
            }
            ("getsockopt", Some("SOL_SOCKET")) if call.arguments.get(2).is_some_and(|name| name == "SO_ERROR") => {
                let name = end.take_error().map_or("0", name);
                let wanted = call.arguments.get(3).map_or("", |value| value.trim_matches(['[', ']']));
                if name == wanted { Ok(Outcome::Value(0)) } else { Err(format!("the error is {name}, and not {wanted}")) }
            }
            ("setsockopt", _) => {
                self.set_option(call).map(|()| Outcome::Value(0)).ok_or_else(|| format!("the option {:?} is unknown", call.arguments))
            }
            _ => Err(format!("`{}({})` is unknown", call.name, call.arguments.join(", "))),
        }
    }

    /// Sets an option of the connection, or of connections to come.
    fn set_option(&mut self, call: &Call) -> Option<()> {
        let name = call.arguments.get(2)?.as_str();
        let now = self.now;
        if name == "SO_LINGER" {
            let is_abort = call.arguments.get(3)?.replace(' ', "") == "{onoff=1,linger=0}";
            self.files.resets_on_close = is_abort;
            return is_abort.then_some(());
        }
        let value = call.number(3)?;
        let seconds = Duration::from_secs(value);
        let mut keepalive = self.end.as_ref().map_or(self.config.keepalive, |end| end.config().keepalive).unwrap_or_default();
        match name {
            "SO_REUSEADDR" => return Some(()),
            "SO_KEEPALIVE" if value == 1 => {}
            "TCP_KEEPIDLE" => keepalive.idle = seconds,
            "TCP_KEEPINTVL" => keepalive.interval = seconds,
            "TCP_KEEPCNT" => keepalive.probes = u32::try_from(value).ok()?,
            "TCP_NODELAY" => {
                self.config.nodelay = value == 1;
                self.end.iter_mut().for_each(|end| end.set_nodelay(value == 1));
                return Some(());
            }
            "TCP_QUICKACK" => {
                self.end.iter_mut().for_each(|end| end.set_quickack(value == 1));
                return Some(());
            }
            "TCP_USER_TIMEOUT" => {
                self.config.user_timeout = Some(Duration::from_millis(value));
                self.end.iter_mut().for_each(|end: &mut Connection| end.set_user_timeout(Some(Duration::from_millis(value))));
                return Some(());
            }
            _ => return None,
        }
        self.config.keepalive = Some(keepalive);
        self.end.iter_mut().for_each(|end| end.set_keepalive(now, Some(keepalive)));
        Some(())
    }
}

fn outcome(result: Result<usize, Error>) -> Outcome {
    result.map_or_else(|error| Outcome::Error(name(error).into()), |count| Outcome::Value(count as u64))
}

/// Returns the name of the error on Linux.
fn name(error: Error) -> &'static str {
    match error {
        Error::WouldBlock => "EAGAIN",
        Error::ConnectionRefused => "ECONNREFUSED",
        Error::ConnectionReset => "ECONNRESET",
        Error::TimedOut => "ETIMEDOUT",
        Error::BrokenPipe => "EPIPE",
        Error::NotConnected => "ENOTCONN",
        _ => "an error without a name",
    }
}
