-- Makes an object of each class, calls everything with everything, and returns the messages. surface.rs prepends the
-- names.
local errors = {}
local function note(what, ok, message)
  if not ok then errors[#errors + 1] = { what = what, message = tostring(message), kind = type(message) } end
end
local wrong = {
  "abc",
  "",
  "\255",
  {},
  { 1, 2 },
  { "a", "b", "c" },
  { 0 / 0, 0, 0 },
  { 1e308, 1e308, 1e308 },
  { x = 1 },
  { [1.5] = {} },
  true,
  1e308,
  -1e308,
  -1,
  0.5,
  0 / 0,
  1 / 0,
  2 ^ 53,
  math.mininteger,
  function() end,
  coroutine.create(print),
  softvt.pose { position = { 0, 0, 0 } },
  softvt.image { width = 1, height = 1, colour = { 0, 0, 0 } },
  setmetatable({}, { __index = function() error("trap") end, __len = function() return 1e9 end }),
}
local function call(what, f, ...)
  note(what .. "()", pcall(f, ...))
  for i, w in ipairs(wrong) do
    local name = what .. "(" .. i .. ")"
    if select("#", ...) > 0 then
      note(name, pcall(f, ..., w, w, w))
    else
      note(name, pcall(f, w, w, w))
    end
  end
end
local function all(class, object)
  for _, name in ipairs(NAMES[class].methods) do
    local method = object[name]
    local function with(...) return method(object, ...) end
    call(class .. ":" .. name, with)
    -- Without an object, or with one of another class.
    note(class .. "." .. name, pcall(method))
    for i, w in ipairs(wrong) do
      if not (class == "softvt.Image" or class == "softvt.Pose") then
        note(class .. "." .. name .. i, pcall(method, w))
      end
    end
  end
  for i, key in ipairs { "foo", "width_", "__index", 1, 1.5, true, {} } do
    local ok, message = pcall(function() return object[key] end)
    note(class .. "[" .. i .. "]", ok, message)
    assert(not ok, class .. " has an unknown field " .. tostring(key))
    ok, message = pcall(function() object[key] = 1 end)
    note(class .. "[" .. i .. "] =", ok, message)
    assert(not ok, class .. " takes an unknown field " .. tostring(key))
  end
  for _, name in ipairs(NAMES[class].fields) do
    note(class .. "." .. name, pcall(function() return object[name] end))
    for i, w in ipairs(wrong) do
      note(class .. "." .. name .. " = " .. i, pcall(function() object[name] = w end))
    end
    note(class .. "." .. name .. " = nil", pcall(function() object[name] = nil end))
  end
  note(class .. " arithmetic", pcall(function() return object + 1 end))
  note(class .. " call", pcall(function() return object() end))
  SEEN[#SEEN + 1] = class
end
local box = softvt.shape.box { size = { 0.04, 0.04, 0.04 } }
local floor = softvt.asset {
  name = "floor",
  body = softvt.static {},
  shape = softvt.shape.box { size = { 2, 2, 0.1 } }:translate(0, 0, -0.05),
}
local cube = softvt.asset {
  name = "cube",
  shape = box:grounded(),
  body = softvt.soft { youngs_pa = 2e4, poisson = 0.3, density = 300, resolution = 2 },
}
local layout = softvt.layout("one", function(scene, rng)
  scene:add { name = "floor", asset = floor, position = { 0, 0, 0 } }
  scene:add { name = "cube", asset = cube, at = { 0, 0 } }
  ATTACK(scene, rng)
end)
ATTACK = function() end
local function run()
  for _, name in ipairs(FUNCTIONS) do
    call("softvt." .. name, softvt[name])
  end
  for _, name in ipairs(SHAPES) do
    call("softvt.shape." .. name, softvt.shape[name])
  end
  for _, name in ipairs(MASKS) do
    call("softvt.mask." .. name, softvt.mask[name])
  end
  all("softvt.Shape", box)
  all("softvt.Mask", softvt.mask.weave { pitch_m = 1 })
  all("softvt.Pose", softvt.pose { position = { 0, 0, 0 } })
  all("softvt.Image", softvt.image { width = 4, height = 3, colour = { 0, 0, 0 } })
  local world = softvt.world {}
  local solid = world:kinematic { shape = box, position = { 1, 0, 0 } }
  local body = world:soft {
    shape = box,
    body = softvt.soft { youngs_pa = 1e4, poisson = 0.3, density = 300, resolution = 2 },
    position = { 0, 0, 0 },
  }
  all("softvt.Attachment", world:attach { body = body, region = box, to = solid })
  all("softvt.Solid", solid)
  all("softvt.Body", body)
  all("softvt.World", world)
  local simulation = softvt.simulate { layout = layout }
  ATTACK = function(scene, rng)
    all("softvt.Rng", rng)
    all("softvt.Light", scene.light)
    all("softvt.Material", scene.objects[2].materials[1])
    all("softvt.Camera", scene:camera "wrist")
    all("softvt.Object", scene:object "cube")
    all("softvt.Scene", scene)
    error("enough", 0)
  end
  note("enough", pcall(softvt.simulate, { layout = layout }))
  ATTACK = function() end
  -- An expert that gave up is not resumed: that has a test of its own.
  local methods = NAMES["softvt.Arm"].methods
  for i = #methods, 1, -1 do
    if methods[i] == "give_up" then table.remove(methods, i) end
  end
  simulation:drive(function(arm, view)
    all("softvt.Arm", arm)
    all("softvt.SceneState", view)
    all("softvt.ObjectState", view:object "cube")
    local touch = arm:tactile().left
    all("softvt.TactileFrame", touch)
    all("softvt.Markers", touch.markers)
  end)
  all("softvt.Simulation", simulation)
  errors[#errors + 1] = { what = "seen", message = table.concat(SEEN, " "), kind = "string" }
  return errors
end
SEEN = {}
return softvt.experiment { name = "e", grid = { a = { 1 } }, run = run }
