//! A state in a few letters: the same if and only if every position is the same to the bit.

use sha2::{Digest, Sha256};

use super::simulation::Simulation;

/// Hash of all positions, bit for bit.
pub fn state_hash(sim: &Simulation) -> String {
    let mut hash = Sha256::new();
    let mut put = |x: f64| hash.update(x.to_bits().to_le_bytes());
    for soft in sim.world.soft_bodies() {
        soft.state.x.iter().flat_map(|x| x.iter()).for_each(|x| put(*x));
    }
    for rigid in sim.world.rigid_bodies() {
        rigid.state.pose_w.to_homogeneous().iter().for_each(|x| put(*x));
    }
    for articulation in sim.world.articulations() {
        articulation.state.q.iter().for_each(|x| put(*x));
    }
    hash.finalize().iter().take(8).map(|b| format!("{b:02x}")).collect()
}
