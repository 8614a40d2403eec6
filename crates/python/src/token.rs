//! Long work that can be watched and interrupted: it runs on a thread of its own while the caller's handles signals.

use crate::border;
use groma_models::Token as Core;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// Time between two looks at signals and progress.
const PERIOD: Duration = Duration::from_millis(50);

/// Cancels long work, and reports its progress.
#[pyclass(frozen, module = "groma._core")]
#[derive(Default)]
pub(crate) struct Token(pub(crate) Core);

#[pymethods]
impl Token {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// Asks the work to end with what it has.
    fn cancel(&self) {
        self.0.cancel();
    }

    #[getter]
    fn cancelled(&self) -> bool {
        self.0.is_cancelled()
    }

    /// Steps done and all steps of the stage; 0 of 0 where nobody counts.
    #[getter]
    fn progress(&self) -> (usize, usize) {
        self.0.progress()
    }
}

/// Runs work with the GIL released. Signals are handled meanwhile: an exception of a handler (Ctrl-C) cancels the work and is
/// raised once it has ended; a handler that cancels the token itself lets the work return what it has. `show` is called now
/// and then with the progress.
pub(crate) fn interruptible<T: Send>(
    py: Python<'_>,
    token: Option<&Token>,
    show: Option<&border::Progress>,
    work: impl FnOnce(&Core) -> T + Send,
) -> PyResult<T> {
    let token = token.map_or_else(Core::new, |t| t.0.clone());
    let (result, raised) = py.detach(|| {
        std::thread::scope(|scope| {
            let (done, ended) = channel::<()>();
            let own = token.clone();
            let worker = scope.spawn(move || {
                let result = work(&own);
                drop(done);
                result
            });
            let mut raised = None;
            while ended.recv_timeout(PERIOD) == Err(RecvTimeoutError::Timeout) {
                if let Err(error) = Python::attach(|py| look(py, &token, show)) {
                    token.cancel();
                    raised.get_or_insert(error);
                }
            }
            (worker.join(), raised)
        })
    });
    match (result, raised) {
        (Err(panic), _) => std::panic::resume_unwind(panic),
        (Ok(_), Some(error)) => Err(error),
        (Ok(value), None) => Ok(value),
    }
}

/// What cancelled work without a result raises, where no signal did.
pub(crate) fn cancelled() -> PyErr {
    PyKeyboardInterrupt::new_err("interrupted")
}

fn look(py: Python<'_>, token: &Core, show: Option<&border::Progress>) -> PyResult<()> {
    py.check_signals()?;
    show.map_or(Ok(()), |show| show.call(py, token.progress()))
}
