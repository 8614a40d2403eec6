//! How arrays cross the border to Python, and with which types.
//!
//! - Arrays that come in are [`In`]: read in place, of the right type and number of dimensions or refused.
//! - Arrays that go out are [`Array`]: numpy owns them.
//! - A result is a frozen class whose fields can be read; a machine is a class with `push`, `state`, `finish`.
//! - A value that people also keep as a file (settings, vehicle, camera, target, building, plan) is JSON, which serde
//!   and msgspec both check by field.
//!
//! The stubs (`_core.pyi`) are generated from the signatures; hence the types of arrays say their element here.

use numpy::ndarray::{Dimension, Ix1, Ix2, Ix3};
use numpy::{Element, IntoPyArray, PyArray, PyReadonlyArray};
use pyo3::exceptions::PyRuntimeError;
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
use std::ops::Deref;

/// A number that arrays of numpy hold.
pub(crate) trait Scalar: Element {
    /// Its name in numpy.
    const NAME: &'static str;
    /// `numpy.typing.NDArray[numpy.NAME]`.
    const HINT: PyStaticExpr = PyStaticExpr::Subscript {
        value: &PyStaticExpr::Attribute { value: &PyStaticExpr::Name { id: "numpy.typing" }, attr: "NDArray" },
        slice: &PyStaticExpr::Attribute { value: &PyStaticExpr::Name { id: "numpy" }, attr: Self::NAME },
    };
}

impl Scalar for f64 {
    const NAME: &'static str = "float64";
}
impl Scalar for f32 {
    const NAME: &'static str = "float32";
}
impl Scalar for i64 {
    const NAME: &'static str = "int64";
}
impl Scalar for i8 {
    const NAME: &'static str = "int8";
}
impl Scalar for u8 {
    const NAME: &'static str = "uint8";
}
impl Scalar for bool {
    const NAME: &'static str = "bool_";
}

/// An array that comes in.
pub(crate) struct In<'py, T: Scalar, D: Dimension>(PyReadonlyArray<'py, T, D>);

pub(crate) type In1<'py, T> = In<'py, T, Ix1>;
pub(crate) type In2<'py, T> = In<'py, T, Ix2>;
pub(crate) type In3<'py, T> = In<'py, T, Ix3>;

impl<'py, T: Scalar, D: Dimension> Deref for In<'py, T, D> {
    type Target = PyReadonlyArray<'py, T, D>;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl<'py, T: Scalar + 'py, D: Dimension + 'py> FromPyObject<'_, 'py> for In<'py, T, D> {
    type Error = PyErr;
    const INPUT_TYPE: PyStaticExpr = T::HINT;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        Ok(Self(object.extract()?))
    }
}

/// An array that numpy owns.
pub(crate) struct Array<T, D>(Py<PyArray<T, D>>);

pub(crate) type Array1<T> = Array<T, Ix1>;
pub(crate) type Array2<T> = Array<T, Ix2>;
pub(crate) type Array3<T> = Array<T, Ix3>;

/// An array of what an iterator gives.
pub(crate) fn column<T: Scalar>(py: Python<'_>, values: impl IntoIterator<Item = T>) -> Array1<T> {
    Array(PyArray::from_iter(py, values).unbind())
}

/// What numpy can own.
pub(crate) trait Out<T, D> {
    fn out(self, py: Python<'_>) -> Array<T, D>;
}

impl<T, D, A: IntoPyArray<Item = T, Dim = D>> Out<T, D> for A {
    fn out(self, py: Python<'_>) -> Array<T, D> {
        Array(self.into_pyarray(py).unbind())
    }
}

impl<'py, T: Scalar, D: Dimension> IntoPyObject<'py> for Array<T, D> {
    type Target = PyArray<T, D>;
    type Output = Bound<'py, Self::Target>;
    type Error = std::convert::Infallible;
    const OUTPUT_TYPE: PyStaticExpr = T::HINT;

    fn into_pyobject(self, py: Python<'py>) -> Result<Self::Output, Self::Error> {
        Ok(self.0.into_bound(py))
    }
}

impl<'py, T: Scalar, D: Dimension> IntoPyObject<'py> for &Array<T, D> {
    type Target = PyArray<T, D>;
    type Output = Bound<'py, Self::Target>;
    type Error = std::convert::Infallible;
    const OUTPUT_TYPE: PyStaticExpr = T::HINT;

    fn into_pyobject(self, py: Python<'py>) -> Result<Self::Output, Self::Error> {
        Ok(self.0.bind(py).clone())
    }
}

/// A value as JSON.
pub(crate) fn json(value: &impl serde::Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|e| PyRuntimeError::new_err(e.to_string()))
}

/// A function of Python that is called now and then with how far the work is.
pub(crate) struct Progress(Py<PyAny>);

impl Progress {
    pub(crate) fn call<V>(&self, py: Python<'_>, values: V) -> PyResult<()>
    where
        V: for<'py> pyo3::call::PyCallArgs<'py>,
    {
        self.0.call1(py, values).map(|_| ())
    }
}

impl<'py> FromPyObject<'_, 'py> for Progress {
    type Error = PyErr;
    /// `collections.abc.Callable[..., object]`.
    const INPUT_TYPE: PyStaticExpr = PyStaticExpr::Subscript {
        value: &PyStaticExpr::Attribute { value: &PyStaticExpr::Name { id: "collections.abc" }, attr: "Callable" },
        slice: &PyStaticExpr::Tuple { elts: &[PyStaticExpr::Name { id: "..." }, PyStaticExpr::Name { id: "object" }] },
    };

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        Ok(Self(object.to_owned().unbind()))
    }
}
