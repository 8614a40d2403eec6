//! The whole way from simulated corners to the map, held against the truth.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod consistency;
mod runs;
mod trouble;
