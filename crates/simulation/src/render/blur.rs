//! A Gaussian blur, along rows and then along columns; beyond its border the image goes on as it ends.

/// Reach of the kernel in standard deviations.
const REACH: f64 = 4.0;

/// The image blurred by a standard deviation [pixel].
pub(super) fn blurred(image: &[f32], width: usize, sigma: f64) -> Vec<f32> {
    if sigma <= 0.0 || width == 0 {
        return image.to_vec();
    }
    let kernel = kernel(sigma);
    transposed(
        &along_rows(&transposed(&along_rows(image, width, &kernel), width), image.len() / width, &kernel),
        image.len() / width,
    )
}

fn kernel(sigma: f64) -> Vec<f32> {
    let reach = (REACH * sigma).ceil() as i32;
    let bell: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (f64::from(k) / sigma).powi(2)).exp()).collect();
    let sum: f64 = bell.iter().sum();
    bell.into_iter().map(|b| (b / sum) as f32).collect()
}

fn along_rows(image: &[f32], width: usize, kernel: &[f32]) -> Vec<f32> {
    let reach = kernel.len() / 2;
    let blur = |row: &[f32]| -> Vec<f32> {
        let at = |k: usize| row[k.saturating_sub(reach).min(width - 1)];
        let padded: Vec<f32> = (0..width + 2 * reach).map(at).collect();
        padded.windows(kernel.len()).map(|w| w.iter().zip(kernel).map(|(a, b)| a * b).sum()).collect()
    };
    image.chunks(width).flat_map(blur).collect()
}

fn transposed(image: &[f32], width: usize) -> Vec<f32> {
    let height = image.len() / width;
    (0..image.len()).map(|k| image[(k % height) * width + k / height]).collect()
}
