//! Exact triangle meshes of shapes composed of boxes, prisms, cylinders and surfaces of revolution.
//!
//! A general surface mesher would leave ragged cells along their edges and seams.

use std::f64::consts::TAU;

use softvt_geometry::{
    Pose, Vec3,
    mesh::Mesh,
    shape::{Polygon, Shape},
};

/// Vertices deeper than this inside another part of a union are invisible, m.
const HIDDEN_DEPTH: f64 = 2e-4;
/// Length along each edge over which a corner is drawn rounded, m. The surface moves by less than a fifth of it.
const CORNER_LENGTH: f64 = 1e-3;
/// Segments of a rounded corner.
const CORNER_SEGMENTS: usize = 3;
/// Edge lengths of the mesh in cells. Rings are close along the profile, since painted patterns usually follow them.
const STEP_ALONG: f64 = 0.75;
const STEP_AROUND: f64 = 2.2;

/// Points closer to the axis than this lie on it, m.
const ON_AXIS: f64 = 1e-9;

/// Triangulates a shape exactly, round parts with edges about `cell` long; `None` if a part of it is not a primitive.
/// Triangles inside other parts of a union are left out.
pub(crate) fn primitive_mesh(shape: &Shape, cell: f64) -> Option<Mesh> {
    triangulate(shape, cell, HIDDEN_DEPTH)
}

/// Triangulates a box, wherever it is placed, or a union of boxes; `None` for other shapes.
pub fn flat_faces(shape: &Shape) -> Option<Mesh> {
    fn has_boxes_only(shape: &Shape) -> bool {
        match shape {
            Shape::Box { .. } => true,
            Shape::Placed { shape, .. } => has_boxes_only(shape),
            Shape::Union(parts) => parts.iter().all(has_boxes_only),
            _ => false,
        }
    }
    has_boxes_only(shape).then(|| triangulate(shape, f64::INFINITY, f64::INFINITY)).flatten()
}

