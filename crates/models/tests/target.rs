//! Targets: where corners are, and what is refused.
#![allow(clippy::unwrap_used)] // helpers of tests

use groma_models::target::{Charuco, Chessboard, Panel, Pattern, TagGrid, Target};
use nalgebra::Vector3;

fn grid(first_id: u32) -> Pattern {
    let family = "tag36h11".to_owned();
    Pattern::TagGrid(TagGrid { family, columns: 6, rows: 5, size: 0.08, spacing: 0.25, first_id, border: 2 })
}

fn panel(name: &str, pattern: Pattern) -> Panel {
    Panel { name: name.to_owned(), pattern, position: [0.1, 0.2, 0.3], quaternion: [0.0, 0.0, 2.0, 2.0] }
}

#[test]
fn corners_of_a_tag_go_round_from_the_lower_left() {
    let pattern = grid(0);
    let at = |id| pattern.corner(id).unwrap();
    assert_eq!([at(0), at(1)], [Vector3::zeros(), Vector3::new(0.08, 0.0, 0.0)]);
    assert_eq!([at(2), at(3)], [Vector3::new(0.08, 0.08, 0.0), Vector3::new(0.0, 0.08, 0.0)]);
    assert!((at(4 * 7) - Vector3::new(0.1, 0.1, 0.0)).norm() < 1e-15);
    assert_eq!((pattern.corners().len(), pattern.corner(120)), (120, None));
}

#[test]
fn corners_of_boards_go_by_rows() {
    let chessboard = Pattern::Chessboard(Chessboard { columns: 9, rows: 6, square: 0.025 });
    assert_eq!(chessboard.corner(10), Some(Vector3::new(0.025, 0.025, 0.0)));
    let charuco = Charuco {
        dictionary: "DICT_6X6_250".to_owned(),
        columns: 5,
        rows: 7,
        square: 0.036,
        marker: 0.018,
        first_id: 0,
        legacy: false,
    };
    let pattern = Pattern::Charuco(charuco);
    assert_eq!((pattern.corner_count(), pattern.corner(0)), (24, Some(Vector3::new(0.036, 0.036, 0.0))));
}

#[test]
fn panels_that_look_alike_are_refused() {
    let target = |second| Target { panels: vec![panel("front", grid(0)), panel("left", grid(second))] };
    assert!(target(30).check().is_ok());
    assert!(target(29).check().unwrap_err().to_string().contains("\"front\" and \"left\""));
    assert!(Target { panels: vec![] }.check().is_err());
}

#[test]
fn the_place_of_a_panel_is_a_pose() {
    let quarter_turn = panel("front", grid(0)).t_robot_panel();
    let corner = groma_geometry::LieGroup::act(&quarter_turn, &Vector3::new(1.0, 0.0, 0.0));
    assert!((corner - Vector3::new(0.1, 1.2, 0.3)).norm() < 1e-15);
}

#[test]
fn a_target_reads_back_from_json() {
    let target = Target { panels: vec![panel("front", grid(3))] };
    let json = serde_json::to_string(&target).unwrap();
    assert!(json.contains(r#""type":"aprilgrid""#));
    assert_eq!(serde_json::from_str::<Target>(&json).unwrap(), target);
}
