//! All grids of tags of a target in one image.

use crate::apriltag::{Family, Tag, detect_tags};
use crate::error::VisionError;
use crate::grid::{Found, Options, find_grid};
use crate::image::Gray;
use groma_models::target::{Pattern, TagGrid, Target};

/// Of each panel that is a grid of tags, its place in the target and what was found of it. The image is searched once
/// for each family and border.
///
/// # Errors
/// [`VisionError`] when there is no such family or border, or no memory.
pub fn find_panels(image: &Gray<'_>, target: &Target, options: &Options) -> Result<Vec<(usize, Found)>, VisionError> {
    let mut searched: Vec<(&str, u32, Vec<Tag>)> = vec![];
    let mut found = vec![];
    for (place, panel) in target.panels.iter().enumerate() {
        let Pattern::TagGrid(grid) = &panel.pattern else { continue };
        if !searched.iter().any(|(family, border, _)| *family == grid.family && *border == grid.border) {
            let tags = tags_of_grid(image, Family::named(&grid.family)?, grid.border)?;
            searched.push((&grid.family, grid.border, tags));
        }
        let tags = searched.iter().find(|(family, border, _)| *family == grid.family && *border == grid.border);
        found.push((place, find_grid(image, tags.map_or(&[], |t| &t.2), grid, options)?));
    }
    Ok(found)
}

/// The tags in an image. Those with a border of two modules stand in Kalibr's grids, where black squares touch them at
/// their corners; blur joins the two, and the detector sees no square any more. So they are looked for in an image whose
/// white has grown by a pixel as well: that parts them, and the corners are moved back.
fn tags_of_grid(image: &Gray<'_>, family: Family, border: u32) -> Result<Vec<Tag>, VisionError> {
    let mut tags = detect_tags(image, family, border)?;
    if border > 1 {
        let grown = whitened(image);
        let parted = detect_tags(&Gray::new(image.width(), image.height(), &grown)?, family, border)?;
        let alone = |tag: &Tag| !tags.iter().any(|known| known.id == tag.id);
        let added: Vec<Tag> = parted.into_iter().filter(alone).map(regrown).collect();
        tags.extend(added);
    }
    tags.sort_by_key(|tag| tag.id);
    Ok(tags)
}

/// Every pixel as bright as the brightest of its 3 x 3 neighbours.
fn whitened(image: &Gray<'_>) -> Vec<u8> {
    let (width, pixels) = (image.width(), image.pixels());
    let around = |k: usize, count: usize| k.saturating_sub(1)..(k + 2).min(count);
    let brightest = |row: &[u8], x: usize| row[around(x, width)].iter().copied().max().unwrap_or(0);
    let along: Vec<u8> = pixels.chunks(width).flat_map(|row| (0..width).map(|x| brightest(row, x))).collect();
    let down = |k: usize| around(k / width, image.height()).map(|y| along[y * width + k % width]).max().unwrap_or(0);
    (0..pixels.len()).map(down).collect()
}

/// A tag whose edges are moved out by a pixel.
fn regrown(tag: Tag) -> Tag {
    let out = |j: usize| {
        let (next, last) = (tag.corners[j] - tag.corners[(j + 1) % 4], tag.corners[j] - tag.corners[(j + 3) % 4]);
        tag.corners[j] + next.normalize() + last.normalize()
    };
    Tag { corners: [out(0), out(1), out(2), out(3)], ..tag }
}

/// What is printed in the squares of a grid: of each tag its modules, row by row from the top, true where white.
///
/// # Errors
/// [`VisionError`] when there is no such family or border.
pub fn tag_drawings(grid: &TagGrid) -> Result<Vec<Vec<bool>>, VisionError> {
    let family = Family::named(&grid.family)?;
    let drawing = |k: u32| Ok(family.drawing(grid.first_id + k, grid.border)?.unwrap_or_default());
    (0..grid.tags()).map(drawing).collect()
}
