//! `groma.vision`: images in, corners out.

use crate::border::{self, In1, In2};
use crate::camera::{invalid, parse};
use groma_models::{Pattern, Target};
use groma_vision::{Family, Found, Gray, Guess, Options, VisionError};
use nalgebra::Vector2;
use pyo3::prelude::*;

type Floats = border::Array1<f64>;

/// A panel in an image: its place in the target; numbers, pixels (2 a corner) and sigmas of its corners; blur; counts of
/// tags left out (repeated, illegible, small, at the border, blurred) and of corners that could not be fitted.
type FoundPanel = (usize, Vec<u32>, Floats, Floats, f64, [usize; 6]);

/// The default gates as JSON.
#[pyfunction]
pub(crate) fn detection_defaults() -> PyResult<String> {
    serde_json::to_string(&Options::default()).map_err(invalid)
}

/// The grids of tags of a target in an image (height, width).
#[pyfunction]
pub(crate) fn find_tag_panels<'py>(
    py: Python<'py>,
    image: In2<'py, u8>,
    target: &str,
    options: &str,
) -> PyResult<Vec<FoundPanel>> {
    let (target, options): (Target, Options) = (parse(target)?, parse(options)?);
    let (pixels, [height, width]) = (image.as_slice()?, shape(&image));
    let search =
        || Gray::new(width, height, pixels).and_then(|gray| groma_vision::find_panels(&gray, &target, &options));
    let found = py.detach(search).map_err(invalid)?;
    Ok(found.into_iter().map(|(place, found)| to_python(py, place, &found)).collect())
}

fn to_python<'py>(py: Python<'py>, place: usize, found: &Found) -> FoundPanel {
    let counts = [found.repeated, found.illegible, found.small, found.at_border, found.blurred, found.unrefined];
    (
        place,
        found.corners.iter().map(|c| c.id).collect(),
        border::column(py, found.corners.iter().flat_map(|c| [c.pixel.x, c.pixel.y])),
        border::column(py, found.corners.iter().map(|c| c.sigma)),
        found.blur,
        counts,
    )
}

/// A tag: number, bits corrected, margin, corners (8).
type FoundTag = (u32, u32, f64, [f64; 8]);

/// All tags of a family in an image (height, width), by the detector alone.
#[pyfunction]
pub(crate) fn detect_tags(py: Python<'_>, image: In2<'_, u8>, family: &str, border: u32) -> PyResult<Vec<FoundTag>> {
    let (pixels, [height, width]) = (image.as_slice()?, shape(&image));
    let family = Family::named(family).map_err(invalid)?;
    let search = || Gray::new(width, height, pixels).and_then(|gray| groma_vision::detect_tags(&gray, family, border));
    let flat = |corners: [Vector2<f64>; 4]| -> [f64; 8] { std::array::from_fn(|k| corners[k / 2][k % 2]) };
    let found = py.detach(search).map_err(invalid)?;
    Ok(found.into_iter().map(|tag| (tag.id, tag.mended, tag.margin, flat(tag.corners))).collect())
}

/// Corners fitted near guesses (k, 2), whose edges run along directions (k, 4), with room (k) around: pixels (2 a corner),
/// sigmas and blurs; NaN where there is none.
#[pyfunction]
pub(crate) fn refine_corners<'py>(
    py: Python<'py>,
    image: In2<'py, u8>,
    guesses: In2<'py, f64>,
    directions: In2<'py, f64>,
    room: In1<'py, f64>,
) -> PyResult<(Floats, Floats, Floats)> {
    let (pixels, [height, width]) = (image.as_slice()?, shape(&image));
    let gray = Gray::new(width, height, pixels).map_err(|e: VisionError| invalid(e))?;
    let (guesses, directions, room) = (guesses.as_array(), directions.as_array(), room.as_array());
    let guess = |k: usize| Guess {
        pixel: Vector2::new(guesses[(k, 0)], guesses[(k, 1)]),
        first: Vector2::new(directions[(k, 0)], directions[(k, 1)]),
        second: Vector2::new(directions[(k, 2)], directions[(k, 3)]),
        room: room[k],
    };
    let count = guesses.nrows().min(directions.nrows()).min(room.len());
    let found: Vec<_> = (0..count).map(|k| groma_vision::refine(&gray, &guess(k))).collect();
    let each = |value: fn(&groma_vision::Corner) -> f64| found.iter().map(move |c| c.as_ref().map_or(f64::NAN, value));
    let nowhere = [f64::NAN; 2];
    let places = found.iter().flat_map(|c| c.map_or(nowhere, |c| c.pixel.into()));
    Ok((border::column(py, places), border::column(py, each(|c| c.sigma)), border::column(py, each(|c| c.blur))))
}

/// The modules of every tag of a grid, row by row from the top, true where white.
#[pyfunction]
pub(crate) fn tag_drawings(pattern: &str) -> PyResult<Vec<Vec<bool>>> {
    match parse::<Pattern>(pattern)? {
        Pattern::TagGrid(grid) => groma_vision::tag_drawings(&grid).map_err(invalid),
        _ => Ok(vec![]),
    }
}

fn shape(image: &In2<'_, u8>) -> [usize; 2] {
    [image.as_array().nrows(), image.as_array().ncols()]
}
