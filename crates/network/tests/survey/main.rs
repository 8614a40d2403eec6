//! The whole way from simulated corners to the map, held against the truth.

mod consistency;
mod runs;
mod trouble;
