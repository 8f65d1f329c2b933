//! Options set by programs on placeholders of sockets: see [`cohaptic_sockets::Setting`].

use std::io;

use cohaptic_sockets::{Configured, KeepaliveTimes, Setting, Version};

use crate::socket::UdpSocket;
use crate::tcp::socket::TcpSocket;
use crate::tcp::{Keepalive, TcpListener, TcpStream};

const fn times(keepalive: Keepalive) -> KeepaliveTimes {
    KeepaliveTimes { idle: keepalive.idle, interval: keepalive.interval, probes: keepalive.probes }
}

const fn keepalive(times: KeepaliveTimes) -> Keepalive {
    Keepalive { idle: times.idle, interval: times.interval, probes: times.probes }
}

/// Returns the version of IP of a socket, from its own address.
fn version(local: io::Result<std::net::SocketAddr>) -> Version {
    if local.is_ok_and(|local| local.is_ipv6()) { Version::Six } else { Version::Four }
}

impl Configured for TcpStream {
    fn version(&self) -> Version {
        version(self.local_addr())
    }

    fn settings(&self) -> io::Result<Vec<Setting>> {
        let config = self.config()?;
        let linger = self.linger()?.map(|linger| Setting::Linger(Some(linger)));
        Ok([Setting::NoDelay(config.nodelay), Setting::Keepalive(config.keepalive.map(times)), Setting::Ttl(config.ttl.into())]
            .into_iter()
            .chain(config.user_timeout.map(|timeout| Setting::UserTimeout(Some(timeout))))
            .chain(linger)
            .collect())
    }

    fn set(&self, setting: Setting) -> io::Result<()> {
        match setting {
            Setting::NoDelay(on) => self.set_nodelay(on),
            Setting::Keepalive(times) => self.set_keepalive_times(times.map(keepalive)),
            Setting::Linger(time) => self.set_linger(time),
            Setting::UserTimeout(timeout) => self.set_user_timeout(timeout),
            Setting::Ttl(ttl) => self.set_ttl(ttl),
            // The sizes of buffers are fixed when a connection begins. The other options say how a socket is bound, or have no effect.
            Setting::ReceiveBuffer(_)
            | Setting::SendBuffer(_)
            | Setting::TypeOfService(_)
            | Setting::ReuseAddress(_)
            | Setting::ReusePort(_)
            | Setting::OnlyV6(_)
            | Setting::Broadcast(_)
            | Setting::MulticastTtl(_)
            | Setting::MulticastHops(_)
            | Setting::MulticastLoop4(_)
            | Setting::MulticastLoop6(_) => Ok(()),
        }
    }
}

impl Configured for TcpListener {
    fn version(&self) -> Version {
        version(self.local_addr())
    }

    fn settings(&self) -> io::Result<Vec<Setting>> {
        let (config, linger) = self.inherited(|config, linger| (config.clone(), *linger))?;
        Ok([Setting::NoDelay(config.nodelay), Setting::Keepalive(config.keepalive.map(times)), Setting::Ttl(config.ttl.into())]
            .into_iter()
            .chain(linger.map(|linger| Setting::Linger(Some(linger))))
            .collect())
    }

    /// Sets an option for the connections accepted from now on.
    fn set(&self, setting: Setting) -> io::Result<()> {
        self.inherited(|config, linger| match setting {
            Setting::NoDelay(on) => config.nodelay = on,
            Setting::Keepalive(times) => config.keepalive = times.map(keepalive),
            Setting::Linger(time) => *linger = time,
            Setting::UserTimeout(timeout) => config.user_timeout = timeout,
            Setting::ReceiveBuffer(bytes) => config.receive_buffer = Some(bytes as usize),
            Setting::SendBuffer(bytes) => (config.send_buffer, config.least_send_buffer) = (bytes as usize, bytes as usize),
            Setting::Ttl(ttl) => config.ttl = u8::try_from(ttl).unwrap_or(u8::MAX).max(1),
            Setting::TypeOfService(_)
            | Setting::ReuseAddress(_)
            | Setting::ReusePort(_)
            | Setting::OnlyV6(_)
            | Setting::Broadcast(_)
            | Setting::MulticastTtl(_)
            | Setting::MulticastHops(_)
            | Setting::MulticastLoop4(_)
            | Setting::MulticastLoop6(_) => {}
        })
    }
}

