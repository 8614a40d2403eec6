//! Why a pose graph could not be solved.

use groma_models::Cancelled;
use thiserror::Error;

/// The error of the pose graph.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Error {
    /// There is no node to hold.
    #[error("the pose graph has no nodes")]
    Empty,
    /// A node is not finite.
    #[error("node {node} of the pose graph is not finite")]
    Node {
        /// Its index.
        node: usize,
    },
    /// An edge cannot be used.
    #[error("edge {edge} of the pose graph: {why}")]
    Edge {
        /// Its index.
        edge: usize,
        /// What is wrong with it.
        why: String,
    },
    /// A node is not tied to node 0 by the edges that count.
    #[error("the pose graph falls apart: no chain of accepted edges leads from node 0 to node {node}")]
    Disconnected {
        /// The first such node.
        node: usize,
    },
    /// A node is tied, but not in every direction.
    #[error("the edges leave node {node} of the pose graph free to move in some direction")]
    Free {
        /// The node where it shows.
        node: usize,
    },
    /// An option is outside its range.
    #[error("option {name} of the pose graph: {why}")]
    Option {
        /// Its name.
        name: &'static str,
        /// What is wrong with it.
        why: &'static str,
    },
    /// There are not as many weights as edges, or one is negative or not finite.
    #[error("the pose graph has {edges} edges and needs as many weights, finite and not negative")]
    Weights {
        /// Number of edges.
        edges: usize,
    },
    /// The linear system could not be set up.
    #[error("pose graph: {0}")]
    Linear(groma_estimation::Error),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<groma_estimation::Error> for Error {
    fn from(error: groma_estimation::Error) -> Self {
        match error {
            groma_estimation::Error::NotPositiveDefinite { block } => Self::Free { node: block + 1 },
            other => Self::Linear(other),
        }
    }
}
