//! A grey image: 8 bits a pixel, rows from the top.

use crate::error::VisionError;

/// A view of the pixels of an image.
#[derive(Clone, Copy, Debug)]
pub struct Gray<'a> {
    width: usize,
    height: usize,
    pixels: &'a [u8],
}

impl<'a> Gray<'a> {
    /// The image of `width * height` pixels.
    ///
    /// # Errors
    /// [`VisionError::Size`] when there are more or fewer, or none.
    pub fn new(width: usize, height: usize, pixels: &'a [u8]) -> Result<Self, VisionError> {
        let fits = width > 0 && width.checked_mul(height) == Some(pixels.len()) && !pixels.is_empty();
        let small = i32::try_from(width).is_ok() && i32::try_from(height).is_ok();
        if fits && small { Ok(Self { width, height, pixels }) } else { Err(Self::refusal(width, height, pixels.len())) }
    }

    fn refusal(width: usize, height: usize, got: usize) -> VisionError {
        VisionError::Size { width, height, got }
    }

    /// Columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// All pixels, row by row.
    #[must_use]
    pub fn pixels(&self) -> &'a [u8] {
        self.pixels
    }

    /// The grey value in a column and a row; nothing outside.
    #[must_use]
    pub fn at(&self, x: i64, y: i64) -> Option<f64> {
        let (x, y) = (usize::try_from(x).ok()?, usize::try_from(y).ok()?);
        (x < self.width && y < self.height).then(|| f64::from(self.pixels[y * self.width + x]))
    }

    /// Distance of a point to the border of the image [pixel]; negative outside.
    #[must_use]
    pub fn inset(&self, x: f64, y: f64) -> f64 {
        let right = (self.width as f64 - 0.5 - x).min(self.height as f64 - 0.5 - y);
        right.min((x + 0.5).min(y + 0.5))
    }
}
