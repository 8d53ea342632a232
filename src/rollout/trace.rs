//! The trace of an episode: its true state after every control step.

use serde::Serialize;

use super::{evidence::EvidenceCollector, simulation::Simulation};
use softvt_physics::BodyId;
use softvt_robot::rotation;

/// State after a control step; a line of a trace file.
#[derive(Clone, Debug, Serialize)]
pub struct StepTrace {
    /// Control step, from 1.
    pub step: u32,
    /// Time since the start of the episode, s.
    pub time_s: f64,
    /// Tool position, base frame, m.
    pub ee_position_b: [f64; 3],
    /// Tool orientation, base frame, axis-angle, rad, continuous along the episode.
    pub ee_axis_angle_b: [f64; 3],
    /// Arm joint angles, rad.
    pub joints: [f64; 7],
    /// Measured gripper width, m.
    pub gripper_width_m: f64,
    /// Commanded closure, 0 open to 1 closed.
    pub closure: f64,
    /// Normal force of the left and right pad on the target, N.
    pub pad_force_n: [f64; 2],
    /// Shear force over friction capacity of the two pads, 0..=1.
    pub friction_utilisation: [f64; 2],
    /// Slip of the two pads along the target, mm.
    pub slip_mm: [f64; 2],
    /// True if the target was dropped so far.
    pub dropped: bool,
    /// Kinetic, elastic and potential energy, J.
    pub energy_j: [f64; 3],
    pub newton: u32,
    /// All movable objects, in the order of the scene.
    pub objects: Vec<ObjectTrace>,
}

/// State of an object after a control step.
#[derive(Clone, Debug, Serialize)]
pub struct ObjectTrace {
    pub name: String,
    /// Position of its frame, m, world.
    pub position_w: [f64; 3],
    /// Orientation of its frame, wxyz, w ≥ 0.
    pub quaternion_w: [f64; 4],
    /// D, % of the settled bounding-box diagonal; null for a rigid object.
    pub d_pct: Option<f64>,
    /// Minimum determinant of the deformation gradient; null for a rigid object.
    pub min_det_f: Option<f64>,
    pub asleep: bool,
    /// Normal force of the left and right pad on it, N.
    pub pad_force_n: [f64; 2],
    /// Names of the objects and colliders in contact with it.
    pub touches: Vec<String>,
    /// Node positions, m, world, if requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nodes: Option<Vec<[f64; 3]>>,
}

impl StepTrace {
    /// The current state, after control step `step` at `time_s`. `with_nodes` adds the node positions of soft bodies.
    pub(super) fn new(
        sim: &Simulation,
        evidence: &EvidenceCollector,
        target: usize,
        step: u32,
        time_s: f64,
        dropped: bool,
        with_nodes: bool,
    ) -> Self {
        let tool = sim.robot.tool_b(&sim.world);
        let contacts = sim.pad_contacts(&sim.objects[target]);
        let energy = sim.world.energy();
        Self {
            step,
            time_s,
            ee_position_b: tool.translation.vector.into(),
            ee_axis_angle_b: sim.robot.ee_axis_angle_b(&sim.world).into(),
            joints: sim.robot.q(&sim.world),
            gripper_width_m: sim.robot.width(&sim.world),
            closure: sim.robot.closure(),
            pad_force_n: contacts.map(|t| t.normal_force),
            friction_utilisation: contacts
                .map(|t| if t.friction_capacity > 0.0 { t.shear() / t.friction_capacity } else { 0.0 }),
            slip_mm: contacts.map(|t| 1e3 * t.slip_distance),
            dropped,
            energy_j: [energy.kinetic, energy.elastic, energy.potential],
            newton: sim.world.solver_stats().newton_steps,
            objects: (0..sim.objects.len())
                .filter(|&i| sim.objects[i].body != BodyId::World)
                .map(|i| object(sim, evidence, i, with_nodes))
                .collect(),
        }
    }
}

fn object(sim: &Simulation, evidence: &EvidenceCollector, index: usize, with_nodes: bool) -> ObjectTrace {
    let instance = &sim.objects[index];
    let pose = sim.pose(instance);
    let q = rotation::canonical(&pose.rotation);
    let soft = match instance.body {
        BodyId::Soft(index) => Some(sim.world.soft(index)),
        _ => None,
    };
    let contacts = sim.world.contacts(instance.body).iter();
    ObjectTrace {
        name: instance.name.clone(),
        position_w: pose.translation.vector.into(),
        quaternion_w: [q.w, q.i, q.j, q.k],
        d_pct: evidence.deformation(index).map(|d| d.rms_pct),
        min_det_f: soft.map(|s| s.state.min_det_f().det_f),
        asleep: sim.is_asleep(instance),
        pad_force_n: sim.pad_contacts(instance).map(|t| t.normal_force),
        touches: contacts.map(|contact| sim.world.partner_name(contact.partner).to_owned()).collect(),
        nodes: soft.filter(|_| with_nodes).map(|s| s.state.x.iter().map(|x| (*x).into()).collect()),
    }
}
