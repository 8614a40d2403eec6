//! Drives mapped message by message: what arrives when, what is asked on the way, and the findings of the result.
#![allow(clippy::unwrap_used)]

#[allow(dead_code)]
#[path = "../../../mapping/tests/drives/building.rs"]
mod building;
mod feed;
mod findings;
mod late;
mod order;
mod vehicle;
