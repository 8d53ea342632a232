-- The standard hand: STROKE is the width of the open gripper, m; CASE the extent of the sensor cases below the tool
-- centre point, m; FORCE the largest force of the hand, N; STIFFNESS that of the drive of a finger, N/m. The hand of a
-- run has arm.stroke and arm.finger_stiffness.
return { STROKE = 0.08, CASE = 0.016, FORCE = 140, STIFFNESS = 2000 }
