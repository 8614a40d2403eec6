//! The track of a drive through a hall: exact without noise, unbroken when odometry fails, with the laser where it is.

use crate::building::{around, drive, hall, map, mount, scenario, truth, without_noise, worst, worst_closure};
use groma_geometry::Se2;
use groma_mapping::map_result::MapResult;
use groma_models::Odometry;
use groma_simulation::{Scanner, Scenario, Simulated};

/// Where the vehicle is twenty seconds after the start, turning around a corner.
const MIDWAY: f64 = 120.0;

/// The largest error of the keyframes, that of the closures included [m], [rad].
fn error(simulated: &Simulated, result: &MapResult) -> (f64, f64) {
    let truth = truth(simulated, result);
    let (nodes, held) = (worst(&truth, &result.graph.nodes), worst_closure(&truth, result));
    assert!(truth.len() > 100 && held.2 > 0, "a drive around the hall, closed");
    (nodes.0.max(held.0), nodes.1.max(held.1))
}

/// What the registration of a scan to points with normals can do: walls are straight, but corners and posts are cut.
#[test]
fn without_noise_the_drive_is_recovered_to_three_millimetres() {
    let scenario = without_noise();
    let simulated = drive(hall(), &around(1), &scenario);
    for odometry in [simulated.odometry.as_slice(), &[]] {
        let (metres, radians) = error(&simulated, &map(&simulated, odometry, mount(&scenario)));
        assert!(metres < 0.003 && radians < 0.0005, "{metres} m {radians} rad");
    }
}

#[test]
fn with_noise_of_a_centimetre_it_is_recovered_to_one() {
    for seed in 1..5 {
        let simulated = drive(hall(), &around(1), &scenario(seed));
        for odometry in [simulated.odometry.as_slice(), &[]] {
            let (metres, radians) = error(&simulated, &map(&simulated, odometry, mount(&scenario(seed))));
            assert!(metres < 0.015 && radians < 0.003, "seed {seed}: {metres} m {radians} rad");
        }
    }
}

#[test]
fn a_stalling_odometry_does_not_break_the_track() {
    for seed in 1..5 {
        let stalling = Scenario { stalls: 4, stall_duration: 1.0, ..scenario(seed) };
        let simulated = drive(hall(), &around(1), &stalling);
        assert_eq!(simulated.stalls.len(), 4);
        let (metres, radians) = error(&simulated, &map(&simulated, &simulated.odometry, mount(&stalling)));
        assert!(metres < 0.02 && radians < 0.004, "seed {seed}: {metres} m {radians} rad");
    }
}

#[test]
fn a_jumping_odometry_does_not_break_the_track() {
    let simulated = drive(hall(), &around(1), &scenario(1));
    for jump in [Se2::new(1.5, -0.7, 0.8), Se2::new(20.0, 0.0, 0.0), Se2::new(0.0, 0.0, 3.0)] {
        let jumped = |o: &Odometry| if o.stamp < MIDWAY { *o } else { Odometry { pose: jump * o.pose, ..*o } };
        let odometry: Vec<Odometry> = simulated.odometry.iter().map(jumped).collect();
        let (metres, radians) = error(&simulated, &map(&simulated, &odometry, mount(&scenario(1))));
        assert!(metres < 0.015 && radians < 0.003, "{jump:?}: {metres} m {radians} rad");
    }
}

/// The recording does not tell where the laser sits; what is mapped is then the drive of the laser.
#[test]
fn the_place_of_the_laser_is_learned() {
    let ahead = [0.4, -0.15, 0.1];
    let scenario = Scenario { scanner: Scanner { mount: ahead, ..scenario(1).scanner }, ..scenario(1) };
    let simulated = drive(hall(), &around(2), &scenario);
    let result = map(&simulated, &simulated.odometry, Se2::IDENTITY);
    let (learned, sigmas) = &result.offset;
    let off = learned.to_vector() - mount(&scenario).to_vector();
    for k in 0..3 {
        assert!(off[k].abs() < 3.0 * sigmas[k], "{off:?} {sigmas:?}");
    }
    assert!(sigmas.x < 0.03 && sigmas.y < 0.03 && sigmas.z < 0.015, "{sigmas:?}");
    let seat = mount(&scenario);
    let lasers: Vec<Se2> = truth(&simulated, &result).iter().map(|pose| seat.inverse() * *pose * seat).collect();
    let (metres, radians) = worst(&lasers, &result.graph.nodes);
    assert!(metres < 0.015 && radians < 0.003, "{metres} m {radians} rad");
}
