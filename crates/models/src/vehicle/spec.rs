//! A vehicle as it is written: the tree of `vehicle.toml`, version 2, and the same as JSON.
//!
//! ```text
//! version, unit, joints, delay
//! drive       model, and its parameters by name
//! noise       slip, steering, memory
//! scanners    a list: name, x, y, yaw, range_offset
//! covariance  names, matrix
//! ```
//!
//! Reading goes through the constructors of [`Vehicle`], so nothing is read that could not be built. A tricycle is
//! written with one steering offset where forward and backward have the same and none was estimated apart.

use super::{CounterUnit, ParameterCovariance, Scanner, Vehicle, WheelNoise};
use crate::differential::Differential;
use crate::drive::Drive;
use crate::error::ModelError;
use crate::tricycle::Tricycle;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// Version of the tree.
pub const VERSION: u32 = 2;

/// A vehicle as a tree of plain values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VehicleSpec {
    version: u32,
    #[serde(default)]
    unit: CounterUnit,
    #[serde(default)]
    joints: Vec<String>,
    #[serde(default)]
    delay: f64,
    drive: DriveSpec,
    #[serde(default)]
    noise: WheelNoise,
    #[serde(default)]
    scanners: Vec<ScannerSpec>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    covariance: Option<CovarianceSpec>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "model", rename_all = "kebab-case", deny_unknown_fields)]
