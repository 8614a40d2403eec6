//! `groma.exploration`: graphs, settings and events as JSON in, runs as JSON out.

use crate::border;
use crate::token::{Token, cancelled, interruptible};
use groma_models::Token as Work;
use groma_planning::exploration::monte_carlo::try_walk_while;
use groma_planning::exploration::run::Stop;
use groma_planning::exploration::{Event, Explorer, Graph, Noise, Place, Scene, Settings, explore_while};
use pyo3::call::PyCallArgs;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde::de::DeserializeOwned;

/// The default settings.
#[pyfunction]
pub(crate) fn exploration_defaults() -> PyResult<String> {
    serde_json::to_string(&Settings::default()).map_err(invalid)
}

/// The graph of a scene.
#[pyfunction]
pub(crate) fn exploration_scene(scene: &str) -> PyResult<String> {
    let graph = read::<Scene>(scene)?.graph().map_err(invalid)?;
    serde_json::to_string(&graph).map_err(invalid)
}

/// Refuses a graph that cannot be driven.
#[pyfunction]
pub(crate) fn exploration_check(graph: &str) -> PyResult<()> {
    read::<Graph>(graph)?.validate().map_err(invalid)
}

/// One whole exploration; `tell`, if given, is called at each stop with the distance and the number of cameras found.
#[pyfunction]
#[pyo3(signature = (graph, settings, tell, token=None))]
pub(crate) fn exploration_run(
    py: Python<'_>,
    graph: &str,
    settings: &str,
    tell: Option<border::Progress>,
    token: Option<&Token>,
) -> PyResult<String> {
    let (graph, settings) = (read::<Graph>(graph)?, read::<Settings>(settings)?);
    let mut told = Ok(());
    let run = interruptible(py, token, None, |token| {
        explore_while(&graph, &settings, &mut |stop: &Stop| {
            told = asked(tell.as_ref(), token, (stop.length, stop.cameras.len()));
            told.is_ok()
        })
    })?;
    told?;
    serde_json::to_string(&run.map_err(invalid)?).map_err(invalid)
}

/// Calls back; an error once the token cancels the work.
fn asked<V>(tell: Option<&border::Progress>, token: &Work, values: V) -> PyResult<()>
where
    V: for<'py> PyCallArgs<'py>,
{
    token.check().map_err(|_| cancelled())?;
    tell.map_or(Ok(()), |tell| Python::attach(|py| tell.call(py, values)))
}

/// Errors of the cameras in many noisy drives, of the map by least squares and of the filter's; `tell`, if given, is
/// called with the drives that are done and their number.
#[pyfunction]
#[pyo3(signature = (graph, walk, noise, runs, seed, tell, token=None))]
#[expect(clippy::too_many_arguments, reason = "one argument a part of the request: Python names them")]
pub(crate) fn exploration_try(
    py: Python<'_>,
    graph: &str,
    walk: Vec<usize>,
    noise: &str,
    runs: usize,
    seed: u64,
    tell: Option<border::Progress>,
    token: Option<&Token>,
) -> PyResult<String> {
    let (graph, noise) = (read::<Graph>(graph)?, read::<Noise>(noise)?);
    let mut told = Ok(());
    let tried = interruptible(py, token, None, |token| {
        try_walk_while(&graph, &walk, &noise, (runs, seed), &mut |done: usize| {
            told = asked(tell.as_ref(), token, (done, runs));
            told.is_ok()
        })
    })?;
    told?;
    serde_json::to_string(&tried.map_err(invalid)?).map_err(invalid)
}

/// A robot that explores.
#[pyclass(module = "groma._core")]
pub(crate) struct ExplorerState(Explorer);

#[pymethods]
impl ExplorerState {
    #[new]
    fn new(settings: &str, announced: usize, start: &str, heading: f64) -> PyResult<Self> {
        let (settings, start) = (read::<Settings>(settings)?, read::<Place>(start)?);
        Explorer::new(settings, announced, &start, heading).map(Self).map_err(invalid)
    }

    fn next_exit(&mut self, py: Python<'_>) -> Option<usize> {
        py.detach(|| self.0.next_exit())
    }

    fn observe(&mut self, event: &str) -> PyResult<()> {
        self.0.observe(&read::<Event>(event)?).map_err(invalid)
    }

    fn driven(&self) -> f64 {
        self.0.driven()
    }

    fn sigma(&self) -> f64 {
        self.0.belief().sigma()
    }

    fn has_found_all(&self) -> bool {
        self.0.has_found_all()
    }
}

fn read<T: DeserializeOwned>(json: &str) -> PyResult<T> {
    serde_json::from_str(json).map_err(invalid)
}

fn invalid(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}
