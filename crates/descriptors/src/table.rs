//! Table of the sockets behind descriptors.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, RawFd};
use std::os::unix::fs::MetadataExt;
use std::sync::{Arc, Weak};

use cohaptic_sockets::{Bed, Configured, Datagrams, Listener, Setting, Socket, Stream, Version, outside};
use socket2::Type;

use crate::multicast::MulticastChange;

thread_local! {
    /// Sockets of test beds of this thread, by the inode of the placeholder.
    static KEPT: RefCell<BTreeMap<u64, Kept>> = const { RefCell::new(BTreeMap::new()) };
}

/// Descriptor with its inode.
#[derive(Clone, Copy, Debug)]
pub struct Numbered<'a> {
    pub(crate) fd: BorrowedFd<'a>,
    inode: u64,
}

impl<'a> Numbered<'a> {
    /// Puts a descriptor and its inode together.
    #[must_use]
    pub const fn new(fd: BorrowedFd<'a>, inode: u64) -> Self {
        Self { fd, inode }
    }

    /// Asks the system for the inode of a descriptor.
    ///
    /// # Errors
    ///
    /// If the system does not know the descriptor.
    pub fn of(fd: BorrowedFd<'a>) -> io::Result<Self> {
        let _outside = outside();
        // A duplicate is opened, because a `File` closes its descriptor.
        let inode = File::from(fd.as_fd().try_clone_to_owned()?).metadata()?.ino();
        Ok(Self { fd, inode })
    }
}

impl AsRawFd for Numbered<'_> {
    fn as_raw_fd(&self) -> RawFd {
        self.fd.as_raw_fd()
    }
}

/// Socket of a test bed behind a placeholder.
#[derive(Debug)]
pub enum Virtual {
    /// Socket of this kind before the first call. The placeholder has the options.
    New(Type, Version),
    /// TCP socket before `connect` and `listen`.
    Socket(Box<dyn Socket>),
    /// TCP connection, established or not.
    Stream(Held<dyn Stream>),
    /// TCP listener.
    Listener(Held<dyn Listener>),
    /// UDP socket.
    Datagrams(Held<dyn Datagrams>),
}

/// Pointer to a socket, with or without ownership.
#[derive(Debug)]
pub struct Held<T: ?Sized> {
    /// `None` if another value owns the socket, and the descriptor only finds the socket.
    owner: Option<Arc<T>>,
    socket: Weak<T>,
}

impl<T: ?Sized> Held<T> {
    pub(crate) fn get(&self) -> Option<Arc<T>> {
        self.socket.upgrade()
    }

    /// Keeps the socket open for as long as there is an entry.
    fn own(&mut self) {
        self.owner = self.get();
    }
}

/// Kind of socket with several owners.
pub trait Kind: Configured + 'static {
    /// Returns the socket of this kind, or `None` for another kind, or if nobody owns the socket any more.
    fn of(socket: &Virtual) -> Option<Arc<Self>>;

    /// Returns the form for a table that finds the socket without owning the socket.
    fn shared(socket: &Arc<Self>) -> Virtual;

    /// Returns the form for a table that owns the socket.
    fn owned(socket: Arc<Self>) -> Virtual;
}

macro_rules! kinds {
    ($($kind:ident: $name:ident;)*) => {
        $(
            impl Kind for dyn $kind {
                fn of(socket: &Virtual) -> Option<Arc<Self>> {
                    if let Virtual::$name(held) = socket { held.get() } else { None }
                }

                fn shared(socket: &Arc<Self>) -> Virtual {
                    Virtual::$name(Held { owner: None, socket: Arc::downgrade(socket) })
                }

                fn owned(socket: Arc<Self>) -> Virtual {
                    Virtual::$name(Held { socket: Arc::downgrade(&socket), owner: Some(socket) })
                }
            }
        )*
    };
}

kinds! {
    Stream: Stream;
    Listener: Listener;
    Datagrams: Datagrams;
}

