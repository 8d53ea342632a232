//! Textures of curved surfaces with fine print: each connected part that faces mostly along one axis is seen along that axis,
//! so that it is stretched by less than the square root of three.

use std::{collections::BTreeMap, sync::Arc};

use crate::sensing::camera::{V3, mesh::render_mesh::Lod, mesh::texture_chart::TextureChart, shade::pattern};
use crate::{
    geometry::{shape::Shape, union_find::UnionFind},
    scene::Visual,
};

/// Texels are painted so far beyond the triangles that they belong to, texels: their neighbours are looked at, too.
const BEYOND: f32 = 1.5;

/// What a surface is made of: its materials by place, and their looks.
#[derive(Debug)]
pub(crate) struct SurfaceMaterial {
    pub shape: Shape,
    pub visuals: Vec<Visual>,
}

/// A part of a curved surface.
#[derive(Clone, Debug)]
pub(crate) struct CurvedChart {
    cloth: Arc<SurfaceMaterial>,
    /// Corners and normals of its triangles.
    triangles: Vec<[(V3, V3); 3]>,
}

/// Gives every triangle of a level a place in a texture with texels of edge `texel`, m. What looks differ in is then no
/// reason for smaller triangles.
pub(crate) fn wrap(
    level: &mut Lod,
    facets: &mut Vec<TextureChart>,
    cloth: &Arc<SurfaceMaterial>,
    texel: f32,
) {
    let parts = parts(level);
    let mut chart_of = vec![0; level.triangles.len()];
    for (axis, triangles) in parts {
        let corner = |v: u32| (level.positions[v as usize], level.normals[v as usize]);
        let own: Vec<[(V3, V3); 3]> = triangles.iter().map(|&t| level.triangles[t].map(corner)).collect();
        let corners: Vec<V3> = own.iter().flatten().map(|corner| corner.0).collect();
        triangles.iter().for_each(|&t| chart_of[t] = facets.len() as u32);
        let curved = CurvedChart { cloth: cloth.clone(), triangles: own };
        facets.push(TextureChart::curved(&direction(axis), &corners, texel, curved));
    }
    let place = |(t, &facet): (&[u32; 3], &u32)| {
        t.map(|v| facets[facet as usize].place(&level.positions[v as usize]))
    };
    level.places = level.triangles.iter().zip(&chart_of).map(place).collect();
    level.facets = chart_of;
    level.plain = true;
}

/// Twice the number of an axis, and one more for its negative direction.
fn direction(axis: usize) -> V3 {
    let sign = if axis.is_multiple_of(2) { 1.0 } else { -1.0 };
    V3::ith(axis / 2, sign)
}

/// Triangles that hang together and face mostly along one axis, with that.
fn parts(level: &Lod) -> Vec<(usize, Vec<usize>)> {
    let axis_of: Vec<usize> = level
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| level.positions[v as usize]);
            let n = (b - a).cross(&(c - a));
            let axis = n.iamax();
            2 * axis + usize::from(n[axis] < 0.0)
        })
        .collect();
    let mut connected = UnionFind::new(level.triangles.len());
    let mut last: BTreeMap<(u32, usize), usize> = BTreeMap::new();
    for (t, (corners, &axis)) in level.triangles.iter().zip(&axis_of).enumerate() {
        for &v in corners {
            let other = *last.entry((v, axis)).or_insert(t);
            connected.union(other, t);
        }
    }
    let mut parts: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for t in 0..level.triangles.len() {
        parts.entry(connected.find(t)).or_default().push(t);
    }
    parts.into_iter().map(|(first, triangles)| (axis_of[first], triangles)).collect()
}

/// Albedo and roughness of the texels of a part; `place` is where points are, texels.
pub(crate) fn paint(
    curved: &CurvedChart,
    size: [usize; 2],
    texel: f32,
    place: impl Fn(&V3) -> [f32; 2],
) -> Vec<[f32; 4]> {
    let mut points: Vec<Option<(f32, V3, V3)>> = vec![None; size[0] * size[1]];
    for corners in &curved.triangles {
        spread(corners, corners.map(|(p, _)| place(&p)), size, &mut points);
    }
    let SurfaceMaterial { shape, visuals } = &*curved.cloth;
    let look = |(_, p, n): &(f32, V3, V3)| {
        let material = if visuals.len() > 1 { shape.material(&p.cast()) as usize } else { 0 };
        let plain = Visual::default();
        let n = n.try_normalize(0.0).unwrap_or_else(V3::z);
        pattern::look(visuals.get(material).unwrap_or(&plain), p, &n, texel).0.painted()
    };
    filled(points.iter().map(|point| point.as_ref().map(look)).collect(), size)
}

