//! Poses to start a fit from: of each panel the two that a plane in perspective allows.
//!
//! The rays of the corners (distortion removed) and their places on the panel give a homography by the direct linear
//! transform, `x ~ H (X, Y, 1)`, its columns a rotation and a translation, `H ~ [r1 r2 t]`. The second pose has the
//! plane's normal mirrored about the line of sight; seen from afar or nearly head-on both explain the corners almost
//! equally well. Source: Zhang, PAMI 22 (2000) 1330, section 3.1; Schweighofer, Pinz, PAMI 28 (2006) 2024 on the two minima.

use super::Corner;
use groma_geometry::{LieGroup, Se3, So3};
use groma_models::Camera;
use nalgebra::{DMatrix, Matrix3, Rotation3, UnitQuaternion, Vector3};

/// A panel with fewer corners gives no start.
const FEWEST: usize = 4;
/// Rays further off the axis have no place in the plane z = 1.
const LEAST_DEPTH: f64 = 0.1;

/// Poses `T_C_B` to start from, two a panel.
pub(super) fn poses(camera: &Camera, corners: &[Corner]) -> Vec<Se3> {
    let panels: std::collections::BTreeSet<usize> = corners.iter().map(|c| c.panel).collect();
    panels.iter().filter_map(|&panel| both(camera, corners, panel)).flatten().collect()
}

fn both(camera: &Camera, corners: &[Corner], panel: usize) -> Option<[Se3; 2]> {
    let own: Vec<&Corner> = corners.iter().filter(|c| c.panel == panel).collect();
    let rays: Vec<(Vector3<f64>, Vector3<f64>)> = own
        .iter()
        .filter_map(|c| Some((c.on_panel, camera.unproject(&c.pixel).filter(|ray| ray.z > LEAST_DEPTH)?)))
        .collect();
    if rays.len() < FEWEST {
        return None;
    }
    let middle = rays.iter().map(|(p, _)| p).sum::<Vector3<f64>>() / rays.len() as f64;
    let centred = pose_of_plane(&rays, &middle)?;
    let to_panel = panel_of_body(&own)?;
    let moved = |pose: Se3| pose * Se3 { translation: -middle, ..Se3::identity() } * to_panel;
    Some([moved(centred), moved(mirrored(&centred))])
}

/// `T_P_B`, by which `on_panel = T_P_B point`, from the corners themselves.
fn panel_of_body(own: &[&Corner]) -> Option<Se3> {
    let n = own.len() as f64;
    let (a, b) = own.iter().fold((Vector3::zeros(), Vector3::zeros()), |s, c| (s.0 + c.on_panel, s.1 + c.point));
    let (a, b) = (a / n, b / n);
    let h = own.iter().map(|c| (c.on_panel - a) * (c.point - b).transpose()).sum::<Matrix3<f64>>();
    let rotation = nearest_rotation(&h)?;
    Some(Se3 { translation: a - rotation.act(&b), rotation })
}

/// `T_C_M`, M on the plane with its origin at `middle`.
fn pose_of_plane(rays: &[(Vector3<f64>, Vector3<f64>)], middle: &Vector3<f64>) -> Option<Se3> {
    let size = rays.iter().map(|(p, _)| (p - middle).norm()).fold(0.0, f64::max);
    let mut rows = DMatrix::zeros(2 * rays.len(), 9);
    for (k, (p, ray)) in rays.iter().enumerate() {
        let (u, v) = (ray.x / ray.z, ray.y / ray.z);
        let q = [(p.x - middle.x) / size, (p.y - middle.y) / size, 1.0];
        for c in 0..3 {
            (rows[(2 * k, c)], rows[(2 * k, 6 + c)]) = (q[c], -u * q[c]);
            (rows[(2 * k + 1, 3 + c)], rows[(2 * k + 1, 6 + c)]) = (q[c], -v * q[c]);
        }
    }
    let normal = rows.tr_mul(&rows).symmetric_eigen();
    let least = normal.eigenvalues.imin();
    let h = Matrix3::from_row_slice(normal.eigenvectors.column(least).as_slice());
    let (r1, r2, t) = (h.column(0) / size, h.column(1) / size, h.column(2));
    let scale = 2.0 / (r1.norm() + r2.norm()) * if t.z < 0.0 { -1.0 } else { 1.0 };
    let (r1, r2) = (r1 * scale, r2 * scale);
    let rotation = nearest_rotation(&Matrix3::from_columns(&[r1, r2, r1.cross(&r2)]))?;
    let pose = Se3 { rotation, translation: t * scale };
    pose.translation.iter().all(|x| x.is_finite()).then_some(pose)
}

/// The pose whose plane has its normal mirrored about the line of sight to its origin.
fn mirrored(pose: &Se3) -> Se3 {
    let sight = pose.translation.normalize();
    let normal = pose.rotation.act(&Vector3::z());
    let other = 2.0 * normal.dot(&sight) * sight - normal;
    let turn = Rotation3::rotation_between(&normal, &other).unwrap_or_else(Rotation3::identity);
    let quaternion = UnitQuaternion::from_rotation_matrix(&turn);
    Se3 { rotation: So3 { quaternion } * pose.rotation, ..*pose }
}

fn nearest_rotation(m: &Matrix3<f64>) -> Option<So3> {
    let svd = m.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let flip = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant().signum()));
    let rotation = Rotation3::from_matrix_unchecked(u * flip * v_t);
    Some(So3 { quaternion: UnitQuaternion::from_rotation_matrix(&rotation) })
}
