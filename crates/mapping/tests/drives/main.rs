//! Whole drives through small simulated buildings, mapped and compared with the ground truth.
#![allow(clippy::unwrap_used)]

mod building;
mod closures;
mod consistency;
mod tracking;
