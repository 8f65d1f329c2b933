//! Tests that need more than one crate. They are one program, so that what they share is compiled once.
//!
//! | module | tests |
//! | --- | --- |
//! | [`claims`] | claims about coordination over links |
//! | [`determinism`] | same scene, same seed, same bytes, by every way to run it |
//! | [`eigenvectors`] | no tests: what some of the others share |
//! | [`hard`] | hard cases of the numerics, of time and of size |
//! | [`house`] | rules that the project keeps to |
//! | [`prediction`] | the times of people over bad networks that the book predicts |
//! | [`properties`] | properties of runs, tried on scenes drawn at random |
//! | [`scenarios`] | the expectations of the shipped scenes |
//! | [`testkit`] | the test kit with its feature `scenes` |

mod claims;
mod determinism;
mod eigenvectors;
mod hard;
mod house;
mod prediction;
mod properties;
mod scenarios;
mod testkit;
