//! The triangles of an object with a colour at each vertex, for viewers that draw by themselves.

use super::{
    lod::{Lod, NodeWeights},
    render_mesh::RenderMesh,
};
use crate::camera::{error::CameraError, math::f32x8};

/// Triangles with colours, in the object frame at rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DisplayMesh {
    /// Positions of the vertices, m.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals of the vertices.
    pub normals: Vec<[f32; 3]>,
    /// Albedo at the vertices, linear RGB, 0..=1.
    pub colours: Vec<[f32; 3]>,
    /// Roughness of the surface, mean over the vertices, 0..=1.
    pub roughness: f32,
    /// Counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Nodes that move each vertex; empty for a rigid object.
    pub bindings: Vec<NodeWeights>,
}

impl RenderMesh {
    /// The mesh at the coarsest level of detail that looks like the finest one where a pixel of the viewer covers
    /// `pixel` metres, with the colour of its textures at the vertices.
    ///
    /// # Errors
    /// The level cannot be built.
    pub fn display_mesh(&self, pixel: f32) -> Result<DisplayMesh, CameraError> {
        let lod = self.full_level(pixel)?;
        let roughness = lod.materials.iter().map(|material| material[3]).sum::<f32>();
        Ok(DisplayMesh {
            positions: lod.positions.iter().map(|p| (*p).into()).collect(),
            normals: lod.normals.iter().map(|n| (*n).into()).collect(),
            colours: vertex_colours(lod),
            roughness: roughness / lod.materials.len().max(1) as f32,
            triangles: lod.triangles.clone(),
            bindings: lod.embedding.clone(),
        })
    }
}

/// The colour at each vertex: of its material, or the mean of the textures of its triangles there.
fn vertex_colours(lod: &Lod) -> Vec<[f32; 3]> {
    let plain = |v: usize| [0, 1, 2].map(|channel| lod.materials[v][channel]);
    let mut sums = vec![[0.0_f32; 4]; lod.positions.len()];
    for (triangle, (chart, uvs)) in lod.triangles.iter().zip(lod.chart_ids.iter().zip(&lod.uvs)) {
        let chart = &lod.charts[*chart as usize];
        for (&vertex, uv) in triangle.iter().zip(uvs) {
            let (albedo, _) = chart.sample(uv.map(f32x8::splat), f32x8::splat(lod.vertex_spacing));
            let [r, g, b] = albedo.to_arrays().map(|lanes| lanes[0]);
            let sum = &mut sums[vertex as usize];
            *sum = [sum[0] + r, sum[1] + g, sum[2] + b, sum[3] + 1.0];
        }
    }
    let colour = |(v, [r, g, b, count]): (usize, &[f32; 4])| match *count {
        0.0 => plain(v),
        count => [r / count, g / count, b / count],
    };
    sums.iter().enumerate().map(colour).collect()
}
