//! The unknowns: a vehicle as nine numbers, and which of them are free.
//!
//! ```text
//! x = (five of the drive, laser x, y, yaw, delay)
//! ```
//!
//! A free parameter may move several of the nine: the one steering offset of a symmetric tricycle moves both.

use super::Error;
use groma_geometry::{Se2, wrap};
use groma_models::{Differential, Drive, Tricycle, WheelKind, increment};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};

/// All parameters.
pub const FULL: usize = increment::PARAMETERS + 4;
/// Where the pose of the laser begins.
pub const LASER: usize = increment::PARAMETERS;
/// Where the delay is.
pub const DELAY: usize = FULL - 1;
/// Where a tricycle has its drive scale, wheelbase, gain and offsets.
pub const SCALE: usize = 0;
/// See [`SCALE`].
pub const WHEELBASE: usize = 1;
/// See [`SCALE`].
pub const GAIN: usize = 2;
/// See [`SCALE`].
pub const OFFSET_FORWARD: usize = 3;
/// See [`SCALE`].
pub const OFFSET_BACKWARD: usize = 4;

/// Numbers of a vehicle, or derivatives by them.
pub type Full = SVector<f64, FULL>;
/// A matrix over all parameters.
pub type FullSquare = SMatrix<f64, FULL, FULL>;

/// What kind of vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// Steered wheel, one offset.
    Tricycle,
    /// Steered wheel, an offset forward and one backward.
    TricycleAsymmetric,
    /// Two driven wheels.
    Differential,
}

impl Model {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Tricycle, Self::TricycleAsymmetric, Self::Differential];

    /// Its name at the interfaces.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Tricycle => "tricycle",
            Self::TricycleAsymmetric => "tricycle-asymmetric",
            Self::Differential => "differential",
        }
    }

    /// The log it needs.
    #[must_use]
    pub fn wheels(self) -> WheelKind {
        if self == Self::Differential { WheelKind::Differential } else { WheelKind::Steered }
    }
}

/// A vehicle: its drive, `T_base_laser`, and the delay: wheels are read at the time of a scan plus it [s].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vehicle {
    /// The drive.
    pub drive: Drive,
    /// `T_base_laser`.
    pub laser: Se2,
    /// Delay [s].
    pub delay: f64,
}

impl Vehicle {
    /// The nine numbers.
    #[must_use]
    pub fn to_full(&self) -> Full {
        let (p, l) = (self.drive.parameters(), self.laser.to_vector());
        Full::from_iterator(p.into_iter().chain([l.x, l.y, l.z, self.delay]))
    }

    /// The same kind of vehicle from nine numbers.
    #[must_use]
    pub fn with_full(&self, x: &Full) -> Self {
        let drive = self.drive.with_parameters([x[0], x[1], x[2], x[3], x[4]]);
        Self { drive, laser: Se2::new(x[LASER], x[LASER + 1], x[LASER + 2]), delay: x[DELAY] }
    }

    /// With steering offsets within a quarter turn: scale and offset say the same with the other sign and half a turn
    /// more, and a wheel that counts backward is recognised by its scale.
    #[must_use]
    pub fn upright(self) -> Self {
        let Drive::Tricycle(t) = self.drive else { return self };
        if wrap(t.offset_forward).abs() <= std::f64::consts::FRAC_PI_2 {
            let (offset_forward, offset_backward) = (wrap(t.offset_forward), wrap(t.offset_backward));
            return Self { drive: Drive::Tricycle(Tricycle { offset_forward, offset_backward, ..t }), ..self };
        }
        let turned = |offset: f64| wrap(offset + std::f64::consts::PI);
        let (offset_forward, offset_backward) = (turned(t.offset_backward), turned(t.offset_forward));
        Self { drive: Drive::Tricycle(Tricycle { scale: -t.scale, offset_forward, offset_backward, ..t }), ..self }
    }
}

impl Vehicle {
    /// With counts that rise forward: where the gain is free, data cannot tell a vehicle from the same with front and
    /// rear exchanged, whose scale, gain and offsets have the other sign.
    #[must_use]
    pub fn facing_forward(self) -> Self {
        let Drive::Tricycle(t) = self.drive else { return self };
        if t.scale > 0.0 {
            return self;
        }
        let drive = Tricycle {
            scale: -t.scale,
            gain: -t.gain,
            offset_forward: -t.offset_backward,
            offset_backward: -t.offset_forward,
            ..t
        };
        Self { drive: Drive::Tricycle(drive), laser: Se2::new(0.0, 0.0, std::f64::consts::PI) * self.laser, ..self }
    }
}

/// What is estimated.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// The kind of vehicle.
    pub model: Model,
    columns: Vec<Column>,
}

/// A free parameter: its name, the numbers that it moves, and the error at which it says nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Column {
    name: &'static str,
    moves: [usize; 2],
    useless: Useless,
}

/// An error beyond which knowing a parameter is of no use: a tape measure does better.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Useless {
    /// In its own unit.
    Absolute(f64),
    /// As a share of its value.
    Relative(f64),
}

