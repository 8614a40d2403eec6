//! What the calibration of a vehicle leaves uncertain, in the order of the localizer: five parameters of the drive, then the
//! perturbation of the mount on its right.
//!
//! ```text
//! d mount = R(-yaw) (d x, d y), d yaw         a steering offset without direction is that of both directions
//! ```
//!
//! Parameters that the localizer does not know of (delay, range offset) are left out.

use groma_localization::{CALIBRATION, CalibrationCovariance, DRIVE};
use groma_models::{Drive, Vehicle};
use nalgebra::{DMatrix, Rotation2};

/// The covariance of drive and mount; none where the vehicle says nothing of its own.
pub(super) fn considered(vehicle: &Vehicle) -> Option<CalibrationCovariance> {
    let known = vehicle.covariance();
    if known.names.is_empty() {
        return None;
    }
    let mut spread = DMatrix::zeros(CALIBRATION, known.names.len());
    for (column, name) in known.names.iter().enumerate() {
        places(vehicle.drive(), name).iter().for_each(|row| spread[(*row, column)] = 1.0);
    }
    let mut turned = DMatrix::identity(CALIBRATION, CALIBRATION);
    let back = Rotation2::new(-vehicle.mount().theta());
    turned.view_mut((DRIVE, DRIVE), (2, 2)).copy_from(back.matrix());
    let spread = turned * spread;
    let covariance = &spread * &known.matrix * spread.transpose();
    Some(CalibrationCovariance::from_fn(|i, j| covariance[(i, j)]))
}

/// Where a parameter stands.
fn places(drive: &Drive, name: &str) -> Vec<usize> {
    let mount = ["laser_x", "laser_y", "laser_yaw"].iter().position(|n| *n == name);
    if let Some(k) = mount {
        return vec![DRIVE + k];
    }
    match (drive, name) {
        (Drive::Tricycle(_), "drive_scale") | (Drive::Differential(_), "left_radius") => vec![0],
        (Drive::Tricycle(_), "wheelbase") | (Drive::Differential(_), "right_radius") => vec![1],
        (Drive::Tricycle(_), "steering_gain") | (Drive::Differential(_), "axle") => vec![2],
        (Drive::Tricycle(_), "steering_offset") => vec![3, 4],
        (Drive::Tricycle(_), "steering_offset_forward") => vec![3],
        (Drive::Tricycle(_), "steering_offset_backward") => vec![4],
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_geometry::Se2;
    use groma_models::{Differential, ParameterCovariance, Scanner, Tricycle};

    fn vehicle(drive: Drive, yaw: f64, names: &[&str], variances: &[f64]) -> Vehicle {
        let scanner = Scanner { name: String::new(), mount: Se2::new(0.4, 0.1, yaw), range_offset: 0.0 };
        let names = names.iter().map(|n| (*n).to_owned()).collect();
        let matrix = DMatrix::from_diagonal(&variances.to_vec().into());
        let plain = Vehicle::new(drive, vec![scanner], 0.0).unwrap();
        plain.with_covariance(ParameterCovariance { names, matrix }).unwrap()
    }

    fn tricycle() -> Drive {
        Drive::Tricycle(Tricycle::from_parameters([0.1, 1.5, 1.0, 0.01, 0.01]))
    }

    #[test]
    fn an_offset_of_both_directions_is_one_error() {
        let one = considered(&vehicle(tricycle(), 0.0, &["steering_offset", "delay"], &[4e-6, 1.0])).unwrap();
        assert_eq!((one[(3, 3)], one[(4, 4)], one[(3, 4)]), (4e-6, 4e-6, 4e-6));
        assert!((one.trace() - 8e-6).abs() < 1e-18, "the delay is not considered");
        let two = ["steering_offset_forward", "steering_offset_backward"];
        let two = considered(&vehicle(tricycle(), 0.0, &two, &[4e-6, 9e-6])).unwrap();
        assert_eq!((two[(3, 3)], two[(4, 4)], two[(3, 4)]), (4e-6, 9e-6, 0.0));
    }

    #[test]
    fn a_mount_that_is_turned_to_the_left_is_uncertain_along_its_own_axes() {
        let quarter = std::f64::consts::FRAC_PI_2;
        let c = considered(&vehicle(tricycle(), quarter, &["laser_x", "laser_yaw"], &[1e-4, 1e-6])).unwrap();
        // What the base calls x is the scanner's -y.
        assert!((c[(DRIVE + 1, DRIVE + 1)] - 1e-4).abs() < 1e-16 && c[(DRIVE, DRIVE)] < 1e-16);
        assert_eq!(c[(DRIVE + 2, DRIVE + 2)], 1e-6);
        let c = considered(&vehicle(tricycle(), 0.5 * quarter, &["laser_x"], &[1e-4])).unwrap();
        assert!((c[(DRIVE, DRIVE + 1)] + 0.5e-4).abs() < 1e-16, "forward of the base is to the scanner's right");
    }

    #[test]
    fn the_wheels_of_a_differential_drive_have_places_of_their_own() {
        let drive = Drive::Differential(Differential { left: 0.1, right: 0.1, axle: 0.5 });
        let c = considered(&vehicle(drive, 0.0, &["right_radius", "axle", "left_radius"], &[1.0, 2.0, 3.0])).unwrap();
        assert_eq!((c[(0, 0)], c[(1, 1)], c[(2, 2)]), (3.0, 1.0, 2.0));
        assert!(considered(&Vehicle::new(drive, Vec::new(), 0.0).unwrap()).is_none());
    }
}
