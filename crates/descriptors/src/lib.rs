//! Descriptors of the system in place of sockets of a test bed, and the calls of the system on such descriptors.
//!
//! Use this crate if you write a layer between programs and the sockets of a test bed, and the programs keep their sockets as descriptors.
//!
//! A [`Placeholder`] is a real socket, neither bound nor connected, that stands for a socket of a test bed. A program sets options on the placeholder, as on
//! any socket, and the socket of the test bed takes the options over. The inode identifies a placeholder, because duplicates of a descriptor have the same
//! inode. All placeholders of a thread stand in one table. Two layers enter placeholders there: the package `tokio` of `cohaptic tokio`, which gives
//! descriptors of its sockets to programs and takes descriptors back, and `cohaptic-libc`, whose functions stand in for functions of the system. The module
//! [`calls`] has these functions in a form without pointers.
//!
//! ```
//! # #[cfg(unix)] {
//! use std::os::fd::AsFd;
//! use cohaptic_descriptors::Numbered;
//!
//! // A socket of the system stands for nothing.
//! let socket = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
//! assert!(cohaptic_descriptors::calls::local(Numbered::of(socket.as_fd()).unwrap()).is_none());
//! # }
//! ```
#![cfg(unix)]

pub mod calls;
mod multicast;
mod options;
mod placeholder;
mod table;

pub use multicast::MulticastChange;
pub use placeholder::{Placeholder, Pointer, find, keep, set_all, take, unbound};
pub use table::{Held, Kind, Numbered, Virtual};
