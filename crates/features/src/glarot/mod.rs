//! GLAROT: a signature of a set of landmarks that does not move when the set is turned or shifted.
//!
//! Every pair of landmarks has a length rho and a direction theta in [0, pi). The signature is the histogram of all pairs
//! over (theta, rho), each pair spread by a Gaussian kernel that is circular in theta:
//!
//! ```text
//! G(b, r) = sum over pairs of k_theta(theta - theta_b) k_rho(rho - rho_r),   scaled to a sum of one
//! d(G, F) = 1/2 min over t of  sum over b, r of | G(b, r) - F((b + t) mod n_theta, r) |
//! ```
//!
//! Shifting the set moves no pair; turning it by phi shifts theta. So the best t tells the turn, up to half a turn.
//! d is the share of the pairs that have no counterpart, 0 to 1.
//!
//! Source: Kallasi, Rizzini, "Efficient loop closure based on FALKO lidar features", IROS 2016; the histogram without
//! rotation invariance is GLARE (Himstedt et al. 2014): [`Signature::distance_unturned`].
//!
//! Sums are of integers, so the order of the landmarks does not matter, to the last bit. Pairs beyond `rho_max` do not
//! count. Landmarks are not weighted and their kind is not looked at.

mod difference;
mod glare;
mod halves;
mod index;
mod kernel;
mod options;
mod signature;

pub use index::{Candidate, Index};
pub use options::Options;
pub use signature::Signature;
