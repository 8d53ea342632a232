//! Noticing that an expert asks for what the arm cannot do: a policy may try anything, a script has a mistake in it.

use crate::{
    geometry::Pose,
    robot::ik::{UnreachablePose, pose_error},
    rollout::Simulation,
};

/// Farther from its command than this the tool is not where it was sent, m and rad.
const AWAY: (f64, f64) = (0.02, 0.2);

/// Control steps that the tool may be away before its reach is searched, which costs tens of milliseconds; a fast motion
/// lags by this much for less long, and is found reachable at once otherwise.
const PATIENCE: u32 = 20;

/// Watches how far the tool stays behind its commands.
#[derive(Debug, Default)]
pub(crate) struct Lag {
    command_b: Option<Pose>,
    steps: u32,
}

impl Lag {
    /// Notes what the tool was sent to, robot base frame.
    pub(crate) fn sent(&mut self, command_b: &Pose) {
        self.command_b = Some(*command_b);
    }

    /// What to tell the script once the tool has been away for a second from a pose that it cannot take.
    pub(crate) fn complaint(&mut self, sim: &Simulation) -> Option<String> {
        let command_b = self.command_b?;
        let (linear, angular) = pose_error(&sim.robot.tool_b(&sim.world), &command_b);
        self.steps = if is_away(linear.norm(), angular.norm()) { self.steps + 1 } else { 0 };
        if self.steps < PATIENCE {
            return None;
        }
        self.steps = 0;
        let miss = sim.robot.reach(&sim.world, &command_b).err()?;
        is_away(miss.distance, miss.angle).then(|| message(&miss, &sim.robot.base_w))
    }
}

fn is_away(distance: f64, angle: f64) -> bool {
    distance > AWAY.0 || angle > AWAY.1
}

/// Scripts give poses in the world frame.
fn message(miss: &UnreachablePose, base_w: &Pose) -> String {
    let target = base_w.transform_point(&miss.target_b.into());
    let base = base_w.translation.vector;
    format!(
        "unreachable pose: the tool gets no nearer to ({:.3}, {:.3}, {:.3}) m than {:.0} mm and {:.0}°; bring it nearer to \
         the robot's base at ({:.3}, {:.3}, {:.3}) m or turn it towards straight down",
        target.x,
        target.y,
        target.z,
        miss.distance * 1e3,
        miss.angle.to_degrees(),
        base.x,
        base.y,
        base.z
    )
}
