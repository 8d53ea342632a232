//! The Franka Panda: kinematics, inertias, differential inverse kinematics, the gripper with its GelSight pads.