const ANGLE: Useless = Useless::Absolute(0.05);
const PLACE: Useless = Useless::Absolute(0.1);
const SHARE: Useless = Useless::Relative(0.1);

const fn column(name: &'static str, index: usize, useless: Useless) -> Column {
    Column { name, moves: [index, index], useless }
}

impl Layout {
    /// The parameters of a model, and of `wheelbase`, `gain`, `delay` those that are named.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a name that the model does not have.
    pub fn new(model: Model, free: &[&str]) -> Result<Self, Error> {
        let known: &[&str] = if model == Model::Differential { &["delay"] } else { &["wheelbase", "gain", "delay"] };
        if let Some(name) = free.iter().find(|name| !known.contains(name)) {
            let (model, known) = (model.name(), known.join(", "));
            return Err(Error::Parameter(format!("{name} cannot be free in the model {model}: only {known} can")));
        }
        let mut columns = drive_columns(model, free);
        columns.extend([
            column("laser_x", LASER, PLACE),
            column("laser_y", LASER + 1, PLACE),
            column("laser_yaw", LASER + 2, ANGLE),
        ]);
        if free.contains(&"delay") {
            columns.push(column("delay", DELAY, Useless::Absolute(0.2)));
        }
        Ok(Self { model, columns })
    }

    /// Number of free parameters.
    #[must_use]
    pub fn len(&self) -> usize {
        self.columns.len()
    }

    /// Never: a vehicle has unknowns.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// Names of the free parameters, in their order.
    #[must_use]
    pub fn names(&self) -> Vec<&'static str> {
        self.columns.iter().map(|c| c.name).collect()
    }

    /// Where a name is among the free parameters.
    #[must_use]
    pub fn position(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|c| c.name == name)
    }

    /// Whether one of the nine is free.
    #[must_use]
    pub fn is_free(&self, index: usize) -> bool {
        self.columns.iter().any(|c| c.moves.contains(&index))
    }

    /// Values of the free parameters.
    #[must_use]
    pub fn values(&self, x: &Full) -> DVector<f64> {
        DVector::from_iterator(self.len(), self.columns.iter().map(|c| x[c.moves[0]]))
    }

    /// The nine numbers after a step of the free ones.
    #[must_use]
    pub fn moved(&self, x: &Full, step: &DVector<f64>) -> Full {
        let mut x = *x;
        for (column, step) in self.columns.iter().zip(step.iter()) {
            let [a, b] = column.moves;
            x[a] += step;
            if a != b {
                x[b] += step;
            }
        }
        x
    }

    /// Information on the free parameters from information on all.
    #[must_use]
    pub fn reduced(&self, full: &FullSquare) -> DMatrix<f64> {
        let part = |c: &Column| if c.moves[0] == c.moves[1] { 1 } else { 2 };
        DMatrix::from_fn(self.len(), self.len(), |r, c| {
            let (row, col) = (self.columns[r], self.columns[c]);
            let rows = row.moves.iter().take(part(&row));
            rows.map(|&i| col.moves.iter().take(part(&col)).map(|&j| full[(i, j)]).sum::<f64>()).sum()
        })
    }

    /// A gradient by the free parameters from one by all.
    #[must_use]
    pub fn reduced_vector(&self, full: &Full) -> DVector<f64> {
        let sum = |c: &Column| full[c.moves[0]] + if c.moves[0] == c.moves[1] { 0.0 } else { full[c.moves[1]] };
        DVector::from_iterator(self.len(), self.columns.iter().map(sum))
    }

    /// Errors of the free parameters beyond which knowing them is of no use.
    #[must_use]
    pub fn useless(&self, x: &Full) -> DVector<f64> {
        let limit = |c: &Column| match c.useless {
            Useless::Absolute(limit) => limit,
            Useless::Relative(share) => (share * x[c.moves[0]].abs()).max(f64::MIN_POSITIVE.sqrt()),
        };
        DVector::from_iterator(self.len(), self.columns.iter().map(limit))
    }
}

fn drive_columns(model: Model, free: &[&str]) -> Vec<Column> {
    if model == Model::Differential {
        let [left, right, axle] = Differential::NAMES;
        return vec![column(left, 0, SHARE), column(right, 1, SHARE), column(axle, 2, SHARE)];
    }
    let names = Tricycle::NAMES;
    let offset = Column { name: "steering_offset", moves: [OFFSET_FORWARD, OFFSET_BACKWARD], useless: ANGLE };
    let offsets = [OFFSET_FORWARD, OFFSET_BACKWARD].map(|index| column(names[index], index, ANGLE));
    let mut columns = if model == Model::Tricycle { vec![offset] } else { offsets.to_vec() };
    columns.push(column(names[SCALE], SCALE, SHARE));
    let optional = [("wheelbase", WHEELBASE), ("gain", GAIN)];
    columns.extend(
        optional.iter().filter(|(n, _)| free.contains(n)).map(|&(_, index)| column(names[index], index, SHARE)),
    );
    columns
}
