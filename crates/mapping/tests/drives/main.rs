//! Whole drives through small simulated buildings, mapped and held against the truth.
#![allow(clippy::unwrap_used)]

mod building;
mod closures;
mod consistency;
mod tracking;
