//! Tags of a grid that the detector missed: they must be where their neighbours say, and read as they are printed.
//!
//! A missing tag is placed in two ways: by a polynomial of second order from the places of the grid to pixels, fitted to
//! the corners of the nearest tags found, which follows the bend of a lens; and by the homography of the nearest tag. Its
//! corners are fitted to the grey values, and it counts when at least three of them can be and its modules read as drawn:
//! black and white far enough apart, hardly a module on the wrong side. Tags added serve as neighbours in turn, so a grid fills up from what was seen.
//!
//! It never adds a tag to a grid of which nothing was seen.

use crate::apriltag::{Family, Tag};
use crate::corner::{Guess, refine};
use crate::error::VisionError;
use crate::image::Gray;
use groma_models::target::TagGrid;
use nalgebra::{Matrix3, SMatrix, SVector, Vector2};

/// Tags in a row or column between a missing tag and the neighbour that places it.
const FARTHEST: i64 = 2;
/// Share of the modules that may read wrong.
const MOST_WRONG: f64 = 0.05;
/// Least difference of white and black [grey].
const LEAST_CONTRAST: f64 = 20.0;
/// Tags that the polynomial goes through, at most and at least.
const NEIGHBOURS: usize = 6;
const LEAST_NEIGHBOURS: usize = 4;
/// Corners of the unit square in the order of those of a tag.
const CORNERS: [(f64, f64); 4] = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
/// Corners that must be fitted.
const FITTED: usize = 3;

/// Adds the tags of a grid that are there but were missed.
///
/// # Errors
/// [`VisionError`] when there is no such family or border.
pub fn complete(image: &Gray<'_>, tags: &mut Vec<Tag>, grid: &TagGrid, room: f64) -> Result<(), VisionError> {
    let family = Family::named(&grid.family)?;
    let ours = |tag: &Tag| tag.id >= grid.first_id && tag.id - grid.first_id < grid.tags();
    loop {
        let missing: Vec<u32> =
            (0..grid.tags()).filter(|k| !tags.iter().any(|tag| ours(tag) && tag.id - grid.first_id == *k)).collect();
        let mut added = vec![];
        for k in missing {
            let Some(drawing) = family.drawing(grid.first_id + k, grid.border)? else { continue };
            let near = nearest(tags, grid, k);
            let places = [bent(&near, grid, k), near.first().and_then(|from| placed(from, grid, k))];
            let found = places.into_iter().flatten().find_map(|placed| {
                let fitted = fitted(image, &placed, room)?;
                reads(image, &fitted, &drawing).map(|margin| Tag { margin, ..fitted })
            });
            added.extend(found);
        }
        if added.is_empty() {
            return Ok(());
        }
        tags.extend(added);
    }
}

/// The found tags nearest to a place of the grid, the nearest first and within reach.
fn nearest<'a>(tags: &'a [Tag], grid: &TagGrid, k: u32) -> Vec<&'a Tag> {
    let (column, row) = (i64::from(k % grid.columns), i64::from(k / grid.columns));
    let distance = |tag: &&Tag| {
        let place = tag.id - grid.first_id;
        let (dx, dy) = (i64::from(place % grid.columns) - column, i64::from(place / grid.columns) - row);
        dx.abs().max(dy.abs()) * 100 + dx.abs() + dy.abs()
    };
    let ours = tags.iter().filter(|tag| tag.id >= grid.first_id && tag.id - grid.first_id < grid.tags());
    let mut near: Vec<&Tag> = ours.collect();
    near.sort_by_key(distance);
    let reached = near.first().is_some_and(|tag| distance(tag) < (FARTHEST + 1) * 100);
    near.truncate(if reached { NEIGHBOURS } else { 0 });
    near
}

/// A tag of the grid where a polynomial through the corners of its neighbours says; nothing when they are too few.
fn bent(near: &[&Tag], grid: &TagGrid, k: u32) -> Option<Tag> {
    if near.len() < LEAST_NEIGHBOURS {
        return None;
    }
    let place = |k: u32, j: usize| {
        let [x, y] = grid.tag_origin(k);
        let (dx, dy) = CORNERS[j];
        Vector2::new(x / grid.size + dx, y / grid.size + dy)
    };
    let middle = place(k, 0);
    let powers = |p: Vector2<f64>| {
        let (x, y) = (0.2 * (p.x - middle.x), 0.2 * (p.y - middle.y));
        SVector::<f64, 6>::new(1.0, x, y, x * x, x * y, y * y)
    };
    let (mut normal, mut right) = (SMatrix::<f64, 6, 6>::identity() * 1e-9, SMatrix::<f64, 6, 2>::zeros());
    for tag in near {
        for (j, corner) in tag.corners.iter().enumerate() {
            let row = powers(place(tag.id - grid.first_id, j));
            normal += row * row.transpose();
            right += row * corner.transpose();
        }
    }
    let coefficients = normal.cholesky()?.solve(&right);
    let corners = [0, 1, 2, 3].map(|j| coefficients.transpose() * powers(place(k, j)));
    Some(Tag { id: grid.first_id + k, mended: 0, margin: 0.0, corners, seen: [false; 4] })
}

