-- Presses soft bodies between two pads whose axis is turned against the voxels of the body, at equal force and at equal
-- depth. D of a body of revolution must not depend on the turn; what does is an error of its mesh.
--
--   softvt scripts/turned_press.lua --asset ball,sphere --turn 0,30,45 --resolution 6,12 --json
local grasp = require "experts.grasp"
local press = require "calibration.press"

local STEP = 2e-4 -- step of the width, m
local CLOSING = 0.02 -- speed of each pad, m/s
local REST_SPEED, REST_S, REST_TIMEOUT_S = 5e-4, 0.15, 2
local CLEARANCE = 1e-3 -- gap between each pad and the body at the start, m
local PLATE = 10e-3 -- thickness of a plate, m

-- Assets, and ideal bodies of the material of one: a ball and an upright cylinder with sharp edges.
local names = { "sphere", "golden_bun", "sesame_bun", "steamed_bun", "cylinder" }
local assets = {}
for _, name in ipairs(names) do
  assets[name] = require("assets." .. name)
end
local ideal = {
  ball = { of = "sphere", shape = softvt.shape.sphere { radius = 28.5e-3 }:translate(0, 0, 28.5e-3) },
  drum = { of = "cylinder", shape = softvt.shape.cylinder { radius = 26.5e-3, height = 60e-3 }:translate(0, 0, 30e-3) },
}

local opt = softvt.options {
  asset = {
    default = { "ball", "sphere", "golden_bun", "cylinder" },
    choices = { "ball", "drum", table.unpack(names) },
    help = "bodies",
  },
  turn = {
    default = { 0, 15, 30, 45, 60, 90 },
    unit = "°",
    help = "angle between the axis of the grasp and the voxels",
  },
  resolution = { default = { 6 }, integer = true, min = 1, max = 64, help = "voxels along the longest edge" },
  pads = { default = { "gel", "plate" }, choices = { "gel", "plate" }, help = "gel pads of the hand, or flat plates" },
  turned = {
    default = "voxels",
    choices = { "voxels", "pads", "all" },
    help = "turn voxels and pads about the shape, the pads alone, or all of the scene",
  },
  share = {
    default = { 0.25, 0.5, 1 },
    min = 0.01,
    max = 3,
    help = "force and depth as shares of those at the tight end of the window",
  },
  spacing_mm = { default = 0.75, unit = "mm", min = 0.1, max = 20, help = "spacing of the contact samples" },
}

local function build(point)
  local made = ideal[point.asset]
  local asset = assets[made and made.of or point.asset]
  local shape, from = made and made.shape or asset.shape, asset.body
  local turn = math.rad(point.turn)
  local low, high = shape:bounds()
  local size = { high[1] - low[1], high[2] - low[2], high[3] - low[3] }
  local object = {
    name = asset.name,
    asset = asset.name,
    size = size,
    centre = { 0, 0, size[3] / 2 },
    yaw = 0,
    hints = asset.hints or {},
    scale = 1,
  }
  local window = softvt.grip_window { asset = asset.name }
  if opt.turned == "voxels" then shape = shape:rotate { axis = "z", angle = turn } end
  local world = press.world()
  local body = world:soft {
    name = asset.name,
    shape = shape,
    friction = asset.friction,
    position = { 0, 0, 0 },
    axis_angle = { 0, 0, opt.turned == "all" and turn or 0 },
    body = softvt.soft {
      youngs_pa = from.youngs_pa,
      poisson = from.poisson,
      loss_factor = from.loss_factor,
      density = from.density,
      resolution = point.resolution,
      grasp_spacing = 1e-3 * opt.spacing_mm,
    },
  }
  local yaw = grasp.hand_yaw(object) + turn
  local bench = {
    world = world,
    body = body,
    window = window,
    nominal = grasp.width(object),
    axis = { -math.sin(yaw), math.cos(yaw) },
    height = grasp.height(object),
    pads = {},
  }
  local width = bench.nominal + 2 * CLEARANCE
  for index, side in ipairs { -1, 1 } do
    local facing = yaw - side * math.pi / 2
    local is_gel = point.pads == "gel"
    local function at(w)
      local reach = side * (w / 2 + (is_gel and 0 or PLATE / 2))
      return { reach * bench.axis[1], reach * bench.axis[2], bench.height }
    end
    local spec = { name = "pad", position = at(width), axis_angle = { 0, 0, facing } }
    if not is_gel then
      spec.shape, spec.friction =
        softvt.shape.box { size = { PLATE, 0.1, 2 * bench.height - 2e-3 } }, { static_mu = 1.5, dynamic_mu = 1.2 }
    end
    bench.pads[index] = { at = at, facing = facing, solid = is_gel and world:gel_pad(spec) or world:kinematic(spec) }
  end
  bench.width = width
  return bench
