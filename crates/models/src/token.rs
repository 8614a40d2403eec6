//! Progress and cancelling of long work: shared by who works and who waits.
//!
//! The worker calls [`Token::check`] at least every 100 ms and returns what it has, or [`Cancelled`]; the waiting thread reads the
//! progress and may cancel from another thread. A token decides nothing else: results never depend on progress, only on
//! whether the work was cancelled.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use thiserror::Error;

/// The work was cancelled before it was done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("interrupted")]
pub struct Cancelled;

/// A handle on running work; clones share it.
#[derive(Clone, Debug, Default)]
pub struct Token(Arc<State>);

#[derive(Debug, Default)]
struct State {
    cancelled: AtomicBool,
    done: AtomicUsize,
    total: AtomicUsize,
}

impl Token {
    /// A token of its own.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Asks the work to end.
    pub fn cancel(&self) {
        self.0.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether the work was asked to end.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        self.0.cancelled.load(Ordering::Relaxed)
    }

    /// An error once the work was asked to end: `token.check()?` in every loop that may last.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }

    /// Begins a stage of `total` steps.
    pub fn begin(&self, total: usize) {
        self.0.done.store(0, Ordering::Relaxed);
        self.0.total.store(total, Ordering::Relaxed);
    }

    /// Counts a step, and checks.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn step(&self) -> Result<(), Cancelled> {
        self.0.done.fetch_add(1, Ordering::Relaxed);
        self.check()
    }

    /// Steps done and all steps of the stage; 0 of 0 where nobody counts.
    #[must_use]
    pub fn progress(&self) -> (usize, usize) {
        (self.0.done.load(Ordering::Relaxed), self.0.total.load(Ordering::Relaxed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clone_cancels_the_work() {
        let token = Token::new();
        let other = token.clone();
        token.begin(3);
        assert_eq!((token.step(), other.progress()), (Ok(()), (1, 3)));
        other.cancel();
        assert_eq!((token.step(), token.check()), (Err(Cancelled), Err(Cancelled)));
    }
}