/// Entry of the table.
#[derive(Debug)]
pub(crate) struct Kept {
    bed: Weak<dyn Bed>,
    pub(crate) socket: Virtual,
    /// Options of the placeholder at the last takeover.
    pub(crate) before: Vec<Setting>,
    /// Changes for multicast that wait for the bind of a new UDP socket.
    pub(crate) early: Vec<MulticastChange>,
    /// Number of descriptors of the placeholder. Stays 1 where nobody sees descriptors being duplicated and closed.
    pub(crate) descriptors: u32,
    /// `true` if the program has shut down reading: without bytes, reading then returns the end of the stream.
    pub(crate) is_read_shut: bool,
}

/// Enters `socket` for a descriptor, in place of the former socket of the descriptor, if any. Without a running test bed nothing is entered, because no placeholder
/// can come back.
pub(crate) fn insert(of: Numbered<'_>, socket: Virtual, before: Vec<Setting>) {
    let Some(bed) = cohaptic_sockets::bed() else { return };
    let mut kept = Kept { bed: Arc::downgrade(&bed), socket, before, early: Vec::new(), descriptors: 1, is_read_shut: false };
    let gone: Vec<Kept> = KEPT.with_borrow_mut(|all| {
        // Sockets of ended test beds are removed whenever the table grows, so that the table does not grow from run to run.
        let old: Vec<u64> = all.iter().filter(|(_, kept)| kept.bed.strong_count() == 0).map(|(inode, _)| *inode).collect();
        let mut gone: Vec<Kept> = old.iter().filter_map(|inode| all.remove(inode)).collect();
        if let Some(former) = all.get(&of.inode) {
            kept.descriptors = former.descriptors;
        }
        gone.extend(all.insert(of.inode, kept));
        gone
    });
    // Sockets are dropped after the borrow has ended, because destructors are foreign code.
    drop(gone);
}

/// Looks at the entry of a descriptor. `look` must not use the table.
pub(crate) fn with<T>(of: Numbered<'_>, look: impl FnOnce(&mut Kept) -> T) -> Option<T> {
    // The table is gone while the thread ends. No test bed runs on the thread any more.
    KEPT.try_with(|all| all.borrow_mut().get_mut(&of.inode).map(look)).ok().flatten()
}

/// Removes the entry of a descriptor if its socket is as wanted.
pub(crate) fn remove_if(of: Numbered<'_>, is_wanted: impl FnOnce(&Virtual) -> bool) -> Option<Kept> {
    KEPT.with_borrow_mut(|all| if all.get(&of.inode).is_some_and(|kept| is_wanted(&kept.socket)) { all.remove(&of.inode) } else { None })
}

/// Returns whether the table has entries. Descriptors of a thread without entries stand for nothing.
#[must_use]
pub(crate) fn is_any() -> bool {
    // A signal handler or an allocator may call the system while the table is being changed. The call is then one for the system.
    KEPT.try_with(|all| all.try_borrow().is_ok_and(|all| !all.is_empty())).unwrap_or_default()
}

/// Counts one more descriptor of a placeholder.
pub(crate) fn duplicated(of: Numbered<'_>) {
    with(of, |kept| {
        kept.descriptors += 1;
        // As on Linux, a socket stays open until its last descriptor is closed.
        match &mut kept.socket {
            Virtual::New(..) | Virtual::Socket(_) => {}
            Virtual::Stream(held) => held.own(),
            Virtual::Listener(held) => held.own(),
            Virtual::Datagrams(held) => held.own(),
        }
    });
}

/// Counts one descriptor of a placeholder less. The last descriptor takes the entry away.
pub(crate) fn closed(of: Numbered<'_>) {
    let is_last = with(of, |kept| {
        kept.descriptors -= 1;
        kept.descriptors == 0
    });
    if is_last == Some(true) {
        drop(remove_if(of, |_| true));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_that_is_being_changed_may_be_asked() {
        KEPT.with_borrow_mut(|_| assert!(!is_any()));
    }
}
