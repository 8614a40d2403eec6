//! The whole way from simulated corners to the map, compared with the ground truth.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod consistency;
mod runs;
mod trouble;
