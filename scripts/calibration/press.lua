-- A press test of one soft object on the table: two gel pads of the robot on rigid carriers grip it where and along the
-- axis that the expert does. The width between the gels is prescribed and the force is not limited, so that no setting
-- of the robot matters.
local grasp = require "experts.grasp"
local table_top = require "assets.table"
local trial = require "calibration.trial"

local press = {}

local CLEARANCE = 4e-3 -- gap between each gel and the object at the start, m
local CONTACT_STEP = 5e-5 -- step of the width until both pads touch, at rest too, m
local CLOSING = 0.02 -- speed at which each pad closes in the sweep, m/s
local GRASPING = 0.024 -- speed at which each pad closes in a hold trial, as the expert, m/s
local REST_SPEED, REST_S = 5e-4, 0.3 -- largest node speed of an object at rest, and for how long, m/s and s
local REST_TIMEOUT_S = 3 -- longest wait for rest, s
local SETTLE_SPEED, SETTLE_S = 1e-3, 0.5 -- the same for the object alone on the table
local PERCENTILE = 95 -- share of the volume that stays below the reported strain, %
local STRAIN_LENGTH = 4e-3 -- length over which a strain is averaged, several cells of a crumb, m
local FINE = 18 -- least resolution of the mesh on which strains are found
local FINE_STEP, FINE_CONTACT_STEP = 1e-3, 2.5e-4 -- steps of the width there, m
local UNSTABLE = 20 -- rows before the first stable one that end a sweep
local HOLD_S = 1 -- hold after the lift, s
local REFINEMENTS = 2 -- hold trials near τ, for the tight end

