//! Divides surfaces into texture charts.
//!
//! Flat meshes get one chart per plane and material. A curved surface with text is divided into connected parts that
//! face mostly along one axis; projection along that axis stretches them by less than √3.

use std::{collections::BTreeMap, sync::Arc};

use super::{
    lod::{CreasedMesh, Lod, compute_normals, split_at_creases},
    texture_chart::{ChartVertex, CurvedChart, MIN_TEXEL, SurfaceMaterial, TextureChart},
};
use crate::{
    geometry::{mesh::Mesh, union_find::UnionFind},
    scene::Visual,
    sensing::camera::{math::V3, shade::pattern::MaterialSample},
};

/// Maximum number of triangles of a mesh that is textured plane by plane.
const MAX_FLAT_TRIANGLES: usize = 160;
/// Minimum size (square root of the area) of a mesh without text that is textured, m.
const MIN_FLAT_SIZE: f64 = 0.1;

/// True if a mesh has few faces, and they are large or have text: a texture is then cheaper than fine triangles.
pub(crate) fn suits_flat_charts(mesh: &Mesh, has_text: bool) -> bool {
    mesh.triangles.len() <= MAX_FLAT_TRIANGLES && (has_text || mesh.area().sqrt() > MIN_FLAT_SIZE)
}

/// Builds a level of detail with one chart for the triangles of each plane and material.
pub(crate) fn flat_charts(mesh: &Mesh, material_ids: &[u16], visuals: &[Visual]) -> (Lod, Vec<TextureChart>) {
    struct Plane {
        normal: V3,
        offset: f32,
        material_id: u16,
        corners: Vec<V3>,
    }
    let points: Vec<V3> = mesh.vertices.iter().map(|v| v.cast()).collect();
    let CreasedMesh { sources, triangles } = split_at_creases(&points, &mesh.triangles);
    let positions: Vec<V3> = sources.iter().map(|&v| points[v as usize]).collect();
    let mut normals = vec![V3::zeros(); positions.len()];
    compute_normals(&positions, &triangles, &mut normals);
    let mut planes: Vec<Plane> = Vec::new();
    let mut chart_ids = Vec::new();
    for (t, &material_id) in triangles.iter().zip(material_ids) {
        let corners = t.map(|v| positions[v as usize]);
        let area = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let normal = area.try_normalize(0.0).unwrap_or_else(V3::z);
        let offset = normal.dot(&corners[0]);
        let known = planes.iter().position(|plane| {
            plane.material_id == material_id
                && plane.normal.dot(&normal) > 0.99999
                && (plane.offset - offset).abs() < 1e-4
        });
        let index = known.unwrap_or_else(|| {
            planes.push(Plane { normal, offset, material_id, corners: Vec::new() });
            planes.len() - 1
        });
        planes[index].corners.extend(corners);
        chart_ids.push(index as u32);
    }
    let charts: Vec<TextureChart> = planes
        .iter()
        .map(|plane| TextureChart::flat(&plane.normal, &plane.corners, &visuals[plane.material_id as usize]))
        .collect();
    // Albedo and roughness come from the texture; metalness does not vary over a chart.
    let textured =
        MaterialSample { albedo: V3::zeros(), roughness: 1.0, metalness: 0.0, sky_visibility: 1.0 };
    let mut materials = vec![textured; positions.len()];
    for (t, &id) in triangles.iter().zip(material_ids) {
        let metalness = visuals[id as usize].metalness as f32;
        t.iter().for_each(|&v| materials[v as usize].metalness = metalness);
    }
    let lod = Lod {
        uvs: texture_coordinates(&positions, &triangles, &charts, &chart_ids),
        smoothing_groups: chart_ids.clone(),
        positions,
        normals,
        materials,
        triangles,
        chart_ids,
        embedding: Vec::new(),
        vertex_spacing: MIN_TEXEL,
        is_uniform: false,
        geometric_error: 0.0,
    };
    (lod, charts)
}

/// Textures every triangle of a curved level; its charts are appended to `charts`. `texel` is the edge of a texel, m.
///
/// The level then counts as uniform: its materials no longer require small triangles.
pub(crate) fn parameterize(
    lod: &mut Lod,
    charts: &mut Vec<TextureChart>,
    material: &Arc<SurfaceMaterial>,
    texel: f32,
) {
    let mut chart_ids = vec![0; lod.triangles.len()];
    for part in connected_parts(lod) {
        let vertex =
            |v: u32| ChartVertex { position: lod.positions[v as usize], normal: lod.normals[v as usize] };
        part.triangles.iter().for_each(|&t| chart_ids[t] = charts.len() as u32);
        let triangles = part.triangles.iter().map(|&t| lod.triangles[t].map(vertex)).collect();
        let curved = CurvedChart { material: material.clone(), triangles };
        charts.push(TextureChart::curved(&part.direction.unit_vector(), texel, curved));
    }
    lod.uvs = texture_coordinates(&lod.positions, &lod.triangles, charts, &chart_ids);
    lod.chart_ids = chart_ids;
    lod.is_uniform = true;
}

