//! The track of a drive through a hall: exact without noise, unbroken when odometry fails, with the laser where it is.
#![allow(clippy::unwrap_used)]

mod driven;

use driven::{around, drive, hall, map, mount, scenario, truth, without_noise, worst, worst_closure};
use groma_geometry::Se2;
use groma_mapping::mapper::{MapResult, Mapper};
use groma_mapping::options::Options;
use groma_models::Odometry;
use groma_simulation::{Scanner, Scenario, Simulated};

#[test]
fn probe() {
    let s = without_noise();
    let d = drive(hall(), &around(1), &s);
    let show = |name: &str, d: &Simulated, r: &MapResult| {
        let t = truth(d, r);
        let closures = r.closures.iter().filter(|c| c.0.verdict == groma_mapping::closer::Verdict::Accepted).count();
        println!("{name}: kf {} worst {:?} closures {closures} {:?} offset {:?} {:?} weak {}", t.len(), worst(&t, &r.graph.nodes), worst_closure(&t, r), r.offset.0, r.offset.1, r.weak.len());
    };
    show("exact", &d, &map(&d, &d.odometry, mount(&s)));
    show("exact none", &d, &map(&d, &[], mount(&s)));
    let s = scenario(3);
    let d = drive(hall(), &around(1), &s);
    show("noisy", &d, &map(&d, &d.odometry, mount(&s)));
    show("noisy none", &d, &map(&d, &[], mount(&s)));
    let st = Scenario { stalls: 4, stall_duration: 1.0, ..scenario(3) };
    let d2 = drive(hall(), &around(1), &st);
    println!("stalls {:?}", d2.stalls);
    show("stalls", &d2, &map(&d2, &d2.odometry, mount(&s)));
    let jump = Se2::new(1.5, -0.7, 0.8);
    let jumped: Vec<Odometry> = d.odometry.iter().map(|o| if o.stamp < 120.0 { *o } else { Odometry { pose: o.pose * jump, ..*o } }).collect();
    show("jump", &d, &map(&d, &jumped, mount(&s)));
    let jumped: Vec<Odometry> = d.odometry.iter().map(|o| if o.stamp < 120.0 { *o } else { Odometry { pose: jump * o.pose, ..*o } }).collect();
    show("jump frame", &d, &map(&d, &jumped, mount(&s)));
    let off = Scenario { scanner: Scanner { mount: [0.4, -0.15, 0.1], ..s.scanner.clone() }, ..scenario(3) };
    let d3 = drive(hall(), &around(2), &off);
    show("offset", &d3, &map(&d3, &d3.odometry, Se2::IDENTITY));
    let _ = (Mapper::new(Options::default()), Se2::IDENTITY);
}
