//! AprilTag's own C library behind one function.
//!
//! The library puts the centre of the upper left pixel at (0.5, 0.5); half a pixel is taken off here and nowhere else.
//! Corners go round from the lower left of the tag as it is printed: lower left, lower right, upper right, upper left.
//!
//! Kalibr prints tags with a border of two modules. The library knows a border of one; a second one is added by telling
//! it that the square is two modules wider and its bits lie one further in. That works for families whose border is the
//! outermost ring of a square.
//!
//! This is the one file of the workspace that calls C, hence `unsafe`. Each call makes and frees all that it uses; nothing
//! is shared between calls, so they may run in parallel. Source: github.com/AprilRobotics/apriltag 3.4.5; Olson, ICRA
//! 2011; Wang, Olson, IROS 2016.
#![allow(unsafe_code)] // a C library is called: see above

use crate::error::VisionError;
use crate::image::Gray;
use apriltag_sys as sys;
use nalgebra::Vector2;

/// Bits of a code that may be wrong and are corrected.
const MENDED_BITS: i32 = 1;

/// Sides below have no tag, and the library reads beyond their end [pixel].
const LEAST_SIDE: usize = 16;

/// A family of tags.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Family {
    /// 30 tags of 16 bits.
    Tag16h5,
    /// 35 tags of 25 bits.
    Tag25h9,
    /// 587 tags of 36 bits: the usual ones.
    Tag36h11,
    /// 2115 tags of 41 bits.
    TagStandard41h12,
    /// 48 714 tags of 52 bits.
    TagStandard52h13,
}

/// A tag in an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Tag {
    /// Its number.
    pub id: u32,
    /// Bits of its code that were corrected.
    pub mended: u32,
    /// Mean distance of the bits from the threshold [grey]: small when it is hardly legible.
    pub margin: f64,
    /// Corners: lower left, lower right, upper right, upper left of the tag as it is printed [pixel].
    pub corners: [Vector2<f64>; 4],
    /// Whether each corner was seen there, and not only placed by its neighbours.
    pub seen: [bool; 4],
}

impl Family {
    const ALL: [Self; 5] =
        [Self::Tag16h5, Self::Tag25h9, Self::Tag36h11, Self::TagStandard41h12, Self::TagStandard52h13];

    /// The family of a name such as `tag36h11`.
    ///
    /// # Errors
    /// [`VisionError::UnknownFamily`].
    pub fn named(name: &str) -> Result<Self, VisionError> {
        let alike = |family: &Self| family.name().eq_ignore_ascii_case(name) || family.name()[3..] == *name;
        let known = || Self::ALL.map(Self::name).join(", ");
        let found = Self::ALL.into_iter().find(alike);
        found.ok_or_else(|| VisionError::UnknownFamily { name: name.to_owned(), known: known() })
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Tag16h5 => "tag16h5",
            Self::Tag25h9 => "tag25h9",
            Self::Tag36h11 => "tag36h11",
            Self::TagStandard41h12 => "tagStandard41h12",
            Self::TagStandard52h13 => "tagStandard52h13",
        }
    }

    /// Modules along the edge of the black square, for a border of so many modules.
    ///
    /// # Errors
    /// [`VisionError::Border`] when the family is not drawn so.
    pub fn modules(self, border: u32) -> Result<u32, VisionError> {
        let bits = match self {
            Self::Tag16h5 => 4,
            Self::Tag25h9 => 5,
            Self::Tag36h11 => 6,
            Self::TagStandard41h12 if border == 1 => 3,
            Self::TagStandard52h13 if border == 1 => 4,
            _ => return Err(VisionError::Border { family: self.name(), border }),
        };
        if matches!(border, 1 | 2) { Ok(bits + 2 * border) } else { Err(self.no_border(border)) }
    }

    fn no_border(self, border: u32) -> VisionError {
        VisionError::Border { family: self.name(), border }
    }

    /// The modules of a tag, row by row from the top, true where white; nothing when there is no such tag, or it is
    /// printed beyond its border too.
    ///
    /// # Errors
    /// As [`Family::modules`].
    pub fn drawing(self, id: u32, border: u32) -> Result<Option<Vec<bool>>, VisionError> {
        let modules = self.modules(border)? as usize;
        let family = Drawn::new(self, border);
        Ok(family.bits(id).map(|bits| {
            let mut drawing = vec![false; modules * modules];
            bits.into_iter().filter(|bit| bit.2).for_each(|(x, y, _)| drawing[y * modules + x] = true);
            drawing
        }))
    }
}

/// The tags of a family in an image, by number.
///
/// # Errors
/// [`VisionError::Border`] when the family is not drawn with this border, [`VisionError::Memory`].
pub fn detect_tags(image: &Gray<'_>, family: Family, border: u32) -> Result<Vec<Tag>, VisionError> {
    family.modules(border)?;
    if image.width().min(image.height()) < LEAST_SIDE {
        return Ok(vec![]);
    }
    let detector = Detector::new(Drawn::new(family, border));
    let found = detector.detect(image).ok_or(VisionError::Memory { width: image.width(), height: image.height() })?;
    let mut tags = found;
    tags.sort_by_key(|tag| tag.id);
    Ok(tags)
}

