//! Options of real sockets, in the form of `cohaptic-sockets`.

use std::io;

use cohaptic_sockets::{Configured, KeepaliveTimes, Setting};
use socket2::SockRef;

/// Sets the options of `now` on `socket`, except for equal options of `before`.
pub(crate) fn set_changed(socket: &(impl Configured + ?Sized), before: &[Setting], now: Vec<Setting>) -> io::Result<()> {
    now.into_iter().filter(|setting| !before.contains(setting)).try_for_each(|setting| socket.set(setting))
}

/// Returns the options of a real socket. Options unknown to this kind of socket are left out.
pub(crate) fn read(socket: &SockRef<'_>) -> Vec<Setting> {
    // The address tells the version of IP, also for an unbound socket.
    let is_six = socket.local_addr().is_ok_and(|address| address.is_ipv6());
    let size = |size: usize| u32::try_from(size).unwrap_or(u32::MAX);
    let type_of_service = if is_six { class(socket) } else { service(socket) };
    let ttl = if is_six { socket.unicast_hops_v6() } else { socket.ttl_v4() };
    let settings = [
        socket.tcp_nodelay().map(Setting::NoDelay),
        keepalive(socket).map(Setting::Keepalive),
        socket.linger().map(Setting::Linger),
        user_timeout(socket).map(Setting::UserTimeout),
        socket.recv_buffer_size().map(|bytes| Setting::ReceiveBuffer(size(bytes))),
        socket.send_buffer_size().map(|bytes| Setting::SendBuffer(size(bytes))),
        type_of_service.map(Setting::TypeOfService),
        ttl.map(Setting::Ttl),
        socket.reuse_address().map(Setting::ReuseAddress),
        reuse_port(socket).map(Setting::ReusePort),
        socket.only_v6().map(Setting::OnlyV6),
        socket.broadcast().map(Setting::Broadcast),
        socket.multicast_ttl_v4().map(Setting::MulticastTtl),
        socket.multicast_loop_v4().map(Setting::MulticastLoop4),
        // A socket of IPv4 has no options of IPv6.
        socket.multicast_hops_v6().map(Setting::MulticastHops),
        socket.multicast_loop_v6().map(Setting::MulticastLoop6),
    ];
    settings.into_iter().flatten().collect()
}

/// Sets an option of a real socket.
pub(crate) fn write(socket: &SockRef<'_>, setting: Setting) -> io::Result<()> {
    let is_six = socket.local_addr().is_ok_and(|address| address.is_ipv6());
    match setting {
        Setting::NoDelay(on) => socket.set_tcp_nodelay(on),
        Setting::Keepalive(None) => socket.set_keepalive(false),
        Setting::Keepalive(Some(times)) => set_keepalive(socket, times),
        Setting::Linger(time) => socket.set_linger(time),
        Setting::UserTimeout(time) => set_user_timeout(socket, time),
        // The system doubles a set size.
        Setting::ReceiveBuffer(bytes) => socket.set_recv_buffer_size(bytes as usize / 2),
        Setting::SendBuffer(bytes) => socket.set_send_buffer_size(bytes as usize / 2),
        Setting::TypeOfService(value) if is_six => set_class(socket, value),
        Setting::TypeOfService(value) => set_service(socket, value),
        Setting::Ttl(ttl) if is_six => socket.set_unicast_hops_v6(ttl),
        Setting::Ttl(ttl) => socket.set_ttl_v4(ttl),
        Setting::ReuseAddress(on) => socket.set_reuse_address(on),
        Setting::ReusePort(on) => set_reuse_port(socket, on),
        Setting::OnlyV6(on) => socket.set_only_v6(on),
        Setting::Broadcast(on) => socket.set_broadcast(on),
        // A socket of IPv6 has these options of IPv4 on Linux alone.
        Setting::MulticastTtl(_) | Setting::MulticastLoop4(_) if is_six && !cfg!(any(target_os = "linux", target_os = "android")) => Ok(()),
        Setting::MulticastTtl(ttl) => socket.set_multicast_ttl_v4(ttl),
        Setting::MulticastHops(hops) => socket.set_multicast_hops_v6(hops),
        Setting::MulticastLoop4(on) => socket.set_multicast_loop_v4(on),
        Setting::MulticastLoop6(on) => socket.set_multicast_loop_v6(on),
    }
}

/// Options of some systems only: reading and writing fail elsewhere.
macro_rules! some_have {
    ($(#[$condition:meta] $get:ident, $set:ident: $kind:ty = |$socket:ident| $read:expr, |$to:ident, $value:ident| $write:expr;)*) => {
        $(
            #[$condition]
            fn $get($socket: &SockRef<'_>) -> io::Result<$kind> {
                $read
            }

            #[$condition]
            fn $set($to: &SockRef<'_>, $value: $kind) -> io::Result<()> {
                $write
            }
        )*
    };
}

some_have! {
    #[cfg(any(target_os = "linux", target_os = "android"))]
    user_timeout, set_user_timeout: Option<std::time::Duration> = |socket| socket.tcp_user_timeout(), |socket, time| socket.set_tcp_user_timeout(time);
    #[cfg(not(any(target_os = "linux", target_os = "android")))]
    user_timeout, set_user_timeout: Option<std::time::Duration> = |_socket| Err(io::ErrorKind::Unsupported.into()), |_socket, _time| Ok(());
    #[cfg(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd"))]
    service, set_service: u32 = |socket| socket.tos_v4(), |socket, value| socket.set_tos_v4(value);
    #[cfg(not(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd")))]
    service, set_service: u32 = |_socket| Err(io::ErrorKind::Unsupported.into()), |_socket, _value| Ok(());
    #[cfg(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd"))]
    class, set_class: u32 = |socket| socket.tclass_v6(), |socket, value| socket.set_tclass_v6(value);
    #[cfg(not(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd")))]
    class, set_class: u32 = |_socket| Err(io::ErrorKind::Unsupported.into()), |_socket, _value| Ok(());
    #[cfg(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd"))]
    reuse_port, set_reuse_port: bool = |socket| socket.reuse_port(), |socket, on| socket.set_reuse_port(on);
    #[cfg(not(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd")))]
    reuse_port, set_reuse_port: bool = |_socket| Err(io::ErrorKind::Unsupported.into()), |_socket, _on| Ok(());
}

/// Returns the times of keep-alive probes, or `None` if the option is off.
#[cfg(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd"))]
fn keepalive(socket: &SockRef<'_>) -> io::Result<Option<KeepaliveTimes>> {
    if !socket.keepalive()? {
        return Ok(None);
    }
    let (idle, interval, probes) = (socket.tcp_keepalive_time()?, socket.tcp_keepalive_interval()?, socket.tcp_keepalive_retries()?);
    Ok(Some(KeepaliveTimes { idle, interval, probes }))
}

#[cfg(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd"))]
fn set_keepalive(socket: &SockRef<'_>, times: KeepaliveTimes) -> io::Result<()> {
    let KeepaliveTimes { idle, interval, probes } = times;
    socket.set_tcp_keepalive(&socket2::TcpKeepalive::new().with_time(idle).with_interval(interval).with_retries(probes))
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd")))]
fn keepalive(_: &SockRef<'_>) -> io::Result<Option<KeepaliveTimes>> {
    Err(io::ErrorKind::Unsupported.into())
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_os = "macos", target_os = "freebsd")))]
fn set_keepalive(socket: &SockRef<'_>, _: KeepaliveTimes) -> io::Result<()> {
    socket.set_keepalive(true)
}
