-- Runs experts in turn, for tasks of several steps.
--
--   expert = sequence { drawer { joint = "cabinet.top_drawer" }, pick_place { object = "roll", target = "plate" } }
return function(experts)
  if type(experts) ~= "table" or #experts == 0 then error("sequence: expected a list of experts", 2) end
  for k, expert in ipairs(experts) do
    if type(expert) ~= "function" then
      error(("sequence: [%d]: expected an expert, a function, got a %s"):format(k, type(expert)), 2)
    end
  end
  return function(arm, scene)
    for _, expert in ipairs(experts) do
      expert(arm, scene)
    end
  end
end