/// Vertices deeper than `hidden_depth` inside another part of a union are hidden.
fn triangulate(shape: &Shape, cell: f64, hidden_depth: f64) -> Option<Mesh> {
    match shape {
        Shape::Box { half } => Some(box_mesh(half)),
        Shape::Prism { section, half_length } => Some(prism(section, *half_length)),
        Shape::Lathe(profile) => Some(lathe_mesh(profile, cell)),
        Shape::Cylinder { radius: r, half_height: h } => {
            let profile = Polygon::revolved(vec![[0.0, -h], [*r, -h], [*r, *h], [0.0, *h]]).ok()?;
            Some(lathe_mesh(&profile, cell))
        }
        Shape::Paint { shape, .. } => triangulate(shape, cell, hidden_depth),
        Shape::Placed { shape, pose } => {
            let mut mesh = triangulate(shape, cell, hidden_depth)?;
            transform(&mut mesh, pose);
            Some(mesh)
        }
        Shape::Scaled { shape, scale } => {
            let mut mesh = triangulate(shape, cell / scale.max(), hidden_depth)?;
            mesh.vertices.iter_mut().for_each(|v| *v = v.component_mul(scale));
            Some(mesh)
        }
        Shape::Union(parts) => {
            let mut whole = Mesh::default();
            for (i, part) in parts.iter().enumerate() {
                let is_hidden = |v: &Vec3| {
                    let mut others = parts.iter().enumerate().filter(|(j, _)| *j != i);
                    others.any(|(_, other)| other.distance(v) < -hidden_depth)
                };
                append_visible(&mut whole, triangulate(part, cell, hidden_depth)?, is_hidden);
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

/// Triangulates a profile revolved about z, with edges about `cell` long, m.
fn lathe_mesh(profile: &Polygon, cell: f64) -> Mesh {
    let max_radius = profile.points().iter().map(|p| p[0]).fold(0.0, f64::max);
    let sectors = (TAU * max_radius / (STEP_AROUND * cell)).ceil() as usize;
    revolve(profile, STEP_ALONG * cell, sectors.clamp(24, 400))
}

/// Revolves a profile in `sectors` steps; its edges are divided to at most `step`, m.
fn revolve(profile: &Polygon, step: f64, sectors: usize) -> Mesh {
    let outline = subdivide(&round_corners(profile.points()), step);
    let mut vertices = Vec::new();
    // First vertex of each ring; a ring on the axis is a single vertex.
    let ring_starts: Vec<u32> = outline
        .iter()
        .map(|&[r, z]| {
            let start = vertices.len() as u32;
            let count = if r < ON_AXIS { 1 } else { sectors };
            vertices.extend((0..count).map(|k| {
                let (sin, cos) = (TAU * k as f64 / sectors as f64).sin_cos();
                Vec3::new(r * cos, r * sin, z)
            }));
            start
        })
        .collect();
    let is_on_axis = |i: usize| outline[i][0] < ON_AXIS;
    let vertex = |i: usize, k: usize| {
        if is_on_axis(i) { ring_starts[i] } else { ring_starts[i] + (k % sectors) as u32 }
    };
    let mut triangles = Vec::new();
    for i in 0..outline.len() {
        let j = (i + 1) % outline.len();
        for k in 0..sectors {
            let [a, b, c, d] = [vertex(i, k), vertex(i, k + 1), vertex(j, k + 1), vertex(j, k)];
            if !is_on_axis(i) {
                triangles.push([a, b, if is_on_axis(j) { d } else { c }]);
            }
            if !is_on_axis(j) {
                triangles.push([a, c, d]);
            }
        }
    }
    Mesh { vertices, triangles, uvs: Vec::new() }
}

/// Distance by a square root, which rounds alike on every machine; `hypot` does not.
fn distance(p: [f64; 2], q: [f64; 2]) -> f64 {
    let [x, y] = [q[0] - p[0], q[1] - p[1]];
    (x * x + y * y).sqrt()
}

/// Rounds the corners of a polygon by quadratic Bézier arcs, except those on the axis.
fn round_corners(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let n = points.len();
    let towards = |p: [f64; 2], q: [f64; 2]| {
        let length = distance(p, q);
        let share = CORNER_LENGTH.min(0.4 * length) / length;
        [p[0] + (q[0] - p[0]) * share, p[1] + (q[1] - p[1]) * share]
    };
    let mut rounded = Vec::new();
    for i in 0..n {
        let (previous, corner, next) = (points[(i + n - 1) % n], points[i], points[(i + 1) % n]);
        if corner[0] < ON_AXIS {
            rounded.push(corner);
            continue;
        }
        let (from, to) = (towards(corner, previous), towards(corner, next));
        rounded.extend((0..=CORNER_SEGMENTS).map(|k| {
            let t = k as f64 / CORNER_SEGMENTS as f64;
            let [a, b, c] = [(1.0 - t) * (1.0 - t), 2.0 * t * (1.0 - t), t * t];
            std::array::from_fn(|axis| a * from[axis] + b * corner[axis] + c * to[axis])
        }));
    }
    rounded
}

/// Divides the edges of a polygon to at most `step`, m, except those on the axis.
fn subdivide(points: &[[f64; 2]], step: f64) -> Vec<[f64; 2]> {
    let mut divided = Vec::new();
    for (i, &a) in points.iter().enumerate() {
        let b = points[(i + 1) % points.len()];
        let is_on_axis = a[0] < ON_AXIS && b[0] < ON_AXIS;
        let pieces = if is_on_axis { 1 } else { (distance(a, b) / step).ceil().max(1.0) as usize };
        divided.extend((0..pieces).map(|k| {
            let t = k as f64 / pieces as f64;
            [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]
        }));
    }
    divided
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

    #[test]
    fn a_revolved_profile_is_closed_faces_outwards_and_encloses_its_volume() {
        let profile =
            Polygon::revolved(vec![[0.0, 0.0], [0.05, 0.0], [0.05, 0.02], [0.0, 0.02]]).expect("a profile");
        let mesh = revolve(&profile, 2e-3, 128);
        let volume = mesh.volume();
        let expected = std::f64::consts::PI * 0.05 * 0.05 * 0.02;
        assert!((volume / expected - 1.0).abs() < 2e-3, "{volume} {expected}");
        assert_eq!(mesh.validate_closed(), Ok(()));
    }
}
