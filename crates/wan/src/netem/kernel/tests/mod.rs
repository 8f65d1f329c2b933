//! The kernel's netem: its laws, its queue, its tables.
