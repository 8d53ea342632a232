//! Connected pieces of a voxel mesh.

use serde::{Deserialize, Serialize};

use super::{
    Aabb,
    shape::Shape,
    union_find::UnionFind,
    voxel::{VoxelGrid, VoxelMesh, VoxelSpec, voxel_mesh},
};

/// The pieces of a mesh whose elements are not all connected by common nodes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SeparatePieces {
    /// Number of pieces, at least 2.
    pub count: usize,
    /// Smallest distance between the first piece and another, to about a sub-cell of a voxel, m.
    pub gap: f64,
}

impl SeparatePieces {
    /// The pieces of a mesh; `None` if it is connected.
    pub fn find(mesh: &VoxelMesh) -> Option<Self> {
        let mut sets = UnionFind::new(mesh.nodes.len());
        for element in &mesh.elements {
            element[1..].iter().for_each(|&node| sets.union(element[0] as usize, node as usize));
        }
        let pieces: Vec<usize> = (0..mesh.nodes.len()).map(|node| sets.find(node)).collect();
        // The representative of a set is its least element.
        let count = pieces.iter().enumerate().filter(|(node, piece)| node == *piece).count();
        if count < 2 {
            return None;
        }
        let filled = |element: usize| -> Option<Aabb> {
            let lowest = mesh.nodes[mesh.elements[element][0] as usize];
            let local = mesh.occupancy[element].bounds()?;
            Some(Aabb { min: lowest + local.min * mesh.edge, max: lowest + local.max * mesh.edge })
        };
        let (first, others): (Vec<usize>, Vec<usize>) = (0..mesh.elements.len())
            .partition(|&element| pieces[mesh.elements[element][0] as usize] == pieces[0]);
        let others: Vec<Aabb> = others.into_iter().filter_map(filled).collect();
        let distances = first
            .into_iter()
            .filter_map(filled)
            .flat_map(|of_first| others.iter().map(move |other| of_first.distance(other)));
        Some(Self { count, gap: distances.fold(f64::INFINITY, f64::min) })
    }

    /// The pieces of the [`voxel_mesh`] of a shape; `None` if it is connected or cannot be made.
    pub fn of_shape(shape: &Shape, spec: &VoxelSpec) -> Option<Self> {
        let grid = VoxelGrid::covering(shape, &shape.bounds(), spec).ok()?;
        if is_connected(&grid.elements(shape), grid.grid) {
            return None;
        }
        Self::find(&voxel_mesh(shape, spec).ok()?)
    }
}

/// True if the elements of a grid, x fastest, have a path to each other by common corners.
fn is_connected(is_element: &[bool], grid: [usize; 3]) -> bool {
    let index = |cell: [usize; 3]| cell[0] + grid[0] * (cell[1] + grid[1] * cell[2]);
    let mut sets = UnionFind::new(is_element.len());
    for cell in (0..is_element.len()).filter(|&cell| is_element[cell]) {
        let at = [cell % grid[0], cell / grid[0] % grid[1], cell / grid[0] / grid[1]];
        // Half of the 26 neighbours: the others are joined from their side.
        for step in (14..27).map(|k| [k % 3, k / 3 % 3, k / 9]) {
            // Steps are one too many along each axis.
            let neighbour: [usize; 3] = std::array::from_fn(|axis| at[axis] + step[axis]);
            let is_inside = (0..3).all(|axis| (1..=grid[axis]).contains(&neighbour[axis]));
            if is_inside && is_element[index(neighbour.map(|i| i - 1))] {
                sets.union(cell, index(neighbour.map(|i| i - 1)));
            }
        }
    }
    let mut elements = (0..is_element.len()).filter(|&cell| is_element[cell]);
    let first = elements.next().map(|cell| sets.find(cell));
    elements.all(|cell| Some(sets.find(cell)) == first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;

    const SPEC: VoxelSpec = VoxelSpec { resolution: 24 };

    #[test]
    fn the_gap_between_pieces_is_that_of_their_surfaces() {
        let cube = Shape::cuboid(Vec3::repeat(0.02));
        let pair = cube.clone().union(cube.translated(Vec3::new(0.03, 0.0, 0.0)));
        let found = SeparatePieces::of_shape(&pair, &SPEC).unwrap();
        assert_eq!(found.count, 2);
        let sub_cell = 0.05 / 24.0 / 6.0;
        assert!((found.gap - 0.01).abs() <= sub_cell, "{}", found.gap);
    }

    #[test]
    fn pieces_of_a_shape_are_those_of_its_mesh() {
        // One ball, touching and separate balls, balls smaller than a voxel, and a crossing of both.
        let distances = [0.0, 0.0199, 0.0201, 0.022, 0.0235, 0.025, 0.04];
        let counts = distances.map(|distance| {
            let (big, small) = (Shape::Sphere { radius: 0.01 }, Shape::Sphere { radius: 0.0008 });
            let direction = Vec3::new(0.6, 0.64, 0.48);
            let shape = big
                .clone()
                .union(big.translated(direction * distance))
                .union(small.translated(direction * (0.5 * distance)));
            let of_mesh = SeparatePieces::find(&voxel_mesh(&shape, &SPEC).unwrap());
            assert_eq!(SeparatePieces::of_shape(&shape, &SPEC), of_mesh, "{distance}");
            of_mesh.map_or(1, |pieces| pieces.count)
        });
        assert_eq!(counts[0], 1);
        assert_eq!(counts[6], 3);
    }
}
