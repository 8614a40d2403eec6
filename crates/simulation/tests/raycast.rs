//! The grid walk against the plain search over all surfaces.

use groma_estimation::streams::{Purpose, Random};
use groma_simulation::scenario::Building;
use groma_simulation::scenes;
use groma_simulation::scenes::depot::Depot;
use groma_simulation::world::{RayCaster, Shape, Surface, World};
use nalgebra::Vector2;
use proptest::prelude::*;

fn point(extent: f64) -> impl Strategy<Value = Vector2<f64>> {
    (-extent..extent, -extent..extent).prop_map(|(x, y)| Vector2::new(x, y))
}

/// Half of the points lie on the border of a cell, where a walk goes wrong first.
fn snapped(extent: f64) -> impl Strategy<Value = Vector2<f64>> {
    prop_oneof![point(extent), point(extent).prop_map(|p| p.map(f64::round))]
}

fn surface() -> impl Strategy<Value = Surface> {
    let segment = (snapped(12.0), snapped(12.0)).prop_map(|(a, b)| Shape::Segment { a, b });
    let circle = (snapped(12.0), 0.02..2.0_f64).prop_map(|(center, radius)| Shape::Circle { center, radius });
    (prop_oneof![segment, circle], 0.1..1.0_f64).prop_map(|(shape, reflectivity)| Surface { shape, reflectivity })
}

fn direction() -> impl Strategy<Value = Vector2<f64>> {
    let any = (0.0..std::f64::consts::TAU).prop_map(|a| Vector2::new(a.cos(), a.sin()));
    prop_oneof![any, Just(Vector2::new(1.0, 0.0)), Just(Vector2::new(0.0, -1.0))]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn finds_the_nearest_of_all(
        surfaces in prop::collection::vec(surface(), 0..40),
        origin in snapped(20.0),
        direction in direction(),
        reach in 0.5..60.0_f64,
    ) {
        let caster = RayCaster::new(&World { surfaces: surfaces.clone() });
        let met = surfaces.iter().filter_map(|s| s.shape.meet(origin, direction)).map(|(range, _)| range);
        let nearest = met.filter(|&range| range <= reach).reduce(f64::min);
        prop_assert_eq!(caster.cast(origin, direction, reach).map(|hit| hit.range), nearest);
    }

    #[test]
    fn knows_what_is_near(
        surfaces in prop::collection::vec(surface(), 0..40),
        p in snapped(15.0),
        radius in 0.01..3.0_f64,
    ) {
        let near = surfaces.iter().any(|s| s.shape.distance(p) < radius);
        prop_assert_eq!(RayCaster::new(&World { surfaces }).touches(p, radius), near);
    }
}

#[test]
fn finds_the_nearest_in_buildings() {
    for building in [Building::Rooms, Building::Warehouse, Building::Loop, Building::Depot(Depot::default())] {
        let mut random = Random::new(11, Purpose::Building);
        let (world, route) = scenes::build(building, &mut random);
        let caster = RayCaster::new(&world);
        let corners: Vec<_> = route.legs.iter().flat_map(|leg| leg.points.clone()).collect();
        for k in 0..1500 {
            let aside = Vector2::new(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3));
            let origin = corners[k % corners.len()] + aside;
            let bearing = random.index(8) as f64 * std::f64::consts::FRAC_PI_4 + 0.1 * random.normal();
            let direction = Vector2::new(bearing.cos(), bearing.sin());
            let met = world.surfaces.iter().filter_map(|s| s.shape.meet(origin, direction)).map(|(range, _)| range);
            let nearest = met.reduce(f64::min);
            assert_eq!(caster.cast(origin, direction, 1e3).map(|hit| hit.range), nearest, "{origin} {direction}");
        }
    }
}
