//! Exact triangle meshes of shapes composed of boxes, prisms, cylinders and surfaces of revolution.
//!
//! A general surface mesher would leave ragged cells along their edges and seams.

use super::lathe_mesh::lathe_mesh;
use crate::geometry::{
    Pose, Vec3,
    mesh::Mesh,
    shape::{Polygon, Shape},
};

/// Vertices deeper than this inside another part of a union are invisible, m.
const HIDDEN_DEPTH: f64 = 2e-4;

/// Triangulates a shape exactly, round parts with edges about `cell` long; `None` if a part of it is not a primitive.
pub(crate) fn primitive_mesh(shape: &Shape, cell: f64) -> Option<Mesh> {
    match shape {
        Shape::Box { half } => Some(box_mesh(half)),
        Shape::Prism { section, half_length } => Some(prism(section, *half_length)),
        Shape::Lathe(profile) => Some(lathe_mesh(profile, cell)),
        Shape::Cylinder { radius: r, half_height: h } => {
            let profile = Polygon::revolved(vec![[0.0, -h], [*r, -h], [*r, *h], [0.0, *h]]).ok()?;
            Some(lathe_mesh(&profile, cell))
        }
        Shape::Paint { shape, .. } => primitive_mesh(shape, cell),
        Shape::Placed { shape, pose } => {
            let mut mesh = primitive_mesh(shape, cell)?;
            transform(&mut mesh, pose);
            Some(mesh)
        }
        Shape::Scaled { shape, scale } => {
            let mut mesh = primitive_mesh(shape, cell / scale.max())?;
            mesh.vertices.iter_mut().for_each(|v| *v = v.component_mul(scale));
            Some(mesh)
        }
        Shape::Union(parts) => {
            let mut whole = Mesh::default();
            for (i, part) in parts.iter().enumerate() {
                let mesh = primitive_mesh(part, cell)?;
                let is_hidden = |v: &Vec3| {
                    let mut others = parts.iter().enumerate().filter(|(j, _)| *j != i);
                    others.any(|(_, other)| other.distance(v) < -HIDDEN_DEPTH)
                };
                append_visible(&mut whole, mesh, is_hidden);
            }
            Some(whole)
        }
        _ => None,
    }
}

/// Triangulates a box, wherever it is placed, or a union of boxes; `None` for other shapes.
pub fn flat_faces(shape: &Shape) -> Option<Mesh> {
    match shape {
        Shape::Box { half } => Some(box_mesh(half)),
        Shape::Placed { shape, pose } => {
            let mut mesh = flat_faces(shape)?;
            transform(&mut mesh, pose);
            Some(mesh)
        }
        Shape::Union(parts) => {
            let mut whole = Mesh::default();
            for part in parts {
                append_visible(&mut whole, flat_faces(part)?, |_| false);
            }
            Some(whole)
        }
        _ => None,
    }
}

/// Triangulates a box about the origin with these half extents, m.
pub fn box_mesh(half: &Vec3) -> Mesh {
    let corner =
        |c: usize| Vec3::from_fn(|axis, _| if c >> axis & 1 == 1 { half[axis] } else { -half[axis] });
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    Mesh { vertices: (0..8).map(corner).collect(), triangles, uvs: Vec::new() }
}

/// Moves the vertices of a mesh by `pose`.
pub(crate) fn transform(mesh: &mut Mesh, pose: &Pose) {
    mesh.vertices.iter_mut().for_each(|v| *v = pose.transform_point(&(*v).into()).coords);
}

/// Appends `mesh` to `whole`, without triangles all of whose vertices are hidden.
pub(crate) fn append_visible(whole: &mut Mesh, mesh: Mesh, is_hidden: impl Fn(&Vec3) -> bool) {
    let hidden: Vec<bool> = mesh.vertices.iter().map(is_hidden).collect();
    let first = whole.vertices.len() as u32;
    let visible = mesh.triangles.iter().filter(|t| !t.iter().all(|&v| hidden[v as usize]));
    whole.triangles.extend(visible.map(|t| t.map(|v| v + first)));
    whole.vertices.extend(mesh.vertices);
}

