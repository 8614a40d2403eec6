//! Detection allocates nothing per scan once it has seen the scans.

#![allow(unsafe_code)] // an allocator that counts cannot be had otherwise

use groma_features::{falko, oc};
use groma_models::BeamGeometry;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: everything is passed on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|c| c.set(c.get() + 1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn a_scan_seen_before_costs_no_allocation() {
    let geometry = BeamGeometry {
        angle_min: -1.57,
        angle_increment: 0.0087,
        time_increment: 0.0,
        range_min: 0.1,
        range_max: 20.0,
    };
    let reading = |i: usize, k: usize| 2.0 + 2.0 * (((i + 3 * k) as f64 * 0.0087).rem_euclid(0.4) - 0.2).abs();
    let scans: Vec<Vec<f64>> = (0..20).map(|k| (0..361).map(|i| reading(i, k)).collect()).collect();
    let (mut found, mut keypoints) = (0, Vec::new());
    let mut falko = falko::Detector::new(geometry, 361, falko::Options::default());
    let mut oc = oc::Detector::new(geometry, 361, oc::Options::default());
    let mut pass = || {
        for scan in &scans {
            falko.detect(scan, &mut keypoints);
            found += keypoints.len();
            oc.detect(scan, &mut keypoints);
        }
    };
    pass();
    let before = COUNT.with(Cell::get);
    pass();
    let after = COUNT.with(Cell::get);
    assert!(before > 0 && found > 50);
    assert_eq!(after - before, 0);
}
