//! Overlaps of the closed pieces of a mesh, whose common part would count twice in volume and mass.

use std::collections::BTreeMap;

use parry3d_f64::{
    query::{PointQuery, Ray, RayCast},
    shape::{TriMesh, TriMeshFlags},
};

use super::{
    Aabb, Vec3,
    aabb::{GroupedAabb, overlapping_pairs},
    mesh::{Mesh, MeshError},
    parry::{from_parry, to_parry},
    union_find::UnionFind,
};

/// Shares of an edge, and of the size of a piece, within which a crossing is a touch.
const ROUNDING: f64 = 1e-6;

/// A closed piece of a mesh.
struct Piece {
    /// Its triangles, facing outwards.
    mesh: Mesh,
    bounds: Aabb,
    /// True if the triangles faced inwards: it is the wall of a cavity.
    is_cavity: bool,
    tree: TriMesh,
}

impl Piece {
    /// `None` for a sheet, which has no volume to count twice.
    fn new(mut mesh: Mesh) -> Option<Self> {
        if mesh.is_flat() {
            return None;
        }
        let is_cavity = mesh.volume() < 0.0;
        if is_cavity {
            mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        let bounds = Aabb::from_points(&mesh.vertices)?;
        let points = mesh.vertices.iter().map(to_parry).collect();
        let tree = TriMesh::with_flags(points, mesh.triangles.clone(), TriMeshFlags::ORIENTED).ok()?;
        Some(Self { mesh, bounds, is_cavity, tree })
    }

    /// True if an edge of this piece passes through the inside of another one.
    fn crosses(&self, other: &Self) -> bool {
        let edges = self.mesh.triangles.iter().flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
        edges.filter(|[a, b]| a < b).any(|edge| {
            let [from, to] = edge.map(|v| self.mesh.vertices[v as usize]);
            if !Aabb::from_points(&[from, to]).is_some_and(|bounds| bounds.intersects(&other.bounds)) {
                return false;
            }
            let at = |share: f64| from + (to - from) * share;
            let hit_after = |share: f64| {
                let ray = Ray::new(to_parry(&at(share)), to_parry(&(to - from)));
                other.tree.cast_local_ray(&ray, 1.0 - share, false).map(|on| share + on)
            };
            // Edges that run along a surface hit it as well: the middle between two hits tells.
            let mut last = 0.0;
            while let Some(hit) = hit_after(last + ROUNDING) {
                if other.side(&at(0.5 * (last + hit))) == Some(true) {
                    return true;
                }
                last = hit;
            }
            last > 0.0 && other.side(&at(0.5 * (last + 1.0))) == Some(true)
        })
    }

    /// Whether a point is inside; `None` on the surface.
    fn side(&self, p: &Vec3) -> Option<bool> {
        let found = self.tree.project_local_point(to_parry(p), false);
        let distance = (from_parry(found.point) - p).norm();
        (distance > ROUNDING * self.bounds.size().norm()).then_some(found.is_inside)
    }

    /// True if another piece, whose surface does not cross this one, lies inside of it.
    fn holds(&self, other: &Self) -> bool {
        other.mesh.vertices.iter().find_map(|p| self.side(p)).unwrap_or(false)
    }
}

/// Checks that no point of space is inside of two pieces of a closed mesh, or of a cavity in nothing. Pieces share no
/// vertex. `mesh` faces outwards on the whole.
///
/// # Errors
/// [`MeshError::Overlap`] if one is.
pub(crate) fn check_pieces(mesh: &Mesh) -> Result<(), MeshError> {
    let mut sets = UnionFind::new(mesh.vertices.len());
    for [a, b, c] in mesh.triangles.iter().map(|t| t.map(|v| v as usize)) {
        sets.union(a, b);
        sets.union(b, c);
    }
    let mut of_piece: BTreeMap<usize, Vec<[u32; 3]>> = BTreeMap::new();
    for triangle in &mesh.triangles {
        of_piece.entry(sets.find(triangle[0] as usize)).or_default().push(*triangle);
    }
    if of_piece.len() < 2 {
        return Ok(());
    }
    let pieces: Vec<Piece> =
        of_piece.into_values().filter_map(|triangles| Piece::new(mesh.part(&triangles))).collect();
    let boxes = pieces.iter().zip(0..).map(|(piece, group)| GroupedAabb { bounds: piece.bounds, group });
    let pairs = overlapping_pairs(&boxes.collect::<Vec<_>>());
    // Number of solids around each piece, minus that of cavities.
    let mut around = vec![0; pieces.len()];
    for (i, j) in pairs {
        let (one, other) = (&pieces[i], &pieces[j]);
        if one.crosses(other) || other.crosses(one) {
            return Err(MeshError::Overlap);
        }
        for (inner, outer) in [(i, j), (j, i)] {
            if pieces[outer].holds(&pieces[inner]) {
                around[inner] += if pieces[outer].is_cavity { -1 } else { 1 };
            }
        }
    }
    let is_odd = |(piece, around): (&Piece, &i32)| *around != i32::from(piece.is_cavity);
    if pieces.iter().zip(&around).any(is_odd) { Err(MeshError::Overlap) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box with triangles that face outwards, or inwards.
    fn cuboid(centre: [f64; 3], size: [f64; 3], faces_inwards: bool) -> Mesh {
        let corner =
            |i: usize| Vec3::from_fn(|axis, _| centre[axis] + size[axis] * ((i >> axis & 1) as f64 - 0.5));
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let mut triangles: Vec<[u32; 3]> =
            quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        if faces_inwards {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        Mesh { vertices: (0..8).map(corner).collect(), triangles, uvs: Vec::new() }
    }

    fn check(parts: &[Mesh]) -> Result<(), MeshError> {
        let mut all = Mesh::default();
        for part in parts {
            let base = all.vertices.len() as u32;
            all.vertices.extend(&part.vertices);
            all.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + base)));
        }
        let all = all.welded();
        assert!(all.validate_closed().is_ok() && all.volume() > 0.0);
        check_pieces(&all)
    }

