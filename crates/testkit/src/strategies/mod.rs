//! Strategies of proptest: links and networks that shrink to the least impaired one.