impl Configured for UdpSocket {
    fn version(&self) -> Version {
        version(self.local_addr())
    }

    fn settings(&self) -> io::Result<Vec<Setting>> {
        let multicast = [Setting::MulticastTtl(self.multicast_ttl_v4()?), Setting::MulticastLoop4(self.multicast_loop_v4()?)];
        let six = match self.version() {
            Version::Four => None,
            Version::Six => Some([Setting::MulticastHops(self.multicast_hops_v6()?), Setting::MulticastLoop6(self.multicast_loop_v6()?)]),
        };
        Ok([Setting::Ttl(self.ttl()?), Setting::TypeOfService(self.tos_v4()?), Setting::Broadcast(self.broadcast()?)]
            .into_iter()
            .chain(multicast)
            .chain(six.into_iter().flatten())
            .collect())
    }

    fn set(&self, setting: Setting) -> io::Result<()> {
        match setting {
            // A setting holds the doubled size, as read from the placeholder, and the socket doubles the size again.
            Setting::ReceiveBuffer(bytes) => self.set_recv_buffer_size(bytes / 2),
            Setting::SendBuffer(bytes) => self.set_send_buffer_size(bytes / 2),
            Setting::TypeOfService(value) => self.set_tos_v4(value),
            Setting::Ttl(ttl) => self.set_ttl(ttl),
            Setting::Broadcast(on) => self.set_broadcast(on),
            Setting::MulticastTtl(ttl) => self.set_multicast_ttl_v4(ttl),
            Setting::MulticastHops(hops) => self.set_multicast_hops_v6(hops),
            Setting::MulticastLoop4(on) => self.set_multicast_loop_v4(on),
            Setting::MulticastLoop6(on) => self.set_multicast_loop_v6(on),
            Setting::NoDelay(_)
            | Setting::Keepalive(_)
            | Setting::Linger(_)
            | Setting::UserTimeout(_)
            | Setting::ReuseAddress(_)
            | Setting::ReusePort(_)
            | Setting::OnlyV6(_) => Ok(()),
        }
    }
}

impl Configured for TcpSocket {
    fn version(&self) -> Version {
        version(self.local_addr())
    }

    fn settings(&self) -> io::Result<Vec<Setting>> {
        let settings = [
            Setting::NoDelay(self.nodelay()?),
            Setting::Keepalive(self.config()?.keepalive.map(times)),
            Setting::ReuseAddress(self.reuseaddr()?),
            Setting::ReusePort(self.reuseport()?),
        ];
        let six = (self.version() == Version::Six).then_some(Setting::OnlyV6(self.only_v6()?));
        Ok(settings.into_iter().chain(self.linger()?.map(|linger| Setting::Linger(Some(linger)))).chain(six).collect())
    }

    fn set(&self, setting: Setting) -> io::Result<()> {
        match setting {
            Setting::NoDelay(on) => self.set_nodelay(on),
            Setting::Keepalive(times) => self.change_config(|config| config.keepalive = times.map(keepalive)),
            Setting::Linger(time) => self.set_linger(time),
            Setting::UserTimeout(timeout) => self.change_config(|config| config.user_timeout = timeout),
            Setting::ReceiveBuffer(bytes) => self.set_recv_buffer_size(bytes / 2),
            Setting::SendBuffer(bytes) => self.set_send_buffer_size(bytes / 2),
            Setting::TypeOfService(value) => self.set_tos_v4(value),
            Setting::Ttl(ttl) => self.change_config(|config| config.ttl = u8::try_from(ttl).unwrap_or(u8::MAX).max(1)),
            Setting::ReuseAddress(on) => self.set_reuseaddr(on),
            Setting::ReusePort(on) => self.set_reuseport(on),
            Setting::OnlyV6(on) => self.set_only_v6(on),
            Setting::Broadcast(_)
            | Setting::MulticastTtl(_)
            | Setting::MulticastHops(_)
            | Setting::MulticastLoop4(_)
            | Setting::MulticastLoop6(_) => Ok(()),
        }
    }
}
