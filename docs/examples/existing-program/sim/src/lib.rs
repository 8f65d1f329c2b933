//! The tests of `orders` over bad networks are in `tests`.
