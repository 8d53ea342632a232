//! Triangles of polygons.

use std::collections::BTreeMap;

use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation, mitigate_underflow};

use crate::Vec3;

/// The triangles of a polygon, by indices of its corners. Those of a convex one share its first corner.
pub(super) fn triangles(corners: &[Vec3]) -> Vec<[usize; 3]> {
    let fan = || (2..corners.len()).map(|corner| [0, corner - 1, corner]);
    let double_area = |[a, b, c]: [usize; 3]| (corners[b] - corners[a]).cross(&(corners[c] - corners[a]));
    let normal: Vec3 = fan().map(double_area).sum();
    let is_convex = fan().all(|t| double_area(t).dot(&normal) > 1e-12 * normal.norm_squared());
    let cut = if corners.len() < 4 || is_convex { None } else { delaunay(corners, &normal) };
    cut.unwrap_or_else(|| fan().collect())
}

/// The constrained Delaunay triangulation of a polygon. Unlike cut ears it keeps corners within straight edges, which
/// neighbours may share. `None` if the polygon crosses itself or has no area.
fn delaunay(corners: &[Vec3], normal: &Vec3) -> Option<Vec<[usize; 3]>> {
    let up = normal.iamax();
    let (u, v) = ((up + 1) % 3, (up + 2) % 3);
    let (u, v) = if normal[up] < 0.0 { (v, u) } else { (u, v) };
    let mut plane = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    // First corner at each vertex: an outline that leads around a hole visits some twice.
    let mut corner_at = Vec::new();
    let mut vertices = Vec::with_capacity(corners.len());
    for (index, corner) in corners.iter().enumerate() {
        let vertex = plane.insert(mitigate_underflow(Point2::new(corner[u], corner[v]))).ok()?;
        if vertex.index() == corner_at.len() {
            corner_at.push(index);
        }
        vertices.push(vertex);
    }
    // True for edges that the outline passes an odd number of times; those with the polygon on one side.
    let mut is_border: BTreeMap<[usize; 2], bool> = BTreeMap::new();
    for (index, &from) in vertices.iter().enumerate() {
        let to = vertices[(index + 1) % vertices.len()];
        let edges = plane.try_add_constraint(from, to);
        if edges.is_empty() && from != to {
            return None;
        }
        for edge in edges {
            let [a, b] = plane.directed_edge(edge).vertices().map(|vertex| vertex.index());
            *is_border.entry([a.min(b), a.max(b)]).or_default() ^= true;
        }
    }
    let mut is_inside = vec![None; plane.num_all_faces()];
    let mut reached: Vec<_> = plane.convex_hull().map(|edge| (edge, false)).collect();
    while let Some((edge, from_inside)) = reached.pop() {
        let Some(face) = edge.rev().face().as_inner() else { continue };
        let known = &mut is_inside[face.index()];
        if known.is_none() {
            let [a, b] = edge.vertices().map(|vertex| vertex.index());
            let crosses = is_border.get(&[a.min(b), a.max(b)]).is_some_and(|is_border| *is_border);
            let inside = from_inside ^ crosses;
            *known = Some(inside);
            reached.extend(face.adjacent_edges().map(|edge| (edge, inside)));
        }
    }
    let inside = plane.inner_faces().filter(|face| is_inside[face.index()] == Some(true));
    let triangles: Vec<_> =
        inside.map(|face| face.vertices().map(|vertex| corner_at[vertex.index()])).collect();
    (!triangles.is_empty()).then_some(triangles)
}
