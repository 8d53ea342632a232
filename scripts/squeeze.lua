-- The squeeze experiment: two rigid flat pads with sharp edges grip, lift and hold a free soft body. Motions are
-- prescribed, so that other simulators and static solvers can be compared row by row. D is measured from the rest
-- shape, not from the settled shape as in the benchmark.
--
--   softvt scripts/squeeze.lua --gap-mm 48,42,36 --json
local mm = 1e-3

local opt = softvt.options {
  shape = {
    default = "cube",
    choices = { "cube", "sphere", "cylinder", "capsule" },
    help = "shape of the body; cylinder and capsule lie on their side",
  },
  size_mm = { default = 50, unit = "mm", min = 1, max = 1000, help = "edge of the cube" },
  radius_mm = { default = 25, unit = "mm", min = 1, max = 500, help = "radius of the round shapes" },
  length_mm = { default = 80, unit = "mm", min = 1, max = 1000, help = "total length of cylinder and capsule" },
  resolution = { default = 6, integer = true, min = 1, max = 64, help = "voxels along the longest edge" },
  youngs_pa = { default = 3e4, unit = "Pa", min = 1, max = 1e12, help = "Young's modulus" },
  poisson = { default = 0.4, min = 0, max = 0.499, help = "Poisson's ratio" },
  density = { default = 300, unit = "kg/m³", min = 1, max = 1e5, help = "density" },
  friction = { default = 1.2, min = 0, max = 10, help = "both coefficients of pads and table; the body has none" },
  beta_s = { default = 2e-3, unit = "s", min = 0, max = 1, help = "stiffness-proportional damping" },
  pad_mm = { default = 22, unit = "mm", min = 1, max = 200, help = "edge of the pads" },
  pad_offset_mm = { default = { 0, 0 }, unit = "mm", help = "pads moved along y and z" },
  gap_mm = {
    default = { 48, 46, 44, 42, 38, 34, 30 },
    unit = "mm",
    help = "distances of the closed pads, one row each",
  },
  lift_mm = { default = 100, unit = "mm", min = 0, max = 1000, help = "height of the lift" },
  hold_s = { default = 0.5, unit = "s", min = 0, max = 600, help = "time in the air" },
  dt = { default = 1 / 60, unit = "s", min = 1e-4, max = 0.05, help = "time step" },
}

local SETTLE_S, GRIP_S, LIFT_S = 0.10, 0.25, 1.0
local CLEARANCE, CLOSING = 2 * mm, 0.04 -- m and m/s, each pad
local PAD_THICKNESS = 10 * mm
local GRIP_WINDOW_S, HOLD_WINDOW_S = 0.05, 0.3

-- Returns the centred shape, and its width between the pads, which equals its height.
local function shape_of(o)
  local radius, length = o.radius_mm * mm, o.length_mm * mm
  local lying = { axis = "x", angle = math.pi / 2 }
  if o.shape == "cube" then
    return softvt.shape.box { size = { o.size_mm * mm, o.size_mm * mm, o.size_mm * mm } }, o.size_mm * mm
  end
  if o.shape == "sphere" then return softvt.shape.sphere { radius = radius }, 2 * radius end
  if o.shape == "cylinder" then
    return softvt.shape.cylinder { radius = radius, height = length }:rotate(lying), 2 * radius
  end
  return softvt.shape.capsule { radius = radius, length = length }:rotate(lying), 2 * radius
end

local function build(o)
  local shape, width = shape_of(o)
  local world = softvt.world { dt = o.dt, rayleigh_stiffness = o.beta_s, sleeping = false }
  local grip = { static_mu = o.friction, dynamic_mu = o.friction }
  local body = world:soft {
    name = o.shape,
    shape = shape,
    friction = { static_mu = 0, dynamic_mu = 0 },
    position = { 0, 0, width / 2 },
    body = softvt.soft { youngs_pa = o.youngs_pa, poisson = o.poisson, density = o.density, resolution = o.resolution },
  }
  local slab = softvt.shape.box { size = { 1, 1, 0.1 } }
  world:static { name = "table", shape = slab, friction = grip, position = { 0, 0, -0.05 } }
  local pad = softvt.shape.box { size = { PAD_THICKNESS, o.pad_mm * mm, o.pad_mm * mm } }
  local pads = {}
  for i, side in ipairs { -1, 1 } do
    local x = side * (width / 2 + CLEARANCE + PAD_THICKNESS / 2)
    pads[i] = {
      side = side,
      solid = world:kinematic { name = "pad", shape = pad, friction = grip, position = { x, 0, width / 2 } },
    }
  end
  return { world = world, body = body, pads = pads, width = width }
