//! Bakes materials into the vertices of a mesh.

use std::collections::BTreeMap;

use super::lod::{CreasedMesh, Lod, compute_normals, smoothing_groups, split_at_creases};
use crate::{
    geometry::{Aabb, basis_from_reference, mesh::Mesh, shape::Shape},
    scene::Visual,
    sensing::camera::{
        math::V3,
        shade::{
            occlusion::self_visibility,
            pattern::{MaterialSample, VisualSample, sample_visual},
        },
    },
};

/// Reach of ambient occlusion by the object itself, in longest extents of the object.
const OCCLUSION_REACH: f64 = 0.12;

/// Builds a level of detail: splits vertices at creases, evaluates materials at them and raises their drawn relief.
///
/// `material_ids` are those of the triangles. Patterns are filtered to `spacing`, m. With a `shape`, materials blend
/// smoothly across their borders and ambient occlusion is baked in.
pub(crate) fn bake_vertices(
    mesh: &Mesh,
    material_ids: &[u16],
    visuals: &[Visual],
    spacing: f32,
    shape: Option<&Shape>,
) -> Lod {
    let points: Vec<V3> = mesh.vertices.iter().map(|v| v.cast()).collect();
    let CreasedMesh { sources, triangles } = split_at_creases(&points, &mesh.triangles);
    let mut positions: Vec<V3> = sources.iter().map(|&v| points[v as usize]).collect();
    let mut normals = vec![V3::zeros(); sources.len()];
    compute_normals(&positions, &triangles, &mut normals);
    let mut adjacent_ids: Vec<Vec<u16>> = vec![Vec::new(); sources.len()];
    for (t, &id) in triangles.iter().zip(material_ids) {
        t.iter().for_each(|&v| adjacent_ids[v as usize].push(id));
    }
    let reach = OCCLUSION_REACH * extent(mesh);
    let mut materials = Vec::with_capacity(sources.len());
    let mut relief = Vec::with_capacity(sources.len());
    // Copies of a vertex share its material, so that nothing changes along a crease.
    let mut known: BTreeMap<u32, VisualSample> = BTreeMap::new();
    for (i, p) in positions.iter().enumerate() {
        let n = &normals[i];
        let sample = *known.entry(sources[i]).or_insert_with(|| {
            let is_border = adjacent_ids[i].iter().any(|&id| id != adjacent_ids[i][0]);
            let ids = match shape {
                Some(shape) if is_border => material_ids_near(shape, p, n, spacing),
                _ => adjacent_ids[i].clone(),
            };
            let mut sample = blend_visuals(&ids, visuals, p, n, spacing);
            sample.material.sky_visibility = shape.map_or(1.0, |shape| self_visibility(shape, p, n, reach));
            sample
        });
        materials.push(sample.material);
        relief.push(sample.relief);
    }
    if relief.iter().any(|&h| h != 0.0) {
        positions.iter_mut().zip(&normals).zip(&relief).for_each(|((p, n), h)| *p += n * *h);
        compute_normals(&positions, &triangles, &mut normals);
    }
    Lod {
        is_uniform: materials.iter().all(|m: &MaterialSample| m.is_same_material(&materials[0])),
        geometric_error: 0.0,
        smoothing_groups: smoothing_groups(&triangles, positions.len()),
        positions,
        normals,
        materials,
        triangles,
        chart_ids: Vec::new(),
        uvs: Vec::new(),
        embedding: Vec::new(),
        vertex_spacing: spacing,
    }
}

/// Longest extent of a mesh along an axis, m.
pub(crate) fn extent(mesh: &Mesh) -> f64 {
    Aabb::from_points(&mesh.vertices).map_or(0.0, |bounds| bounds.size().max())
}

/// Material ids at points spread evenly over the surface around `p`, to a little more than half the distance to
/// adjacent vertices. Their proportions change smoothly across a border, however the triangles there are shaped.
fn material_ids_near(shape: &Shape, p: &V3, n: &V3, spacing: f32) -> Vec<u16> {
    const STEPS: i32 = 2;
    let reference = if n.z.abs() < 0.9 { V3::z() } else { V3::x() };
    let [u, v] = basis_from_reference(n, &reference);
    let step = 0.7 * spacing / STEPS as f32;
    let point = |i: i32, j: i32| p + u * (i as f32 * step) + v * (j as f32 * step);
    (-STEPS..=STEPS)
        .flat_map(|i| (-STEPS..=STEPS).map(move |j| point(i, j)))
        .map(|q| shape.material(&q.cast()))
        .collect()
}

/// Averages the visuals of `ids`, by how often each occurs.
fn blend_visuals(ids: &[u16], visuals: &[Visual], p: &V3, n: &V3, spacing: f32) -> VisualSample {
    let mut sum: Option<VisualSample> = None;
    let share = 1.0 / ids.len().max(1) as f32;
    let mut sorted = ids.to_vec();
    sorted.sort_unstable();
    for run in sorted.chunk_by(|a, b| a == b) {
        let VisualSample { material, relief } = sample_visual(&visuals[run[0] as usize], p, n, spacing);
        let weight = share * run.len() as f32;
        let scaled = MaterialSample {
            albedo: material.albedo * weight,
            roughness: material.roughness * weight,
            metalness: material.metalness * weight,
            sky_visibility: 1.0,
        };
        sum = Some(match sum {
            None => VisualSample { material: scaled, relief: relief * weight },
            Some(VisualSample { material: m, relief: h }) => VisualSample {
                material: MaterialSample {
                    albedo: m.albedo + scaled.albedo,
                    roughness: m.roughness + scaled.roughness,
                    metalness: m.metalness + scaled.metalness,
                    sky_visibility: 1.0,
                },
                relief: h + relief * weight,
            },
        });
    }
    sum.unwrap_or_else(|| sample_visual(&Visual::default(), p, n, spacing))
}
