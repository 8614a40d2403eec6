//! What the signs of a vehicle say about how it is wired.
//!
//! ```text
//! both radii negative      left and right are swapped: counts that rise drive it backward, and turn it the right way
//! axle negative            left and right are swapped
//! one radius negative      that wheel counts backward
//! drive_scale negative     the driven wheel counts backward
//! steering_gain negative   the encoder of the steering counts clockwise
//! ```
//!
//! A motion cannot tell swapped wheels from wheels that both count backward: with the front taken for the rear, both make the
//! same motions. Swapped joints are by far the more common.

use super::Vehicle;
use crate::drive::Drive;
use crate::finding::{Code, Finding};

impl Vehicle {
    /// Whether its wheels are wired as their names say.
    #[must_use]
    pub fn handedness(&self) -> Vec<Finding> {
        match *self.drive() {
            Drive::Differential(d) => {
                let signs = (d.left < 0.0, d.right < 0.0, d.axle < 0.0);
                let swapped = (signs.0 && signs.1) != signs.2;
                let reversed = [("left", d.left, signs.0 && !signs.1), ("right", d.right, signs.1 && !signs.0)];
                let swapped = swapped.then(|| {
                    let text = "left and right wheel are swapped, or both count backward: the vehicle of this estimate \
                                faces backward";
                    Finding::new(Code::WheelsSwapped, text).with("left_radius", d.left, "m").with(
                        "right_radius",
                        d.right,
                        "m",
                    )
                });
                let reversed = reversed.iter().filter(|(_, _, is)| *is).map(|(side, radius, _)| {
                    Finding::new(Code::WheelReversed, format!("the {side} wheel counts backward"))
                        .with("radius", *radius, "m")
                });
                swapped.into_iter().chain(reversed).collect()
            }
            Drive::Tricycle(t) => {
                let told = |is: bool, text: &str, name, value: f64, unit| {
                    is.then(|| Finding::new(Code::WheelReversed, text).with(name, value, unit))
                };
                let scale = told(t.scale < 0.0, "the driven wheel counts backward", "drive_scale", t.scale, "m");
                let gain = "the encoder of the steering counts clockwise";
                scale.into_iter().chain(told(t.gain < 0.0, gain, "steering_gain", t.gain, "1")).collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Differential, Tricycle};

    fn codes(drive: Drive) -> Vec<(Code, String)> {
        Vehicle::new(drive, Vec::new(), 0.0).unwrap().handedness().into_iter().map(|f| (f.code, f.text)).collect()
    }

    #[test]
    fn a_wheel_that_counts_backward_is_named() {
        let told = |left, right| codes(Drive::Differential(Differential { left, right, axle: 0.5 }));
        assert!(told(0.1, 0.1).is_empty());
        assert!(matches!(&told(-0.1, 0.1)[..], [(Code::WheelReversed, text)] if text.contains("left wheel")));
        assert!(matches!(&told(0.1, -0.1)[..], [(Code::WheelReversed, text)] if text.contains("right wheel")));
        assert!(matches!(&told(-0.1, -0.1)[..], [(Code::WheelsSwapped, _)]));
        let crossed = codes(Drive::Differential(Differential { left: 0.1, right: 0.1, axle: -0.5 }));
        assert!(matches!(&crossed[..], [(Code::WheelsSwapped, _)]));
    }

    #[test]
    fn a_wheel_behind_is_no_fault_of_a_tricycle() {
        let told = |p| codes(Drive::Tricycle(Tricycle::from_parameters(p)));
        assert!(told([0.1, -1.2, 1.0, 0.0, 0.0]).is_empty());
        assert_eq!(told([-0.1, 1.2, 1.0, 0.0, 0.0]).len(), 1);
        assert!(told([0.1, 1.2, -1.0, 0.0, 0.0])[0].1.contains("steering"));
    }
}
