//! Noticing that an expert asks for what the arm cannot do: a policy may try anything, a script has a mistake in it.

use crate::{
    geometry::Pose,
    robot::ik::{PoseError, PoseTolerance, UnreachablePose},
    rollout::Simulation,
};

/// Farther from its command than this the tool is not where it was sent, m and rad.
const TRACKING_LIMIT: PoseTolerance = PoseTolerance { distance: 0.02, angle: 0.2 };

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
        let error = PoseError::between(&sim.robot.tool_b(&sim.world), &command_b);
        self.steps = if TRACKING_LIMIT.contains(&error) { 0 } else { self.steps + 1 };
        if self.steps < PATIENCE {
            return None;
        }
        self.steps = 0;
        let miss = sim.robot.solve_ik(&sim.world, &command_b).err()?;
        let is_away = miss.distance > TRACKING_LIMIT.distance || miss.angle > TRACKING_LIMIT.angle;
        is_away.then(|| message(&miss, &sim.robot.base_w))
    }
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