/// Enters the points of a triangle at the texels that it covers, or nearly: distance to its border, point, normal.
fn spread(
    corners: &[(V3, V3); 3],
    at: [[f32; 2]; 3],
    size: [usize; 2],
    points: &mut [Option<(f32, V3, V3)>],
) {
    let cross =
        |a: [f32; 2], b: [f32; 2], p: [f32; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
    let area = cross(at[0], at[1], at[2]);
    if area <= 0.0 {
        return;
    }
    let range = |axis: usize| {
        let [a, b, c] = at.map(|p| p[axis]);
        let (low, high) = (a.min(b).min(c) - BEYOND, a.max(b).max(c) + BEYOND);
        low.max(0.0) as usize..(high.max(0.0).ceil() as usize).min(size[axis])
    };
    for y in range(1) {
        for x in range(0) {
            let p = [x as f32 + 0.5, y as f32 + 0.5];
            let mut inside = f32::MAX;
            let lean: [f32; 3] = std::array::from_fn(|i| {
                let (a, b) = (at[(i + 1) % 3], at[(i + 2) % 3]);
                let lean = cross(a, b, p);
                inside = inside.min(lean / (b[0] - a[0]).hypot(b[1] - a[1]));
                lean
            });
            let known = &mut points[y * size[0] + x];
            if inside > -BEYOND && known.as_ref().is_none_or(|known| known.0 < inside) {
                let lean = lean.map(|l| l.max(0.0));
                let sum: f32 = lean.iter().sum();
                let mix = |of: [V3; 3]| (of[0] * lean[0] + of[1] * lean[1] + of[2] * lean[2]) / sum;
                *known = Some((inside, mix(corners.map(|c| c.0)), mix(corners.map(|c| c.1))));
            }
        }
    }
}

/// Texels that nothing was painted on take the mean of what is around them, from ever coarser copies (pull and push; Gortler
/// et al., The Lumigraph, 1996), so that coarse copies of the texture are clean at its borders.
fn filled(texels: Vec<Option<[f32; 4]>>, size: [usize; 2]) -> Vec<[f32; 4]> {
    if texels.iter().all(Option::is_some) || size == [1, 1] {
        return texels.into_iter().map(Option::unwrap_or_default).collect();
    }
    let half = size.map(|n| n.div_ceil(2));
    let mean = |i: usize| {
        let (x, y) = (2 * (i % half[0]), 2 * (i / half[0]));
        let four = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)].into_iter();
        let own: Vec<[f32; 4]> = four
            .filter(|&(x, y)| x < size[0] && y < size[1])
            .filter_map(|(x, y)| texels[y * size[0] + x])
            .collect();
        let share = 1.0 / own.len().max(1) as f32;
        (!own.is_empty()).then(|| std::array::from_fn(|c| own.iter().map(|t| t[c]).sum::<f32>() * share))
    };
    let coarse = filled((0..half[0] * half[1]).map(mean).collect(), half);
    let around = |i: usize| coarse[(i / size[0] / 2) * half[0] + i % size[0] / 2];
    texels.iter().enumerate().map(|(i, texel)| texel.unwrap_or_else(|| around(i))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        scene::{Mask, TextDecal, TextLine, VisualLayer},
        sensing::camera::{RenderMesh, simd::F8},
    };

    /// A word facing +x, white on black.
    fn printed() -> Visual {
        let line = TextLine {
            text: "soft".into(),
            height_m: 0.012,
            weight: 0.15,
            at: [0.03, 0.0, 0.0],
            facing: [1.0, 0.0, 0.0],
            ..TextLine::default()
        };
        let mask = Mask::Text { decal: Arc::new(TextDecal::new(line)) };
        let layer = VisualLayer { mask, albedo: [1.0; 3], roughness: 0.5, opacity: 1.0, relief_m: 0.0 };
        Visual::plain([0.0; 3], 0.5, 0.0).with(layer)
    }

    fn ball() -> RenderMesh {
        RenderMesh::of_shape("ball", &Shape::Sphere { radius: 0.03 }, &[printed()]).expect("a model")
    }

    #[test]
    fn every_triangle_of_every_level_has_a_place_in_a_texture_that_it_faces() {
        for level in &ball().levels {
            let count = level.triangles.len();
            assert_eq!((level.facets.len(), level.places.len()), (count, count));
            for places in &level.places {
                let [a, b, c] = *places;
                let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
                assert!(area > 0.0 && places.iter().flatten().all(|x| *x > -1e-3), "{places:?}");
            }
        }
        assert_eq!(ball().levels[0].facets.iter().max(), Some(&5), "a ball has six sides");
    }

    #[test]
    fn letters_finer_than_triangles_are_where_they_belong() {
        let model = ball();
        let level = &model.levels[0];
        let mut lit = [0; 2];
        for (places, (t, &facet)) in level.places.iter().zip(level.triangles.iter().zip(&level.facets)) {
            let middle = t.iter().map(|&v| level.positions[v as usize]).sum::<V3>() / 3.0;
            let expected = pattern::look(&printed(), &middle, &middle.normalize(), 1e-3).0.albedo.x;
            if (0.02..=0.98).contains(&expected) {
                continue;
            }
            let place: [F8; 2] =
                std::array::from_fn(|i| F8::splat(places.iter().map(|p| p[i]).sum::<f32>() / 3.0));
            let found = model.facets[facet as usize].sample(place, F8::splat(1e-4)).0.x.to_array()[0];
            assert!((found - expected).abs() < 0.1, "{middle:?}: {found} for {expected}");
            lit[usize::from(expected > 0.5)] += 1;
        }
        assert!(lit[0] > 1000 && lit[1] > 20, "off and on letters: {lit:?}");
    }
}