/// A tag of the grid where another one says that it is.
fn placed(from: &Tag, grid: &TagGrid, k: u32) -> Option<Tag> {
    let h = of_square(&from.corners)?;
    let ([x0, y0], [x, y]) = (grid.tag_origin(from.id - grid.first_id), grid.tag_origin(k));
    let base = Vector2::new(x - x0, y - y0) / grid.size;
    let corner = |dx: f64, dy: f64| through(&h, &(base + Vector2::new(dx, dy)));
    let corners = [corner(0.0, 0.0)?, corner(1.0, 0.0)?, corner(1.0, 1.0)?, corner(0.0, 1.0)?];
    Some(Tag { id: grid.first_id + k, mended: 0, margin: 0.0, corners, seen: [false; 4] })
}

/// The tag with its corners fitted, as many as can be.
fn fitted(image: &Gray<'_>, tag: &Tag, room: f64) -> Option<Tag> {
    let found = [0, 1, 2, 3].map(|j| refine(image, &Guess::of_tag(tag, j, room)));
    let seen = found.map(|corner| corner.is_some());
    let corners = [0, 1, 2, 3].map(|j| found[j].map_or(tag.corners[j], |corner| corner.pixel));
    (found.iter().flatten().count() >= FITTED).then_some(Tag { corners, seen, ..*tag })
}

/// Half the contrast when the modules read as drawn.
fn reads(image: &Gray<'_>, tag: &Tag, drawing: &[bool]) -> Option<f64> {
    let (h, modules) = (of_square(&tag.corners)?, drawing.len().isqrt());
    let middle = |k: usize| (k as f64 + 0.5) / modules as f64;
    let grey = |k: usize| {
        let place = Vector2::new(middle(k % modules), 1.0 - middle(k / modules));
        sample(image, &through(&h, &place)?)
    };
    let greys = (0..drawing.len()).map(grey).collect::<Option<Vec<f64>>>()?;
    let mean = |white: bool| {
        let of_colour: Vec<f64> = greys.iter().zip(drawing).filter(|(_, w)| **w == white).map(|(g, _)| *g).collect();
        of_colour.iter().sum::<f64>() / of_colour.len() as f64
    };
    let (white, black) = (mean(true), mean(false));
    let wrong = greys.iter().zip(drawing).filter(|(grey, drawn)| (**grey > 0.5 * (white + black)) != **drawn).count();
    let good = white - black >= LEAST_CONTRAST && wrong as f64 <= MOST_WRONG * drawing.len() as f64;
    good.then_some(0.5 * (white - black))
}

/// The grey value between pixels.
fn sample(image: &Gray<'_>, p: &Vector2<f64>) -> Option<f64> {
    let (x, y) = (p.x.floor(), p.y.floor());
    let at = |dx: i64, dy: i64| image.at(x as i64 + dx, y as i64 + dy);
    let (u, v) = (p.x - x, p.y - y);
    let (above, below) = (at(0, 0)? * (1.0 - u) + at(1, 0)? * u, at(0, 1)? * (1.0 - u) + at(1, 1)? * u);
    Some(above * (1.0 - v) + below * v)
}

/// The homography that takes the unit square (lower left, lower right, upper right, upper left) to four corners.
fn of_square(corners: &[Vector2<f64>; 4]) -> Option<Matrix3<f64>> {
    let (mut system, mut right) = (SMatrix::<f64, 8, 8>::zeros(), SVector::<f64, 8>::zeros());
    for (k, ((x, y), p)) in CORNERS.into_iter().zip(corners).enumerate() {
        let rows = [[x, y, 1.0, 0.0, 0.0, 0.0, -p.x * x, -p.x * y], [0.0, 0.0, 0.0, x, y, 1.0, -p.y * x, -p.y * y]];
        for (i, row) in rows.into_iter().enumerate() {
            system.row_mut(2 * k + i).copy_from(&SVector::<f64, 8>::from(row).transpose());
            right[2 * k + i] = p[i];
        }
    }
    let h = system.lu().solve(&right)?;
    Some(Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0))
}

fn through(h: &Matrix3<f64>, p: &Vector2<f64>) -> Option<Vector2<f64>> {
    let image = h * p.push(1.0);
    (image.z > 1e-9).then(|| image.xy() / image.z)
}
