//! Calls of the system for sockets, names, clocks and random numbers, caught on the threads of a test bed.
//!
//! Use this crate through the package `tokio` that `cohaptic tokio` writes: the package depends on this crate, and a program with that package needs nothing more.
//!
//! The crate has functions with the names of functions of the C library: `socket`, `bind`, `sendmsg`, `getaddrinfo` and others. A program that is linked with this
//! crate calls these functions in place of those of the C library, and so do the standard library, `socket2`, and libraries of C. On a thread that runs a test bed
//! a call for a socket of IP is one for a socket of the test bed. Every other call goes on to the function of the C library, found by `dlsym(RTLD_NEXT)`.
//!
//! ```
//! // Outside of a test bed sockets are real.
//! let socket = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
//! assert_ne!(socket.local_addr().unwrap().port(), 0);
//! ```
//!
//! # How a call decides
//!
//! `cohaptic_sockets::catches_calls` reads two values of the thread that need no destructor, so that the question takes no memory and no lock: a call may come from
//! an allocator, a signal handler, or a thread that begins or ends. While a call is served, [`cohaptic_sockets::outside`] is in force: calls of the system within
//! the call reach the system. A descriptor stands for a socket of the test bed if its inode stands in the table of `cohaptic-descriptors`, where also the
//! package `tokio` enters its sockets. The kernel keeps the options of a socket and whether it blocks: the descriptor is that of a real socket, neither bound nor
//! connected, so that the kernel checks each option, and the socket of the test bed takes the accepted ones over.
//!
//! # Panics do not cross the boundary
//!
//! A caller of `recv` is compiled in the belief that `recv` does not unwind, so that a panic must not leave these functions. They are `extern "C"`, which ends the
//! process rather than unwind, and each catches the panics of the code that it calls. A panic, or a call that would wait where virtual time cannot pass, becomes a
//! fault of the run (`cohaptic_sockets::Host::note_fault`) and the error `EDEADLK`. The run then fails with the text of the fault, which names host and call, also if
//! the program ignores the error.
//!
//! # Where the crate is empty
//!
//! Without the feature `symbols`, and on all systems but Linux with the dynamic GNU C library. Where the C library is linked statically (musl), the names would be
//! defined twice and there is no next definition. On macOS the standard library calls other names (`connect$NOCANCEL`) and passes the arguments of `fcntl` in
//! another way, and Windows has no such names. Programs that make system calls without the C library (Go, `rustix`) are not caught.

#[cfg(all(feature = "symbols", target_os = "linux", target_env = "gnu", not(target_feature = "crt-static")))]
mod caught;
#[cfg(all(feature = "symbols", target_os = "linux", target_env = "gnu", not(target_feature = "crt-static")))]
mod clocks;
#[cfg(all(feature = "symbols", target_os = "linux", target_env = "gnu", not(target_feature = "crt-static")))]
mod control;
#[cfg(all(feature = "symbols", target_os = "linux", target_env = "gnu", not(target_feature = "crt-static")))]
mod descriptors;
#[cfg(all(feature = "symbols", target_os = "linux", target_env = "gnu", not(target_feature = "crt-static")))]
mod memory;
#[cfg(all(feature = "symbols", target_os = "linux", target_env = "gnu", not(target_feature = "crt-static")))]
mod messages;
#[cfg(all(feature = "symbols", target_os = "linux", target_env = "gnu", not(target_feature = "crt-static")))]
mod names;
#[cfg(all(feature = "symbols", target_os = "linux", target_env = "gnu", not(target_feature = "crt-static")))]
mod options;
#[cfg(all(feature = "symbols", target_os = "linux", target_env = "gnu", not(target_feature = "crt-static")))]
mod sockets;
