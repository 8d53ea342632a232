use super::*;

fn gel() -> Arc<ElasticLayer> {
    let material = LayerMaterial { shear_modulus: 1.45e5, poisson: 0.475, thickness: 4e-3 };
    Arc::new(ElasticLayer::new(&material, 25e-3, 20e-3))
}

/// Displacement of the surface at a point by forces on the nodes, m.
fn moved(state: &LayerState, p: &Vec3) -> Vec3 {
    let force = state
        .layer
        .grid
        .around(p.x, p.y)
        .iter()
        .map(|&(node, share)| state.force[node] * share)
        .sum::<Vec3>();
    state.moved_at(p, &(force / (CELL * CELL)))
}

#[test]
fn forces_and_displacements_are_reciprocal() {
    let layer = gel();
    let points = [Vec3::new(1e-3, 2.3e-3, 0.0), Vec3::new(-2.2e-3, 0.4e-3, 0.0)];
    let forces = [Vec3::new(0.3, -0.2, -1.0), Vec3::new(-0.4, 0.1, -0.7)];
    let works = [(0, 1), (1, 0)].map(|(loaded, at)| {
        let mut state = LayerState::new(layer.clone());
        // Displacements are known around what is loaded.
        state.add(&points[loaded], &forces[loaded]);
        state.add(&points[at], &(forces[at] * 1e-9));
        state.update();
        moved(&state, &points[at]).dot(&forces[at])
    });
    assert!((works[0] / works[1] - 1.0).abs() < 1e-4, "{works:?}");
}

#[test]
fn springs_come_to_carry_what_the_layer_needs_whatever_they_carried_before() {
    // Points of a disc of 3 mm, which is pressed in and shifted.
    let (layer, imposed, area) = (gel(), Vec3::new(5e-5, 0.0, -1e-4), 0.75e-3 * 0.75e-3);
    let at = |k: i32| 0.75e-3 * (f64::from(k) + 0.5);
    let grid = (-5..5).flat_map(|j| (-5..5).map(move |i| Vec3::new(at(i), at(j), 0.0)));
    let points: Vec<Vec3> = grid.filter(|p| p.norm() < 3e-3).collect();
    let carried = |start: Vec3| {
        let mut tractions = vec![start; points.len()];
        let mut state = LayerState::new(layer.clone());
        for _ in 0..60 {
            state.clear();
            points.iter().zip(&tractions).for_each(|(p, t)| state.add(p, &(t * area)));
            state.update();
            for (p, t) in points.iter().zip(&mut tractions) {
                let SurfaceStiffness { normal, shear } = state.stiffness_at(p);
                let missing = imposed - state.moved_at(p, t);
                *t += Vec3::new(shear, shear, normal).component_mul(&missing);
            }
        }
        tractions.iter().map(|t| t * area).sum::<Vec3>()
    };
    let [from_rest, from_load] = [Vec3::new(0.0, 0.0, -1.0), Vec3::new(3e4, 2e4, -9e4)].map(carried);
    assert!((from_rest - from_load).norm() < 1e-3 * from_rest.norm(), "{from_rest:?} {from_load:?}");
    // A rigid disc in adhesion, by `tests/reference/layer.py`: 3177 N/m sideways, 8382 N/m without friction.
    assert!((from_rest.x / (3177.0 * imposed.x) - 1.0).abs() < 0.1, "{from_rest:?}");
    assert!((from_rest.z / (8382.0 * imposed.z) - 1.0).abs() < 0.1, "{from_rest:?}");
}