fn texture_coordinates(
    positions: &[V3],
    triangles: &[[u32; 3]],
    charts: &[TextureChart],
    chart_ids: &[u32],
) -> Vec<[[f32; 2]; 3]> {
    let of_triangle =
        |(t, &chart): (&[u32; 3], &u32)| t.map(|v| charts[chart as usize].uv(&positions[v as usize]));
    triangles.iter().zip(chart_ids).map(of_triangle).collect()
}

/// A direction along an axis.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct AxisDirection {
    axis: usize,
    is_negative: bool,
}

impl AxisDirection {
    fn unit_vector(self) -> V3 {
        V3::ith(self.axis, if self.is_negative { -1.0 } else { 1.0 })
    }
}

/// Connected triangles that face mostly in one direction.
struct ChartPart {
    direction: AxisDirection,
    triangles: Vec<usize>,
}

fn connected_parts(lod: &Lod) -> Vec<ChartPart> {
    let directions: Vec<AxisDirection> = lod
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| lod.positions[v as usize]);
            let n = (b - a).cross(&(c - a));
            let axis = n.iamax();
            AxisDirection { axis, is_negative: n[axis] < 0.0 }
        })
        .collect();
    let mut connected = UnionFind::new(lod.triangles.len());
    let mut first_at: BTreeMap<(u32, AxisDirection), usize> = BTreeMap::new();
    for (t, (corners, &direction)) in lod.triangles.iter().zip(&directions).enumerate() {
        for &v in corners {
            let other = *first_at.entry((v, direction)).or_insert(t);
            connected.union(other, t);
        }
    }
    let mut parts: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for t in 0..lod.triangles.len() {
        parts.entry(connected.find(t)).or_default().push(t);
    }
    parts
        .into_iter()
        .map(|(first, triangles)| ChartPart { direction: directions[first], triangles })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        geometry::shape::Shape,
        scene::{LabelLine, Mask, TextDecal, VisualLayer},
        sensing::camera::{RenderMesh, shade::pattern::sample_visual, simd::f32x8},
    };

    /// A word facing +x, white on black.
    fn printed() -> Visual {
        let line = LabelLine {
            text: "soft".into(),
            height_m: 0.012,
            weight: 0.15,
            at: [0.03, 0.0, 0.0],
            facing: [1.0, 0.0, 0.0],
            ..LabelLine::default()
        };
        let mask = Mask::Text { decal: Arc::new(TextDecal::new(line)) };
        let layer = VisualLayer { mask, albedo: [1.0; 3], roughness: 0.5, opacity: 1.0, relief_m: 0.0 };
        Visual::plain([0.0; 3], 0.5, 0.0).with(layer)
    }

    fn ball() -> RenderMesh {
        RenderMesh::from_shape("ball", &Shape::Sphere { radius: 0.03 }, &[printed()]).expect("a mesh")
    }

    #[test]
    fn every_triangle_of_every_level_has_valid_texture_coordinates_and_faces_its_chart() {
        for lod in &ball().lods {
            let count = lod.triangles.len();
            assert_eq!((lod.chart_ids.len(), lod.uvs.len()), (count, count));
            for uvs in &lod.uvs {
                let [a, b, c] = *uvs;
                let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
                assert!(area > 0.0 && uvs.iter().flatten().all(|x| *x > -1e-3), "{uvs:?}");
            }
        }
        assert_eq!(ball().lods[0].chart_ids.iter().max(), Some(&5), "a ball has six sides");
    }

    #[test]
    fn letters_finer_than_the_triangles_are_sampled_at_their_positions() {
        let mesh = ball();
        let lod = &mesh.lods[0];
        let mut counts = [0; 2];
        for (uvs, (t, &chart)) in lod.uvs.iter().zip(lod.triangles.iter().zip(&lod.chart_ids)) {
            let middle = t.iter().map(|&v| lod.positions[v as usize]).sum::<V3>() / 3.0;
            let expected = sample_visual(&printed(), &middle, &middle.normalize(), 1e-3).material.albedo.x;
            if (0.02..=0.98).contains(&expected) {
                continue;
            }
            let uv: [f32x8; 2] =
                std::array::from_fn(|i| f32x8::splat(uvs.iter().map(|p| p[i]).sum::<f32>() / 3.0));
            let found = mesh.charts[chart as usize].sample(uv, f32x8::splat(1e-4)).0.x.to_array()[0];
            assert!((found - expected).abs() < 0.1, "{middle:?}: {found} for {expected}");
            counts[usize::from(expected > 0.5)] += 1;
        }
        assert!(counts[0] > 1000 && counts[1] > 20, "triangles off and on letters: {counts:?}");
    }
}
