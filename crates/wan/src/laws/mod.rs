//! Laws of chance from which stages draw.

pub(crate) mod chance;
pub mod delay;
pub(crate) mod normal;
pub(crate) mod sojourn;
