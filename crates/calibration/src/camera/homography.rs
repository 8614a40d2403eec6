//! The homography between two planes, by the normalised direct linear transform.
//!
//! `lambda (x, y, 1)^T = H (X, Y, 1)^T`; two rows a pair in the nine entries of H, solved by the least eigenvector of
//! their normal matrix, after both point sets are moved to mean 0 and scaled to mean distance sqrt 2.
//! Source: Hartley, "In defense of the eight-point algorithm", PAMI 19 (1997) 580.

use nalgebra::{Matrix3, SMatrix, SVector, SymmetricEigen, Vector2, Vector3};

/// Share of the largest eigenvalue below which the second least counts as zero: the points lie on a line.
const ON_A_LINE: f64 = 1e-11;

/// H that takes points of the first plane to those of the second; nothing when there are fewer than four or they lie on
/// a line.
#[must_use]
pub fn homography(pairs: &[(Vector2<f64>, Vector2<f64>)]) -> Option<Matrix3<f64>> {
    if pairs.len() < 4 {
        return None;
    }
    let from = normalising(pairs.iter().map(|p| p.0))?;
    let to = normalising(pairs.iter().map(|p| p.1))?;
    let mut normal = SMatrix::<f64, 9, 9>::zeros();
    for (a, b) in pairs {
        for row in rows(&(from * a.push(1.0)), &(to * b.push(1.0))) {
            normal.ger(1.0, &row, &row, 1.0);
        }
    }
    let eigen = SymmetricEigen::new(normal);
    let mut order: Vec<usize> = (0..9).collect();
    order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
    if eigen.eigenvalues[order[1]] <= ON_A_LINE * eigen.eigenvalues[order[8]] {
        return None;
    }
    let h = eigen.eigenvectors.column(order[0]);
    let h = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8]);
    Some(to.try_inverse()? * h * from)
}

/// `(a, 0, -b_x a)` and `(0, a, -b_y a)`.
fn rows(a: &Vector3<f64>, b: &Vector3<f64>) -> [SVector<f64, 9>; 2] {
    [0, 1].map(|axis| {
        let mut row = SVector::<f64, 9>::zeros();
        row.fixed_rows_mut::<3>(3 * axis).copy_from(a);
        row.fixed_rows_mut::<3>(6).copy_from(&(-a * b[axis]));
        row
    })
}

/// The similarity that moves points to mean 0 and mean distance sqrt 2; nothing when they are all one point.
fn normalising(points: impl Iterator<Item = Vector2<f64>> + Clone) -> Option<Matrix3<f64>> {
    let count = points.clone().count() as f64;
    let mean = points.clone().sum::<Vector2<f64>>() / count;
    let distance = points.map(|p| (p - mean).norm()).sum::<f64>() / count;
    let scale = std::f64::consts::SQRT_2 / distance;
    let moved = Matrix3::new(scale, 0.0, -scale * mean.x, 0.0, scale, -scale * mean.y, 0.0, 0.0, 1.0);
    (distance > 0.0 && scale.is_finite()).then_some(moved)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_recovered_from_its_own_points() {
        let h = Matrix3::new(300.0, 20.0, 310.0, -15.0, 280.0, 250.0, 0.1, -0.2, 1.0);
        let image = |p: Vector2<f64>| (h * p.push(1.0)).xy() / (h * p.push(1.0)).z;
        let points: Vec<_> = (0..12).map(|k| Vector2::new(f64::from(k % 4) * 0.1, f64::from(k / 4) * 0.07)).collect();
        let pairs: Vec<_> = points.iter().map(|&p| (p, image(p))).collect();
        let found = homography(&pairs).unwrap();
        assert!((found / found[(2, 2)] - h).norm() < 1e-9 * h.norm());
        assert!(homography(&pairs[..3]).is_none() && homography(&pairs[..4]).is_none());
    }
}
