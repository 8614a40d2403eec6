//! What became of every view of a survey.

/// What became of a view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It placed its camera.
    Born,
    /// It passed the gate.
    Taken,
    /// It failed the gate.
    Rejected,
    /// Two poses explain it, and its camera is not placed yet.
    Undecided,
    /// No pose explains it.
    NoPose,
}

/// A view and what became of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    /// Number of the stop.
    pub stop: usize,
    /// Number of the camera.
    pub camera: usize,
    /// Number of the place that it speaks of.
    pub place: Option<usize>,
    /// Squared Mahalanobis distance of its innovation, 6 degrees of freedom; 0 for a birth, NaN without a pose.
    pub nis: f64,
    /// What became of it.
    pub verdict: Verdict,
}