enum DriveSpec {
    Tricycle {
        drive_scale: f64,
        steering_offset: f64,
        wheelbase: f64,
        #[serde(default = "one")]
        steering_gain: f64,
    },
    TricycleAsymmetric {
        drive_scale: f64,
        steering_offset_forward: f64,
        steering_offset_backward: f64,
        wheelbase: f64,
        #[serde(default = "one")]
        steering_gain: f64,
    },
    Differential {
        left_radius: f64,
        right_radius: f64,
        axle: f64,
    },
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ScannerSpec {
    #[serde(default)]
    name: String,
    x: f64,
    y: f64,
    yaw: f64,
    #[serde(default)]
    range_offset: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CovarianceSpec {
    names: Vec<String>,
    matrix: Vec<Vec<f64>>,
}

fn one() -> f64 {
    1.0
}

impl TryFrom<VehicleSpec> for Vehicle {
    type Error = ModelError;

    fn try_from(spec: VehicleSpec) -> Result<Self, ModelError> {
        if spec.version != VERSION {
            return Err(ModelError::Vehicle(format!("version {}: this is version {VERSION}", spec.version)));
        }
        let scanners = spec.scanners.iter().map(Scanner::try_from).collect::<Result<_, _>>()?;
        let vehicle = Self::new(spec.drive.into(), scanners, spec.delay)?.with_noise(spec.noise)?;
        let covariance = spec.covariance.map_or_else(|| Ok(ParameterCovariance::default()), TryInto::try_into)?;
        vehicle.with_covariance(covariance)?.with_joints(spec.joints, spec.unit)
    }
}

impl From<DriveSpec> for Drive {
    fn from(spec: DriveSpec) -> Self {
        let tricycle = |scale, wheelbase, gain, offset_forward, offset_backward| {
            Self::Tricycle(Tricycle { scale, wheelbase, gain, offset_forward, offset_backward })
        };
        match spec {
            DriveSpec::Tricycle { drive_scale, steering_offset, wheelbase, steering_gain } => {
                tricycle(drive_scale, wheelbase, steering_gain, steering_offset, steering_offset)
            }
            DriveSpec::TricycleAsymmetric {
                drive_scale,
                steering_offset_forward,
                steering_offset_backward,
                wheelbase,
                steering_gain,
            } => tricycle(drive_scale, wheelbase, steering_gain, steering_offset_forward, steering_offset_backward),
            DriveSpec::Differential { left_radius: left, right_radius: right, axle } => {
                Self::Differential(Differential { left, right, axle })
            }
        }
    }
}

impl TryFrom<&ScannerSpec> for Scanner {
    type Error = ModelError;

    fn try_from(spec: &ScannerSpec) -> Result<Self, ModelError> {
        Self::new(spec.name.clone(), [spec.x, spec.y, spec.yaw], spec.range_offset)
    }
}

impl TryFrom<CovarianceSpec> for ParameterCovariance {
    type Error = ModelError;

    fn try_from(spec: CovarianceSpec) -> Result<Self, ModelError> {
        let n = spec.names.len();
        if spec.matrix.len() != n || spec.matrix.iter().any(|row| row.len() != n) {
            return Err(ModelError::Vehicle(format!("covariance: needs {n} rows of {n} numbers, one a name")));
        }
        Ok(Self { matrix: DMatrix::from_fn(n, n, |i, j| spec.matrix[i][j]), names: spec.names })
    }
}

impl From<Vehicle> for VehicleSpec {
    fn from(v: Vehicle) -> Self {
        let rows = |m: &DMatrix<f64>| m.row_iter().map(|row| row.iter().copied().collect()).collect();
        let written = |c: &ParameterCovariance| CovarianceSpec { names: c.names.clone(), matrix: rows(&c.matrix) };
        Self {
            version: VERSION,
            unit: v.unit,
            joints: v.joints.clone(),
            delay: v.delay,
            drive: DriveSpec::of(&v),
            noise: v.noise,
            scanners: v.scanners.iter().map(ScannerSpec::from).collect(),
            covariance: Some(&v.covariance).filter(|c| !c.names.is_empty()).map(written),
        }
    }
}

impl DriveSpec {
    fn of(vehicle: &Vehicle) -> Self {
        match vehicle.drive {
            Drive::Differential(Differential { left, right, axle }) => {
                Self::Differential { left_radius: left, right_radius: right, axle }
            }
            Drive::Tricycle(t) if vehicle.is_asymmetric() => Self::TricycleAsymmetric {
                drive_scale: t.scale,
                steering_offset_forward: t.offset_forward,
                steering_offset_backward: t.offset_backward,
                wheelbase: t.wheelbase,
                steering_gain: t.gain,
            },
            Drive::Tricycle(t) => Self::Tricycle {
                drive_scale: t.scale,
                steering_offset: t.offset_forward,
                wheelbase: t.wheelbase,
                steering_gain: t.gain,
            },
        }
    }
}

impl From<&Scanner> for ScannerSpec {
    fn from(s: &Scanner) -> Self {
        let m = s.mount;
        Self { name: s.name.clone(), x: m.x(), y: m.y(), yaw: m.theta(), range_offset: s.range_offset }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_geometry::Se2;

    fn read(text: &str) -> Result<Vehicle, String> {
        serde_json::from_str(text).map_err(|e| e.to_string())
    }

    const FORK: &str = r#"{"version": 2, "unit": "tick", "joints": ["drive", "steer"], "delay": -0.02,
        "drive": {"model": "tricycle", "drive_scale": 0.00025, "steering_offset": -0.01, "wheelbase": 1.4},
        "noise": {"slip": 0.002, "steering": 0.001, "memory": 5.0},
        "scanners": [{"name": "front", "x": 0.4, "y": 0.01, "yaw": 0.1, "range_offset": 0.02}, {"x": -1.0, "y": 0.0, "yaw": 3.1}],
        "covariance": {"names": ["wheelbase", "laser_yaw"], "matrix": [[1e-6, 1e-7], [1e-7, 1e-6]]}}"#;

    #[test]
    fn a_vehicle_is_read_and_comes_back() {
        let fork = read(FORK).unwrap();
        assert_eq!((fork.delay(), fork.noise().slip, fork.scanners().len()), (-0.02, 0.002, 2));
        assert_eq!((fork.mount().x(), fork.scanners()[0].range_offset), (0.4, 0.02));
        assert_eq!(fork.drive().parameters(), [0.00025, 1.4, 1.0, -0.01, -0.01]);
        assert_eq!(read(&serde_json::to_string(&fork).unwrap()).unwrap(), fork);
        let apart = FORK.replace("\"tricycle\"", "\"tricycle-asymmetric\"").replace(
            "\"steering_offset\": -0.01",
            "\"steering_offset_forward\": 0.01, \"steering_offset_backward\": 0.02",
        );
        let fork = read(&apart).unwrap();
        assert_eq!(fork.drive().parameters()[3..], [0.01, 0.02]);
        assert_eq!(read(&serde_json::to_string(&fork).unwrap()).unwrap(), fork);
    }

    #[test]
    fn what_is_left_out_has_its_default() {
        let cart = r#"{"version": 2, "drive": {"model": "differential", "left_radius": 0.1, "right_radius": 0.1, "axle": 0.4}}"#;
        let cart = read(cart).unwrap();
        assert_eq!((*cart.noise(), cart.unit(), cart.delay()), (WheelNoise::default(), CounterUnit::Rad, 0.0));
        assert_eq!(cart.mount(), Se2::IDENTITY);
    }

    #[test]
    fn every_number_is_refused_out_of_its_range() {
        let numbers = [
            ("drive_scale", "0.00025", vec!["0.0", "1e300", "-1e300"]),
            ("steering_offset", "-0.01", vec!["1e300", "-1e300", "4.0"]),
            ("wheelbase", "1.4", vec!["0.0", "1e300", "1e-300"]),
            ("delay", "-0.02", vec!["1e300", "-1e300"]),
            ("slip", "0.002", vec!["-1.0", "1e300"]),
            ("steering", "0.001", vec!["-1.0", "1e300"]),
            ("memory", "5.0", vec!["0.0", "-1.0", "1e300"]),
            ("x", "0.4", vec!["1e300", "-1e300"]),
            ("y", "0.01", vec!["1e300"]),
            ("yaw", "0.1", vec!["1e300"]),
            ("range_offset", "0.02", vec!["1e300", "-1e300"]),
        ];
        for (name, value, bad) in numbers {
            let field = format!("\"{name}\": {value}");
            assert!(FORK.contains(&field), "{field}");
            for bad in bad {
                let told = read(&FORK.replacen(&field, &format!("\"{name}\": {bad}"), 1)).unwrap_err();
                assert!(told.contains(name) && !told.contains('\n'), "{name} {bad}: {told}");
            }
        }
    }

    #[test]
    fn covariances_of_other_parameters_and_none_at_all_are_refused() {
        let with = |from: &str, to: &str| read(&FORK.replace(from, to)).unwrap_err();
        assert!(with("\"wheelbase\", \"laser_yaw\"", "\"axle\", \"laser_yaw\"").contains("axle"));
        assert!(with("\"wheelbase\", \"laser_yaw\"", "\"delay\", \"delay\"").contains("delay"));
        assert!(with("[1e-6, 1e-7]", "[1e-6, 3e-7]").contains("symmetric"));
        assert!(with("1e-7", "2e-6").contains("positive"));
        assert!(with("[1e-6, 1e-7], ", "").contains("2 rows"));
        assert!(with("\"drive\", \"steer\"", "\"drive\"").contains("joints"));
        assert!(with("\"version\": 2", "\"version\": 3").contains("version 3"));
    }
}