/// A family as the library holds it, with a border of one or two modules.
struct Drawn {
    family: Family,
    raw: *mut sys::apriltag_family_t,
}

impl Drawn {
    fn new(family: Family, border: u32) -> Self {
        // SAFETY: the functions take nothing and return a family that is ours to destroy.
        let raw = unsafe {
            match family {
                Family::Tag16h5 => sys::tag16h5_create(),
                Family::Tag25h9 => sys::tag25h9_create(),
                Family::Tag36h11 => sys::tag36h11_create(),
                Family::TagStandard41h12 => sys::tagStandard41h12_create(),
                Family::TagStandard52h13 => sys::tagStandard52h13_create(),
            }
        };
        let drawn = Self { family, raw };
        (1..border).for_each(|_| drawn.widen());
        drawn
    }

    /// Adds a module to the border.
    fn widen(&self) {
        // SAFETY: the family is ours and nobody else reads it; bit_x and bit_y have `nbits` entries each.
        unsafe {
            (*self.raw).width_at_border += 2;
            (*self.raw).total_width += 2;
            for bit in 0..(*self.raw).nbits as usize {
                *(*self.raw).bit_x.add(bit) += 1;
                *(*self.raw).bit_y.add(bit) += 1;
            }
        }
    }

    /// Column, row and colour of every bit of a tag inside its border; nothing when there is no such tag or a bit lies
    /// outside.
    fn bits(&self, id: u32) -> Option<Vec<(usize, usize, bool)>> {
        // SAFETY: the family is ours; `codes` has `ncodes` entries, bit_x and bit_y have `nbits`. Bits outside the
        // border have coordinates below zero, kept as unsigned numbers: they wrap beyond the width.
        unsafe {
            let family = &*self.raw;
            if id >= family.ncodes {
                return None;
            }
            let code = *family.codes.add(id as usize);
            let bit = |k: usize| {
                let (x, y) = (*family.bit_x.add(k) as usize, *family.bit_y.add(k) as usize);
                let inside = x.max(y) < family.width_at_border as usize;
                inside.then_some((x, y, code >> (family.nbits as usize - k - 1) & 1 == 1))
            };
            (0..family.nbits as usize).map(bit).collect()
        }
    }
}

impl Drop for Drawn {
    fn drop(&mut self) {
        // SAFETY: made by the matching function of `new`, and dropped once.
        unsafe {
            match self.family {
                Family::Tag16h5 => sys::tag16h5_destroy(self.raw),
                Family::Tag25h9 => sys::tag25h9_destroy(self.raw),
                Family::Tag36h11 => sys::tag36h11_destroy(self.raw),
                Family::TagStandard41h12 => sys::tagStandard41h12_destroy(self.raw),
                Family::TagStandard52h13 => sys::tagStandard52h13_destroy(self.raw),
            }
        }
    }
}

/// A detector that owns its family; the family is freed after it (fields drop after `drop`).
struct Detector {
    raw: *mut sys::apriltag_detector_t,
    _family: Drawn,
}

impl Detector {
    fn new(family: Drawn) -> Self {
        // SAFETY: the detector is ours; the family outlives it.
        unsafe {
            let raw = sys::apriltag_detector_create();
            (*raw).quad_decimate = 1.0; // full resolution: corners matter more than time
            (*raw).refine_edges = true;
            sys::apriltag_detector_add_family_bits(raw, family.raw, MENDED_BITS);
            Self { raw, _family: family }
        }
    }

    fn detect(&self, image: &Gray<'_>) -> Option<Vec<Tag>> {
        let mut pixels = image.pixels().to_vec();
        let (width, height) = (i32::try_from(image.width()).ok()?, i32::try_from(image.height()).ok()?);
        let mut raw = sys::image_u8_t { width, height, stride: width, buf: pixels.as_mut_ptr() };
        // SAFETY: `raw` describes the pixels, which live until after the call; the array returned is ours to destroy and
        // holds `size` pointers to detections, each valid until then.
        unsafe {
            let found = sys::apriltag_detector_detect(self.raw, &raw mut raw);
            if found.is_null() {
                return None;
            }
            let first = (*found).data.cast::<*const sys::apriltag_detection_t>();
            let count = usize::try_from((*found).size).unwrap_or(0);
            let tags = (0..count).map(|k| to_tag(&**first.add(k))).collect();
            sys::apriltag_detections_destroy(found);
            Some(tags)
        }
    }
}

impl Drop for Detector {
    fn drop(&mut self) {
        // SAFETY: the detector is ours and dropped once.
        unsafe { sys::apriltag_detector_destroy(self.raw) }
    }
}

fn to_tag(found: &sys::apriltag_detection_t) -> Tag {
    Tag {
        id: u32::try_from(found.id).unwrap_or(0),
        mended: u32::try_from(found.hamming).unwrap_or(0),
        margin: f64::from(found.decision_margin),
        corners: found.p.map(|[x, y]| Vector2::new(x - 0.5, y - 0.5)),
        seen: [true; 4],
    }
}
