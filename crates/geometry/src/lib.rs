//! Rotations and rigid motions of the plane and of space, as Lie groups.
//!
//! One group a file. All share the conventions of `T_a_b`: an element takes coordinates in frame b to coordinates in
//! frame a, composition is `T_a_b * T_b_c`, tangents are right (body-frame) perturbations `T * exp(xi)` unless a name
//! says otherwise. Rotations are stored as unit complex numbers and unit quaternions.
//!
//! Source: J. Sola, J. Deray, D. Atchuthan, "A micro Lie theory for state estimation in robotics", arXiv 1812.01537.

pub mod angle;
pub mod gaussian;
pub mod lie_group;
pub mod se2;
pub mod se3;
pub mod separation;
mod series;
pub mod so2;
pub mod so3;

pub use angle::wrap;
pub use gaussian::{Gaussian, largest_sigma};
pub use lie_group::LieGroup;
pub use se2::Se2;
pub use se3::Se3;
pub use separation::Separation;
pub use so2::So2;
pub use so3::So3;