/// Triangulates a polygon in (x, z), convex or not, extruded along y.
fn prism(section: &Polygon, half_length: f64) -> Mesh {
    let corners = section.points();
    let n = corners.len() as u32;
    let end = |y: f64| corners.iter().map(move |p| Vec3::new(p[0], y, p[1]));
    let mut triangles = Vec::new();
    for (i, j) in (0..n).map(|i| (i, (i + 1) % n)) {
        triangles.extend([[i, n + i, n + j], [i, n + j, j]]);
    }
    for [a, b, c] in clip_ears(corners) {
        triangles.extend([[a, b, c], [n + a, n + c, n + b]]);
    }
    Mesh { vertices: end(-half_length).chain(end(half_length)).collect(), triangles, uvs: Vec::new() }
}

/// Triangulates a simple counter-clockwise polygon by ear clipping (Meisters, Polygons Have Ears, 1975).
fn clip_ears(corners: &[[f64; 2]]) -> Vec<[u32; 3]> {
    let signed_area = |a: u32, b: u32, c: u32| {
        let [a, b, c] = [a, b, c].map(|i| corners[i as usize]);
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    let mut remaining: Vec<u32> = (0..corners.len() as u32).collect();
    let mut triangles = Vec::new();
    while remaining.len() > 3 {
        let n = remaining.len();
        let triangle_at = |i: usize| [remaining[(i + n - 1) % n], remaining[i], remaining[(i + 1) % n]];
        let is_ear = |&i: &usize| {
            let [a, b, c] = triangle_at(i);
            let contains = |&p: &u32| {
                signed_area(a, b, p) > 0.0 && signed_area(b, c, p) > 0.0 && signed_area(c, a, p) > 0.0
            };
            signed_area(a, b, c) > 0.0 && !remaining.iter().any(contains)
        };
        // A simple polygon always has an ear. If rounding hides it, any corner will do.
        let i = (0..n).find(is_ear).unwrap_or(0);
        triangles.push(triangle_at(i));
        remaining.remove(i);
    }
    triangles.extend(remaining.first_chunk::<3>().copied());
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_concave_prism_is_closed_and_encloses_its_volume() {
        let house = vec![
            [-2.0, 0.0],
            [2.0, 0.0],
            [2.0, 3.0],
            [0.5, 4.0],
            [0.5, 5.0],
            [-0.5, 5.0],
            [-0.5, 4.0],
            [-2.0, 3.0],
        ];
        let area = 12.0 + 2.5 + 1.0;
        let shape = Shape::prism(house, 2.0).expect("a prism");
        let mesh = primitive_mesh(&shape, 0.1).expect("a prism is a primitive");
        assert!((mesh.volume() - 2.0 * area).abs() < 1e-9, "{}", mesh.volume());
        assert_eq!(mesh.triangles.len(), 16 + 12);
    }

    #[test]
    fn a_union_has_no_hidden_triangles() {
        let bottle = Shape::lathe(vec![[0.0, 0.0], [0.02, 0.0], [0.02, 0.05], [0.0, 0.05]]).expect("a lathe");
        let flat = bottle.clone().scaled(Vec3::new(1.0, 0.6, 1.0));
        let cap = Shape::Cylinder { radius: 0.008, half_height: 0.01 }.translated(Vec3::z() * 0.055);
        let count = |shape: &Shape| primitive_mesh(shape, 1e-3).expect("a primitive").triangles.len();
        let separate = count(&flat) + count(&cap);
        let mesh = primitive_mesh(&flat.clone().union(cap.clone()), 1e-3).expect("a union of primitives");
        assert!(mesh.triangles.len() < separate, "the foot of the cap is hidden");
        let whole = flat.union(cap);
        for v in &mesh.vertices {
            // Corners are drawn rounded, by less than 0.2 mm.
            assert!(whole.distance(v) < 1e-4, "{v:?}");
        }
        assert!(primitive_mesh(&bottle.rounded(1e-3), 1e-3).is_none());
    }
}
