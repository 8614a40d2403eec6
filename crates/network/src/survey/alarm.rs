//! A camera that was hit: its views fail the gate again and again, those of the others do not.
//!
//! One view may fail by chance (one in a thousand) or by a wrong detection; several of one camera in a row do not. Then
//! the camera is placed anew, from those views, and what was known of all others stays as it is: a re-survey of this
//! camera alone. When *all* cameras that follow seem moved, by about the same, the odometry has slipped instead.

/// Cameras in a row that must seem moved before the odometry is blamed.
const SLIPPED: usize = 3;

/// A camera that is not where it was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moved {
    /// Number of the camera.
    pub camera: usize,
    /// Number of the place where it was.
    pub from: usize,
    /// Number of the place where it is now.
    pub to: usize,
}

/// More cameras seem moved than are ever hit in one survey.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slip {
    /// How many.
    pub cameras: usize,
}

/// Whether so many cameras seem moved that the odometry must be wrong.
#[must_use]
pub fn slip(moved: &[Moved], cameras: usize) -> Option<Slip> {
    let count = moved.len();
    (count >= SLIPPED && 2 * count >= cameras).then_some(Slip { cameras: count })
}

/// Rejected views of each camera since its last good one.
pub(super) struct Watch {
    rejected: Vec<Vec<usize>>,
}

impl Watch {
    pub fn new(cameras: usize) -> Self {
        Self { rejected: vec![vec![]; cameras] }
    }

    pub fn agrees(&mut self, camera: usize) {
        self.rejected[camera].clear();
    }

    /// View `judged` of the camera was rejected.
    pub fn disagrees(&mut self, camera: usize, judged: usize) {
        self.rejected[camera].push(judged);
    }

    pub fn rejected(&self, camera: usize) -> &[usize] {
        &self.rejected[camera]
    }
}
