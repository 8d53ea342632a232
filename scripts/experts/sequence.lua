-- Runs experts in turn, for tasks of several steps.
--
--   expert = sequence { drawer { joint = "cabinet.top_drawer" }, pick_place { object = "roll", target = "plate" } }

-- What is given in place of an expert: experts.pick_place itself makes them.
local function description(value)
  local meta = getmetatable(value)
  local name = type(meta) == "table" and rawget(meta, "__call") and rawget(meta, "__name")
  return name and ("%s, which makes one; call it: %s { … }"):format(name, name) or "a " .. type(value)
end

local function make(_, experts, surplus)
  if surplus ~= nil then error("sequence: expected one list of experts", 2) end
  if type(experts) ~= "table" or #experts == 0 then error("sequence: expected a list of experts", 2) end
  for k, expert in ipairs(experts) do
    if type(expert) ~= "function" then
      error(("sequence: [%d]: expected an expert, a function, got %s"):format(k, description(expert)), 2)
    end
  end
  local function run(arm, scene)
    for _, expert in ipairs(experts) do
      expert(arm, scene)
    end
  end
  return softvt.check_names("sequence", run, experts, {})
end

return setmetatable({}, { __name = "sequence", __call = make })
