-- Hold trials of a calibration: the expert's lift at its largest pace.
local trial = {
  LIFT = 0.05, -- height of the lift, m
  SPEED = 0.224, -- largest speed of the lift, m/s, times grasp.carry_pace
  DISPLACEMENT = 2.5e-4, -- largest displacement of the grasp in each horizontal direction, m
  SLIP_MM = 2, -- slip that fails a trial, mm
  CONTACT_N = 1e-3, -- force per pad that counts as contact, N
}

-- Runs an expert to its end and returns false if the physics failed. A pose out of reach is an error: it says nothing
-- of the object.
function trial.drive(sim, expert)
  local ok, why = sim:drive(expert)
  if why and why:find "^the expert gave up" then error(why, 0) end
  return ok
end

return trial