end

local function place(bench, width)
  bench.width = width
  for _, pad in ipairs(bench.pads) do
    pad.solid:move_to(pad.at(width), { 0, 0, pad.facing })
  end
end

local function step(bench)
  local ok, problem = bench.world:step()
  if not ok then error(problem, 0) end
end

local function rest(bench, speed, seconds)
  local dt, resting, elapsed = bench.world:dt(), 0, 0
  while resting < seconds and elapsed < REST_TIMEOUT_S do
    step(bench)
    elapsed = elapsed + dt
    resting = bench.body:speed() < speed and resting + dt or 0
  end
end

local function close_to(bench, width)
  local from = bench.width
  local count = math.max(1, math.ceil((from - width) / (2 * CLOSING) / bench.world:dt()))
  for k = 1, count do
    place(bench, from + (width - from) * k / count)
    step(bench)
  end
  rest(bench, REST_SPEED, REST_S)
end

local function measure(bench)
  local d = bench.body:deformation()
  local a, b = bench.pads[1].solid, bench.pads[2].solid
  return {
    width_mm = 1e3 * bench.width,
    depth_mm = 1e3 * (bench.nominal - bench.width),
    force_n = 0.5 * (bench.body:force(a) + bench.body:force(b)),
    d_pct = d.rms_pct,
    d_v1_pct = d.v1_rms_pct,
    max_pct = d.max_pct,
    strain_p95 = bench.body:strain_percentile(95),
    strain_p99 = bench.body:strain_percentile(99),
    slip_mm = math.max(bench.body:slip_mm(a), bench.body:slip_mm(b)),
    shear_n = math.max(bench.body:shear(a), bench.body:shear(b)),
  }
end

-- The row at which `key` reaches `value`, by linear interpolation; nil beyond the ends.
local function at(rows, key, value)
  for k = 2, #rows do
    local a, b = rows[k - 1], rows[k]
    if a[key] <= value and value <= b[key] then
      local row, share = {}, (value - a[key]) / (b[key] - a[key])
      for name, x in pairs(a) do
        row[name] = x + share * (b[name] - x)
      end
      return row
    end
  end
end

local function run(point)
  local bench = build(point)
  rest(bench, 1e-3, 0.5)
  bench.body:set_reference "now"
  local most = 0
  for _, share in ipairs(opt.share) do
    most = math.max(most, share)
  end
  local force, depth = bench.window.tight.force, 1e3 * (bench.nominal - bench.window.tight.width)
  local rows = { measure(bench) }
  repeat
    close_to(bench, bench.width - STEP)
    rows[#rows + 1] = measure(bench)
  until rows[#rows].force_n >= most * force and rows[#rows].depth_mm >= most * depth
  local found = {}
  for _, what in ipairs { { "force_n", force }, { "depth_mm", depth } } do
    for _, share in ipairs(opt.share) do
      local row = at(rows, what[1], share * what[2])
      if row then
        row.asset, row.turn, row.resolution, row.pads = point.asset, point.turn, point.resolution, point.pads
        row.equal, row.share = what[1], share
        found[#found + 1] = row
      end
    end
  end
  return found
end

return softvt.experiment {
  name = "turned_press",
  options = opt,
  points = function(o)
    local points = {}
    for _, asset in ipairs(o.asset) do
      for _, pads in ipairs(o.pads) do
        for _, resolution in ipairs(o.resolution) do
          for _, turn in ipairs(o.turn) do
            points[#points + 1] = { asset = asset, pads = pads, resolution = resolution, turn = turn }
          end
        end
      end
    end
    return points
  end,
  run = run,
  columns = {
    "asset",
    "pads",
    "resolution",
    "equal",
    "share",
    "turn",
    "force_n",
    "depth_mm",
    "d_pct",
    "d_v1_pct",
    "max_pct",
    "strain_p95",
    "strain_p99",
    "slip_mm",
    "shear_n",
  },
}