    #[test]
    fn pieces_that_count_a_point_twice_are_refused_and_cavities_are_not() {
        let block = cuboid([0.0; 3], [0.04, 0.03, 0.03], false);
        let overlap = Err(MeshError::Overlap);
        assert_eq!(check(std::slice::from_ref(&block)), Ok(()));
        assert_eq!(check(&[block.clone(), cuboid([0.03, 0.0, 0.0], [0.04, 0.018, 0.018], false)]), overlap);
        let rod = cuboid([0.001, 0.001, 0.0], [0.01, 0.01, 0.1], false);
        assert_eq!(check(&[block.clone(), rod]), overlap, "no corner is inside of the other");
        assert_eq!(check(&[block.clone(), cuboid([0.0; 3], [0.03, 0.02, 0.02], false)]), overlap, "nested");
        let cavity = cuboid([0.0; 3], [0.03, 0.02, 0.02], true);
        assert_eq!(check(&[block.clone(), cavity.clone()]), Ok(()));
        let kernel = cuboid([0.0; 3], [0.01; 3], false);
        assert_eq!(check(&[block.clone(), cavity, kernel]), Ok(()), "a piece inside of the cavity");
        assert_eq!(
            check(&[block.clone(), cuboid([0.1, 0.0, 0.0], [0.01; 3], true)]),
            overlap,
            "a cavity in nothing"
        );
        assert_eq!(check(&[block.clone(), cuboid([0.05, 0.0, 0.0], [0.01; 3], false)]), Ok(()), "apart");
        assert_eq!(check(&[block, cuboid([0.001, 0.002, 0.02], [0.01; 3], false)]), Ok(()), "on its face");
    }
}
