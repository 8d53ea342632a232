//! Connected pieces of a voxel mesh.

use serde::{Deserialize, Serialize};

use super::{union_find::UnionFind, voxel::VoxelMesh};

/// The pieces of a mesh whose elements are not all connected by common nodes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SeparatePieces {
    /// Number of pieces, at least 2.
    pub count: usize,
    /// Smallest distance between a node of the first piece and one of another, m.
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
        let first = mesh.nodes.iter().zip(&pieces).filter(|(_, piece)| **piece == pieces[0]);
        let distance = |node: &super::Vec3| {
            let others = mesh.nodes.iter().zip(&pieces).filter(|(_, piece)| **piece != pieces[0]);
            others.map(|(other, _)| (other - node).norm()).fold(f64::INFINITY, f64::min)
        };
        let gap = first.map(|(node, _)| distance(node)).fold(f64::INFINITY, f64::min);
        Some(Self { count, gap })
    }
}
