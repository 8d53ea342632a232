-- A hold trial of a calibration: the expert's lift at its largest pace.
return {
  LIFT = 0.05, -- height of the lift, m
  SPEED = 0.224, -- largest speed of the lift, m/s, times grasp.carry_pace
  DISPLACEMENT = 2.5e-4, -- largest displacement of the grasp in each horizontal direction, m
  SLIP_MM = 2, -- slip that fails a trial, mm
  CONTACT_N = 1e-3, -- force per pad that counts as contact, N
}