end

-- Minimum-jerk time scaling on [0, 1] (Flash and Hogan, 1985).
local function smooth(u)
  u = math.max(0, math.min(1, u))
  return u * u * u * (10 + u * (6 * u - 15))
end

-- Position of the pads' inner faces (distance from the centre plane, rise) as a function of time.
local function motion(o, width, gap)
  local open = width / 2 + CLEARANCE
  local closed_at = SETTLE_S + (open - gap / 2) / CLOSING
  local lift_at = closed_at + GRIP_S
  local function at(time)
    local x = math.max(gap / 2, open - CLOSING * math.max(0, time - SETTLE_S))
    return x, o.lift_mm * mm * smooth((time - lift_at) / LIFT_S)
  end
  return at, lift_at, lift_at + LIFT_S
end

-- Means of D and force over a window, and the heights at its ends.
local function window() return { n = 0, d = 0, force = 0 } end

local function look(w, time, d, force, height)
  w.n, w.d, w.force = w.n + 1, w.d + d, w.force + force
  w.first = w.first or { time, height }
  w.last = { time, height }
end

local function mean(w, key) return w.n > 0 and w[key] / w.n or nil end

local function creep_mm_per_s(w)
  if w.n < 2 then return nil end
  return (w.first[2] - w.last[2]) / (w.last[1] - w.first[1]) / mm
end

local function run(point, o)
  local gap = point.gap_mm * mm
  local scene = build(o)
  local world, body = scene.world, scene.body
  local at, lift_at, hold_at = motion(o, scene.width, gap)
  local finish = hold_at + o.hold_s
  local start_z = body:centre()[3]
  local grip, hold, peak, least, steps = window(), window(), 0, math.huge, 0
  local phase, ok, problem

  while world:time() + 0.5 * o.dt < finish do
    local time = world:time() + o.dt
    local now = time <= lift_at and "table" or time <= hold_at and "lift" or "hold"
    if now ~= phase then
      phase = now
      world:phase(phase)
    end
    local x, rise = at(time)
    for _, pad in ipairs(scene.pads) do
      local y, z = o.pad_offset_mm[1] or 0, o.pad_offset_mm[2] or 0
      pad.solid:move_to { pad.side * (x + PAD_THICKNESS / 2), y * mm, scene.width / 2 + z * mm + rise }
    end
    ok, problem = world:step()
    steps = steps + 1
    if not ok then break end
    local d = body:deformation().rms_pct
    local force = 0.5 * (body:force(scene.pads[1].solid) + body:force(scene.pads[2].solid))
    peak, least = math.max(peak, d), math.min(least, body:min_det_f() or 1)
    local height = body:centre()[3]
    if time <= lift_at and time > lift_at - GRIP_WINDOW_S then look(grip, time, d, force, height) end
    if time > finish - HOLD_WINDOW_S then look(hold, time, d, force, height) end
  end

  world:report_timing()
  local rise = body:centre()[3] - start_z
  local newton_mean, newton_max = world:newton()
  return {
    gap_mm = point.gap_mm,
    holds = ok and rise > 0.8 * o.lift_mm * mm,
    invalid = problem,
    slip_mm = ok and o.lift_mm - rise / mm or nil,
    creep_mm_per_s = ok and creep_mm_per_s(hold) or nil,
    d_grip_pct = mean(grip, "d"),
    d_hold_pct = ok and mean(hold, "d") or nil,
    d_peak_pct = peak,
    force_grip_n = mean(grip, "force"),
    force_hold_n = ok and mean(hold, "force") or nil,
    min_det_f = least,
    steps = steps,
    newton_mean = newton_mean,
    newton_max = newton_max,
  }
end

return softvt.experiment {
  name = "squeeze",
  options = opt,
  points = function(o)
    local points = {}
    for i, gap in ipairs(o.gap_mm) do
      points[i] = { gap_mm = gap }
    end
    return points
  end,
  run = run,
  columns = {
    "gap_mm",
    "holds",
    "slip_mm",
    "creep_mm_per_s",
    "d_grip_pct",
    "d_hold_pct",
    "d_peak_pct",
    "force_grip_n",
    "force_hold_n",
    "min_det_f",
    "steps",
    "newton_mean",
    "newton_max",
    "invalid",
  },
}
