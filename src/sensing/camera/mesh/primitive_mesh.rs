//! Triangles of shapes that are put together of boxes, prisms, cylinders and revolved profiles: each as it is, where the cells
//! of a skin would be ragged along their seams.

use crate::geometry::{
    Vec3,
    mesh::Mesh,
    shape::{Polygon, Shape},
};
use crate::sensing::camera::{mesh::lathe_mesh::lathed, mesh::render_mesh::box_mesh};

/// What lies deeper than this inside of another part is never seen, m.
const HIDDEN: f64 = 2e-4;

/// The triangles of a shape, round ones about `cell` (m) wide; `None` if a part of it is none of these.
pub(crate) fn triangles(shape: &Shape, cell: f64) -> Option<Mesh> {
    match shape {
        Shape::Box { half } => Some(box_mesh(half)),
        Shape::Prism { section, half_length } => Some(prism(section, *half_length)),
        Shape::Lathe(profile) => Some(lathed(profile, cell)),
        Shape::Cylinder { radius: r, half_height: h } => {
            Polygon::revolved(vec![[0.0, -h], [*r, -h], [*r, *h], [0.0, *h]]).ok().map(|p| lathed(&p, cell))
        }
        Shape::Paint { shape, .. } => triangles(shape, cell),
        Shape::Placed { shape, pose } => {
            moved(triangles(shape, cell)?, |v| pose.transform_point(&(*v).into()).coords)
        }
        Shape::Scaled { shape, scale } => {
            moved(triangles(shape, cell / scale.max())?, |v| v.component_mul(scale))
        }
        Shape::Union(parts) => union(parts, cell),
        _ => None,
    }
}

fn moved(mut mesh: Mesh, to: impl Fn(&Vec3) -> Vec3) -> Option<Mesh> {
    mesh.vertices.iter_mut().for_each(|v| *v = to(v));
    Some(mesh)
}

/// All parts, without the triangles that others hide.
fn union(parts: &[Shape], cell: f64) -> Option<Mesh> {
    let mut whole = Mesh { vertices: Vec::new(), triangles: Vec::new(), uvs: Vec::new() };
    for (i, part) in parts.iter().enumerate() {
        let mesh = triangles(part, cell)?;
        let others = || parts.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, other)| other);
        let hidden: Vec<bool> =
            mesh.vertices.iter().map(|v| others().any(|other| other.distance(v) < -HIDDEN)).collect();
        let first = whole.vertices.len() as u32;
        let seen = mesh.triangles.iter().filter(|t| !t.iter().all(|&v| hidden[v as usize]));
        whole.triangles.extend(seen.map(|t| t.map(|v| v + first)));
        whole.vertices.extend(mesh.vertices);
    }
    Some(whole)
}

/// A polygon in (x, z), which may be hollow, drawn out along y.
fn prism(section: &Polygon, half_length: f64) -> Mesh {
    let corners = section.points();
    let n = corners.len() as u32;
    let end = |y: f64| corners.iter().map(move |p| Vec3::new(p[0], y, p[1]));
    let mut triangles = Vec::new();
    for (i, j) in (0..n).map(|i| (i, (i + 1) % n)) {
        triangles.extend([[i, n + i, n + j], [i, n + j, j]]);
    }
    for [a, b, c] in ears(corners) {
        triangles.extend([[a, b, c], [n + a, n + c, n + b]]);
    }
    Mesh { vertices: end(-half_length).chain(end(half_length)).collect(), triangles, uvs: Vec::new() }
}

/// Cuts a counter-clockwise polygon into triangles, ear by ear (Meisters, Polygons Have Ears, 1975).
fn ears(corners: &[[f64; 2]]) -> Vec<[u32; 3]> {
    let turn = |a: u32, b: u32, c: u32| {
        let [a, b, c] = [a, b, c].map(|i| corners[i as usize]);
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    let mut left: Vec<u32> = (0..corners.len() as u32).collect();
    let mut triangles = Vec::new();
    while left.len() > 3 {
        let around =
            |i: usize| [left[(i + left.len() - 1) % left.len()], left[i], left[(i + 1) % left.len()]];
        let ear = |&i: &usize| {
            let [a, b, c] = around(i);
            let inside = |&p: &u32| turn(a, b, p) > 0.0 && turn(b, c, p) > 0.0 && turn(c, a, p) > 0.0;
            turn(a, b, c) > 0.0 && !left.iter().any(inside)
        };
        // A simple polygon has an ear; rounding may hide it, and any corner does then.
        let i = (0..left.len()).find(ear).unwrap_or(0);
        triangles.push(around(i));
        left.remove(i);
    }
    triangles.extend(left.first_chunk::<3>().copied());
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(mesh: &Mesh) -> f64 {
        let six = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| mesh.vertices[v as usize]);
            a.dot(&b.cross(&c))
        };
        mesh.triangles.iter().map(six).sum::<f64>() / 6.0
    }

    #[test]
    fn a_hollow_prism_is_closed_and_encloses_its_volume() {
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
        let mesh = triangles(&shape, 0.1).expect("a prism is known");
        assert!((volume(&mesh) - 2.0 * area).abs() < 1e-9, "{}", volume(&mesh));
        assert_eq!(mesh.triangles.len(), 16 + 12);
    }

    #[test]
    fn parts_of_a_union_meet_without_what_is_hidden() {
        let bottle = Shape::lathe(vec![[0.0, 0.0], [0.02, 0.0], [0.02, 0.05], [0.0, 0.05]]).expect("a lathe");
        let flat = bottle.clone().scaled(Vec3::new(1.0, 0.6, 1.0));
        let cap = Shape::Cylinder { radius: 0.008, half_height: 0.01 }.translated(Vec3::z() * 0.055);
        let alone = triangles(&flat, 1e-3).expect("known").triangles.len()
            + triangles(&cap, 1e-3).expect("known").triangles.len();
        let mesh = triangles(&flat.clone().union(cap.clone()), 1e-3).expect("known");
        assert!(mesh.triangles.len() < alone, "the foot of the cap is hidden");
        let whole = flat.union(cap);
        for v in &mesh.vertices {
            // MeshInstance corners are rounded by a fifth of a millimetre.
            assert!(whole.distance(v) < 1e-4, "{v:?}");
        }
        assert!(triangles(&bottle.rounded(1e-3), 1e-3).is_none());
    }
}
