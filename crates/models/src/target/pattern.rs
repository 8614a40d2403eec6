//! What is printed on a panel, and where its corners are.
//!
//! Tag grid (Kalibr's "aprilgrid"): x to the right, y up, z out of the panel towards who looks at it; the origin is the
//! lower left corner of the black square of the first tag. Tags go by rows from the bottom, the corners of tag k are
//! `4 k + 0..4`: lower left, lower right, upper right, upper left. Kalibr's grids have a border of two modules and small
//! black squares where four tags meet.
//!
//! Chessboard and ChArUco (OpenCV): x to the right, y down, z into the panel; the inner corners go by rows from the top,
//! from 0. The origin is the first inner corner of a chessboard, the upper left corner of a ChArUco board.

use crate::bounds::LENGTH;
use crate::error::{ModelError, require};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// A pattern with numbered corners.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Pattern {
    /// A grid of AprilTags.
    #[serde(rename = "aprilgrid")]
    TagGrid(TagGrid),
    /// A plain chessboard.
    Chessboard(Chessboard),
    /// A chessboard with ArUco markers in its white squares.
    Charuco(Charuco),
}

/// A grid of AprilTags, or one tag.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TagGrid {
    /// Family of the tags, such as `tag36h11`.
    pub family: String,
    /// Tags in a row.
    pub columns: u32,
    /// Rows of tags.
    pub rows: u32,
    /// Edge of the black square of a tag [m].
    pub size: f64,
    /// Gap between tags as a share of their size.
    pub spacing: f64,
    /// Number of the lower left tag; the others follow.
    pub first_id: u32,
    /// Width of the black border in modules: 1, or 2 as Kalibr prints it.
    pub border: u32,
}

/// A chessboard.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Chessboard {
    /// Inner corners in a row.
    pub columns: u32,
    /// Rows of inner corners.
    pub rows: u32,
    /// Edge of a square [m].
    pub square: f64,
}

/// A ChArUco board.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Charuco {
    /// Dictionary of the markers, such as `DICT_6X6_250`.
    pub dictionary: String,
    /// Squares in a row.
    pub columns: u32,
    /// Rows of squares.
    pub rows: u32,
    /// Edge of a square [m].
    pub square: f64,
    /// Edge of a marker [m].
    pub marker: f64,
    /// Number of the first marker; the others follow.
    pub first_id: u32,
    /// Whether it was made by OpenCV before 4.6, which put markers elsewhere when the number of rows is even.
    pub legacy: bool,
}

impl TagGrid {
    /// Number of tags.
    #[must_use]
    pub fn tags(&self) -> u32 {
        self.columns * self.rows
    }

    /// Lower left corner of the k-th tag [m].
    #[must_use]
    pub fn tag_origin(&self, k: u32) -> [f64; 2] {
        let pitch = self.size * (1.0 + self.spacing);
        [f64::from(k % self.columns) * pitch, f64::from(k / self.columns) * pitch]
    }
}

impl Pattern {
    /// Number of corners.
    #[must_use]
    pub fn corner_count(&self) -> u32 {
        match self {
            Self::TagGrid(grid) => 4 * grid.tags(),
            Self::Chessboard(board) => board.columns * board.rows,
            Self::Charuco(board) => (board.columns - 1) * (board.rows - 1),
        }
    }

    /// A corner in the frame of the panel [m], if there is one of this number.
    #[must_use]
    pub fn corner(&self, id: u32) -> Option<Vector3<f64>> {
        if id >= self.corner_count() {
            return None;
        }
        let (x, y) = match self {
            Self::TagGrid(grid) => {
                let [x, y] = grid.tag_origin(id / 4);
                let (right, up) = (matches!(id % 4, 1 | 2), id % 4 > 1);
                (x + if right { grid.size } else { 0.0 }, y + if up { grid.size } else { 0.0 })
            }
            Self::Chessboard(board) => lattice(id, board.columns, board.square, 0.0),
            Self::Charuco(board) => lattice(id, board.columns - 1, board.square, board.square),
        };
        Some(Vector3::new(x, y, 0.0))
    }

    /// All corners in the order of their numbers [m].
    #[must_use]
    pub fn corners(&self) -> Vec<Vector3<f64>> {
        (0..self.corner_count()).filter_map(|id| self.corner(id)).collect()
    }

    /// Whether a detector could take one for the other.
    #[must_use]
    pub fn is_mistaken_for(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::TagGrid(a), Self::TagGrid(b)) => {
                let meet = a.first_id < b.first_id.saturating_add(b.tags())
                    && b.first_id < a.first_id.saturating_add(a.tags());
                a.family == b.family && meet
            }
            (Self::Chessboard(a), Self::Chessboard(b)) => {
                (a.columns, a.rows) == (b.columns, b.rows) || (a.columns, a.rows) == (b.rows, b.columns)
            }
            (Self::Charuco(a), Self::Charuco(b)) => {
                let last = |board: &Charuco| board.first_id.saturating_add(board.markers());
                let (last_a, last_b) = (last(a), last(b));
                a.dictionary == b.dictionary && a.first_id < last_b && b.first_id < last_a
            }
            _ => false,
        }
    }

    pub(super) fn check(&self) -> Result<(), ModelError> {
        match self {
            Self::TagGrid(grid) => {
                count("columns", grid.columns, 1)?;
                count("rows", grid.rows, 1)?;
                require("border", f64::from(grid.border), (1..=2).contains(&grid.border), "is 1 or 2 modules")?;
                LENGTH.check("size", grid.size)?;
                require("spacing", grid.spacing, (0.0..=100.0).contains(&grid.spacing), "must be from 0 to 100 sizes")
            }
            Self::Chessboard(board) => {
                count("columns", board.columns, 2)?;
                count("rows", board.rows, 2)?;
                LENGTH.check("square", board.square)
            }
            Self::Charuco(board) => {
                count("columns", board.columns, 2)?;
                count("rows", board.rows, 2)?;
                LENGTH.check("square", board.square)?;
                let fits = board.marker >= LENGTH.low && board.marker < board.square;
                require("marker", board.marker, fits, "a marker is smaller than its square")
            }
        }
    }
}

impl Charuco {
    /// Number of markers: one a white square.
    #[must_use]
    pub fn markers(&self) -> u32 {
        self.columns * self.rows / 2
    }
}

fn count(name: &'static str, value: u32, least: u32) -> Result<(), ModelError> {
    require(name, f64::from(value), (least..=1000).contains(&value), "is between the least that makes sense and 1000")
}

fn lattice(id: u32, columns: u32, step: f64, first: f64) -> (f64, f64) {
    (first + f64::from(id % columns) * step, first + f64::from(id / columns) * step)
}