-- Grasps of the hold trials: in the middle, and displaced along both diagonals.
local OFFSETS = { { 0, 0 } }
for _, x in ipairs { 1, -1 } do
  for _, y in ipairs { 1, -1 } do
    OFFSETS[#OFFSETS + 1] = { x * trial.DISPLACEMENT, y * trial.DISPLACEMENT }
  end
end

-- Widths are multiples of 10 µm, so that they have few digits.
local function rounded(width) return math.floor(1e5 * width + 0.5) / 1e5 end
local function in_mm(width) return math.floor(1e5 * width + 0.5) / 100 end

-- The asset at another size, resolution, stiffness, density or stable strain: { shape, body, friction, object }.
-- `object` is what experts see of it.
local function instance(asset, change)
  local scale, from = change.scale or 1, asset.body
  local shape = scale == 1 and asset.shape or asset.shape:scale(scale, scale, scale)
  local low, high = shape:bounds()
  local hints = grasp.scaled_hints(asset.hints or {}, scale)
  local size = { high[1] - low[1], high[2] - low[2], high[3] - low[3] }
  local youngs, density, strain = change.youngs_factor or 1, change.density_factor or 1, change.strain_factor or 1
  local function changed(value) return value and strain * value end
  return {
    shape = shape,
    friction = asset.friction,
    body = softvt.soft {
      youngs_pa = youngs * from.youngs_pa,
      poisson = from.poisson,
      loss_factor = from.loss_factor,
      density = density * from.density,
      grasp_spacing = scale * from.grasp_spacing,
      resolution = change.resolution or from.resolution,
      collapse_strain = changed(from.collapse_strain),
      damage_strain = changed(from.damage_strain),
    },
    -- Centred above the origin, on the table.
    position = { -0.5 * (low[1] + high[1]), -0.5 * (low[2] + high[2]), -low[3] },
    object = {
      name = asset.name,
      asset = asset.name,
      size = size,
      centre = { 0, 0, size[3] / 2 },
      yaw = 0,
      hints = hints,
      scale = scale,
    },
  }
end

-- A world in which bodies stay awake, with the top of the table at z = 0.
function press.world()
  local world = softvt.world { sleeping = false }
  world:static {
    name = "table",
    shape = softvt.shape.box { size = { 1, 1, 0.1 } },
    friction = table_top.friction,
    position = { 0, 0, -0.05 },
  }
  return world
end

local Bench = {}
Bench.__index = Bench

-- Sets where the pads are after the next step: `width` apart and `rise` above the grasp, m.
function Bench:place(width, rise)
  self.width, self.rise = width, rise
  for _, pad in ipairs(self.pads) do
    pad.solid:move_to(self:pad_position(pad.side), { 0, 0, pad.facing })
  end
end

function Bench:pad_position(side)
  local reach = side * self.width / 2
  return { self.at[1] + reach * self.axis[1], self.at[2] + reach * self.axis[2], self.at[3] + self.rise }
end

-- Makes one step. Returns false once the physics has failed; `problem` then says why.
function Bench:step()
  local ok
  ok, self.problem = self.world:step()
  if ok then
    self.min_det_f = math.min(self.min_det_f, self.body:min_det_f() or 1)
    self.d_peak_pct = self.d_peak_pct and math.max(self.d_peak_pct, self.body:deformation().rms_pct)
  end
  return ok
end

-- Closes to `width`, each pad at `speed`.
function Bench:close_to(width, speed)
  local from = self.width
  local count = math.max(1, math.ceil((from - width) / (2 * speed) / self.dt))
  for k = 1, count do
    self:place(from + (width - from) * k / count, self.rise)
    if not self:step() then return false end
  end
  return true
end

-- Waits until no node has been faster than `speed` for `seconds`. Returns the largest node speed in that time (or in
-- the last `seconds` before the timeout) and whether it rests, or nil if the physics failed.
function Bench:rest(speed, seconds)
  local elapsed, resting, fastest = 0, 0, 0
  while resting < seconds - 1e-9 and elapsed < REST_TIMEOUT_S do
    if not self:step() then return nil end
    local now = self.body:speed()
    elapsed = elapsed + self.dt
    if now >= speed then
      resting, fastest = 0, elapsed > REST_TIMEOUT_S - seconds and math.max(fastest, now) or 0
    else
      resting, fastest = resting + self.dt, math.max(fastest, now)
    end
  end
  return fastest, resting >= seconds - 1e-9
end

function Bench:force(index) return self.body:force(self.pads[index].solid) end

function Bench:slip_mm() return math.max(self.body:slip_mm(self.pads[1].solid), self.body:slip_mm(self.pads[2].solid)) end

function Bench:both_touch() return math.min(self:force(1), self:force(2)) > trial.CONTACT_N end

-- A settled object between open pads, displaced by `offset` (m) from the expert's grasp. Returns the bench, or nil and
-- the reason why the object cannot be pressed; then the stable strain of its material. `change` has the optional fields
-- scale, resolution, youngs_factor, density_factor and strain_factor.
function press.bench(asset, change, offset)
  local made = instance(asset, change or {})
  local world = press.world()
  local body = world:soft {
    name = asset.name,
    shape = made.shape,
    body = made.body,
    friction = made.friction,
    position = made.position,
  }
  local bench = setmetatable({ world = world, dt = world:dt(), min_det_f = math.huge, pads = {}, body = body }, Bench)
  local stable_strain = body:stable_strain()
  local _, rests = bench:rest(SETTLE_SPEED, SETTLE_S)
  if not rests then
    return nil, "it does not come to rest" .. (bench.problem and ": " .. bench.problem or ""), stable_strain
  end
  -- One that has tilted or fallen over is pressed as it lies.
  local object, lying = made.object, body:lying()
  if lying then
    object.size, object.centre, object.yaw, bench.tilt = lying.size, lying.centre, lying.yaw, lying.tilt
  end
  local problem = grasp.problem(object)
  if problem then return nil, "it " .. problem, stable_strain end
  local yaw = grasp.hand_yaw(object)
  bench.object, bench.axis = object, { -math.sin(yaw), math.cos(yaw) }
  bench.at = grasp.pose(object, grasp.height(object), offset).position
  bench.width, bench.rise = grasp.width(object) + 2 * CLEARANCE, 0
  for index, side in ipairs { -1, 1 } do
    local facing = yaw - side * math.pi / 2
    local solid = world:gel_pad { position = bench:pad_position(side), axis_angle = { 0, 0, facing } }
    bench.pads[index] = { side = side, facing = facing, solid = solid }
  end
  bench.body:set_reference "now"
  return bench, nil, stable_strain
end

-- One row of the sweep: closes to `width` (m) and waits for rest. Returns nil if the physics failed.
local function squeeze(bench, width)
  local fastest = bench:close_to(width, CLOSING) and bench:rest(REST_SPEED, REST_S)
  if not fastest then return nil end
  local d = bench.body:deformation()
  local row = {
    width_mm = in_mm(width),
    d_pct = d.rms_pct,
    d_v1_pct = d.v1_rms_pct,
    force_n = 0.5 * (bench:force(1) + bench:force(2)),
    min_det_f = bench.min_det_f,
    node_speed_m_s = fastest,
    both_pads = bench:both_touch(),
    slip_mm = bench:slip_mm(),
    stable = false,
  }
  row.stable = softvt.stable(row)
  return row
end

-- Closes in steps of `step` (m) until both pads touch. Returns the width, or nil and why there is no contact.
local function find_contact(bench, step)
  while not bench:both_touch() do
    if bench.width <= step then return nil, "the pads have met" end
    if not bench:close_to(rounded(bench.width - step), CLOSING) then return nil, bench.problem end
  end
  return bench.width
end

-- Presses from first contact, sought in steps of `contact_step` (m), inward in steps of `step` (m) until `is_last(row)`
-- or the press is no longer stable. Returns the rows, and why the press ended if they do not tell.
local function press_in(bench, contact_step, step, is_last)
  local rows, index = {}, nil
  local width, ended = find_contact(bench, contact_step)
  while width and width > 0 do
    local row = squeeze(bench, width)
    if not row then return rows, bench.problem end
    rows[#rows + 1] = row
    if not row.stable and (index or #rows >= UNSTABLE) then return rows end
    if is_last(row) then return rows end
    -- Once both pads touch at rest, widths are multiples of the step.
    if index or row.stable then index = (index or math.ceil(width / step - 1e-6)) - 1 end
    width = rounded(index and index * step or width - contact_step)
  end
  return rows, ended or "the pads have met"
end

-- Resolution at which voxels are no larger than STRAIN_LENGTH, so that strains and forces have converged.
function press.fine_resolution(asset, change)
  local low, high = asset.shape:bounds()
  local longest = math.max(high[1] - low[1], high[2] - low[2], high[3] - low[3])
  local needed = math.ceil((change and change.scale or 1) * longest / STRAIN_LENGTH)
  return math.max(FINE, needed, asset.body.resolution)
end

-- Strain over D of a press on a fine mesh, up to the stable strain: a list of { d_pct, strain }, whose field `ended`
-- says why it ended before, if it did. The strain is the 95th percentile of the volume, each point's averaged over
-- STRAIN_LENGTH. nil if the material has no stable strain. It hardly depends on the stiffness: from 0.3 to 30 times
-- that of the cube, D at the stable strain changes by 0.9 %.
function press.strains(asset, change)
  change = change or {}
  local resolution = change.fine or press.fine_resolution(asset, change)
  local fine = setmetatable({ resolution = resolution }, { __index = change })
  local bench, problem, stable_strain = press.bench(asset, fine)
  if not stable_strain then return nil end
  if not bench then return { ended = problem } end
  local function strain() return bench.body:strain_percentile(PERCENTILE, STRAIN_LENGTH) end
  -- The weight alone strains the body.
  local found = { { d_pct = 0, strain = strain() } }
  if found[1].strain >= stable_strain then return { found[1], { d_pct = 1, strain = found[1].strain } } end
  local _, ended = press_in(bench, FINE_CONTACT_STEP, FINE_STEP, function(row)
    local last = found[#found]
    if row.stable and row.d_pct > last.d_pct then
      last = { d_pct = row.d_pct, strain = strain() }
      found[#found + 1] = last
    end
    return last.strain >= stable_strain
  end)
  if found[#found].strain < stable_strain then found.ended = ended or "the press on a fine mesh is no longer stable" end
  return found
end

-- The strain at `d_pct` in a list of `strains`, along its last two beyond them.
local function strain_at(list, d_pct)
  local k = 2
  while k < #list and list[k].d_pct < d_pct do
    k = k + 1
  end
  local low, high = list[k - 1], list[k]
  return low.strain + (d_pct - low.d_pct) / (high.d_pct - low.d_pct) * (high.strain - low.strain)
end

-- Presses in steps of `step` (m) until 5 % of the volume has passed the stable strain, or the press is no longer
-- stable. Returns { rows, stable_strain, ended, tilt_deg }: `ended` says why the sweep ended if the rows do not tell,
-- `tilt_deg` by how much the object has tilted while it settled, if it has. Widths, forces and D are those on the mesh
-- of episodes. The strain of a row is that of a fine mesh (of resolution `change.fine`) at the same D, as it converges
-- far later: that of `strains`, which are found if they are not given.
function press.sweep(asset, step, change, strains)
  change = change or {}
  local bench, problem, stable_strain = press.bench(asset, change)
  if not bench then return { rows = {}, stable_strain = stable_strain, ended = problem } end
  local known = stable_strain and (strains or press.strains(asset, change))
  local rows, ended = {}, nil
  if not known or #known > 1 then
    rows, ended = press_in(bench, CONTACT_STEP, step, function(row)
      row.strain_p95 = known and strain_at(known, row.d_pct) or bench.body:strain_percentile(PERCENTILE)
      return known and (row.strain_p95 >= stable_strain or known.ended and row.d_pct >= known[#known].d_pct)
    end)
  end
  return {
    rows = rows,
    stable_strain = stable_strain,
    ended = ended or known and known.ended,
    tilt_deg = bench.tilt and math.deg(bench.tilt),
  }
end

-- The envelope of a sweep without hold trials, and the sweep. Parameters are those of press.sweep.
function press.envelope(asset, step, change)
  local sweep = press.sweep(asset, step, change)
  local envelope = softvt.envelope {
    asset = asset.name,
    stable_strain = sweep.stable_strain,
    ended = sweep.ended,
    sweep = sweep.rows,
    holds = {},
  }
  return envelope, sweep
end

-- Minimum-jerk time scaling on [0, 1] (Flash and Hogan, 1985), and its largest slope.
local function smooth(u) return u * u * u * (10 + u * (6 * u - 15)) end
local PEAK = 1.875

-- A trial at `width` (m): grasps as fast as the expert does, lifts and holds. Returns whether it held, the slip on the
-- pads (mm) and the peak D (%).
local function hold(asset, width, offset, change)
  local bench, problem = press.bench(asset, change, offset)
  if not bench then error(("press: %s: %s"):format(asset.name, problem), 0) end
  bench.d_peak_pct = 0
  local ok = bench:close_to(width, GRASPING) and bench:rest(REST_SPEED, REST_S)
  local before, slid = bench.body:centre()[3], bench:slip_mm()
  local count = math.ceil(PEAK * trial.LIFT / (trial.SPEED * grasp.carry_pace(bench.object)) / bench.dt)
  for k = 1, count + math.ceil(HOLD_S / bench.dt) do
    if not ok then break end
    bench:place(width, trial.LIFT * smooth(math.min(1, k / count)))
    -- An object that the pads have lost is not waited for.
    ok = bench:step() and bench:both_touch()
  end
  local fallen_mm, slip_mm = 1e3 * (bench.rise - (bench.body:centre()[3] - before)), bench:slip_mm() - slid
  -- An object that the pads have lost has slipped by as much as it has stayed behind.
  if not ok or fallen_mm > 0.5e3 * trial.LIFT then return false, math.max(slip_mm, fallen_mm), bench.d_peak_pct end
  return slip_mm <= trial.SLIP_MM, slip_mm, bench.d_peak_pct
end

-- Hold trials at `width` (m), until one fails.
local function holds_at(asset, width, change)
  local row = { width_mm = in_mm(width), trials = 0, held = 0, slip_mm = 0, d_peak_pct = 0 }
  for _, offset in ipairs(OFFSETS) do
    local held, slip_mm, d_peak_pct = hold(asset, width, offset, change)
    row.trials, row.slip_mm = row.trials + 1, math.max(row.slip_mm, slip_mm)
    row.d_peak_pct = math.max(row.d_peak_pct, d_peak_pct)
    if not held then break end
    row.held = row.held + 1
  end
  return row
end

-- Finds the widest width between `narrow` and `wide` (m) at which all trials hold, by bisection to `within` (m). If
-- they do not hold at `narrow`, it looks down to `narrowest`. Returns the rows of all widths tried.
function press.loose_end(asset, narrow, wide, narrowest, within, change)
  local rows = {}
  local function all_hold(width)
    local row = holds_at(asset, width, change)
    rows[#rows + 1] = row
    return row.held == row.trials
  end
  if not all_hold(narrow) then
    wide, narrow = narrow, narrowest
    if not all_hold(narrow) then return rows end
  end
  while wide - narrow > within do
    local middle = rounded(0.5 * (wide + narrow))
    if middle == wide or middle == narrow then break end
    if all_hold(middle) then
      narrow = middle
    else
      wide = middle
    end
  end
  return rows
end

-- Finds where the peak D of hold trials passes `tau_pct`, by linear interpolation between the two nearest widths in
-- `rows`, which are those of loose_end. Appends the trials made on the way.
function press.carried_end(asset, rows, tau_pct, change)
  for _ = 1, REFINEMENTS do
    local below, above
    for _, row in ipairs(rows) do
      if row.held == row.trials then
        if row.d_peak_pct <= tau_pct and (not below or row.width_mm < below.width_mm) then below = row end
        if row.d_peak_pct > tau_pct and (not above or row.width_mm > above.width_mm) then above = row end
      end
    end
    -- The press alone decides if no trial passes τ; the window is empty if all do.
    if not (below and above) then return end
    local share = (tau_pct - below.d_peak_pct) / (above.d_peak_pct - below.d_peak_pct)
    local width = rounded(1e-3 * (below.width_mm + share * (above.width_mm - below.width_mm)))
    if width == rounded(1e-3 * below.width_mm) or width == rounded(1e-3 * above.width_mm) then return end
    rows[#rows + 1] = holds_at(asset, width, change)
  end
end

return press
