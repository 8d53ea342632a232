//! Energies and momenta of everything in the world.

use super::World;
use crate::physics::joints::{kinetic_energy, potential_energy};

/// Energies of a world, J.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energy {
    /// Kinetic.
    pub kinetic: f64,
    /// Elastic, of soft bodies.
    pub elastic: f64,
    /// Gravitational, zero at the world's origin.
    pub potential: f64,
}

impl Energy {
    /// The sum.
    pub fn total(&self) -> f64 {
        self.kinetic + self.elastic + self.potential
    }
}

impl World {
    /// Energies now of soft and rigid bodies and of the joint trees on which gravity acts.
    pub fn energy(&self) -> Energy {
        let mut energy = Energy { kinetic: 0.0, elastic: 0.0, potential: 0.0 };
        for soft in &self.soft {
            energy.kinetic += soft.body.kinetic_energy();
            energy.elastic += soft.body.elastic_energy;
            energy.potential -= soft.body.rest.total_mass() * self.gravity.dot(&soft.body.centre());
        }
        for rigid in &self.rigid {
            energy.kinetic += rigid.body.kinetic_energy();
            energy.potential += rigid.body.potential_energy(&self.gravity);
        }
        for tree in self.trees.iter().filter(|tree| tree.gravity) {
            energy.kinetic += kinetic_energy(&tree.tree, &tree.poses, tree.state.v.as_slice());
            energy.potential += potential_energy(&tree.tree, &tree.poses, &self.gravity);
        }
        energy
    }
}
