//! Timings of the core: `cargo bench -p groma-benches --bench NAME`, one program a subject in `benches`.
