-- Replaces what in Lua's base library would leak addresses, depend on hash order, or escape time limits. Runs once in
-- every new virtual machine, before any script, with the hooks of the host in `host`.
local host = ...
local raw_error, raw_tostring, raw_next, raw_format = error, tostring, next, string.format
local raw_setmetatable, getmetatable, type, rawget, select = setmetatable, getmetatable, type, rawget, select
local sort, pack, unpack, find, gsub, raw_pcall = table.sort, table.pack, table.unpack, string.find, string.gsub, pcall
local raw_resume, raw_close, raw_load = coroutine.resume, coroutine.close, load
local concat, byte = table.concat, string.byte

-- An address differs from run to run, so it never becomes text.
function tostring(...)
  if select("#", ...) == 0 then raw_error("bad argument #1 to 'tostring' (value expected)", 2) end
  local value = ...
  local kind = type(value)
  if kind == "table" or kind == "userdata" then
    local meta = getmetatable(value)
    if type(meta) == "table" and rawget(meta, "__tostring") == nil or meta == nil then return kind end
  elseif kind == "function" or kind == "thread" then
    return kind
  end
  return raw_tostring(value)
end
local tostring = tostring

function string.format(form, ...)
  if type(form) == "string" and find(form, "%%[-+ #0]*%d*%.?%d*p") then
    raw_error("string.format: %p prints an address, which differs from run to run; use %s with a name", 2)
  end
  local values = pack(...)
  for i = 1, values.n do
    local kind = type(values[i])
    if kind == "table" or kind == "function" or kind == "thread" or kind == "userdata" then
      values[i] = tostring(values[i])
    end
  end
  local ok, text = raw_pcall(raw_format, form, unpack(values, 1, values.n))
  if ok then return text end
  raw_error("string.format: " .. gsub(text, "^bad argument (#%d+) to '[^']*'", "argument %1"), 2)
end

-- Errors that are objects are described here, since Lua would later show their address alone.
function error(object, level)
  level = level or 1
  if type(object) ~= "string" then host.raised(object) end
  if level > 0 then level = level + 1 end
  raw_error(object, level)
end

-- Errors of the host are objects; scripts get their text, as of any other error.
local function with_error_text(ok, ...)
  if ok then return true, ... end
  return false, host.error_text((...))
end

function pcall(...) return with_error_text(raw_pcall(...)) end
function coroutine.resume(...) return with_error_text(raw_resume(...)) end
function coroutine.close(...) return with_error_text(raw_close(...)) end
local pcall = pcall

-- A handler that runs at the place of the error would run inside the hook that enforces the time limit, where no hook
-- stops it; this one runs after the stack has unwound.
function xpcall(f, handler, ...)
  local results = pack(pcall(f, ...))
  if results[1] then return unpack(results, 1, results.n) end
  local _, handled = pcall(handler, results[2])
  return false, handled
end

-- Text alone, since byte code can break the virtual machine; no hook stops the parser of a long one.
function load(chunk, name, _, env)
  local pieces, length = {}, 0
  local function add(piece)
    length = length + #piece
    if length > 1 << 20 then raw_error("load: the text is longer than 1 MiB; load it in parts", 3) end
    pieces[#pieces + 1] = piece
  end
  if type(chunk) == "function" then
    for piece in chunk do
      if type(piece) ~= "string" or piece == "" then break end
      add(piece)
    end
  elseif type(chunk) == "string" then
    add(chunk)
  else
    raw_error("load: expected a string or function, got " .. tostring(chunk), 2)
  end
  local text = concat(pieces)
  if byte(text) == 27 then return nil, "load: compiled byte code is refused; only Lua source text is run" end
  local made, message
  if env == nil then
    made, message = raw_load(text, name or "=(load)", "t")
  else
    made, message = raw_load(text, name or "=(load)", "t", env)
  end
  -- At too deep nesting a traceback follows.
  return made, message and (gsub(message, "\n.*", ""))
end

-- A finaliser runs where no time limit holds.
function setmetatable(object, meta)
  if type(meta) == "table" and rawget(meta, "__gc") ~= nil then
    raw_error("setmetatable: finalisers (__gc) are not available in a script", 2)
  end
  return raw_setmetatable(object, meta)
end

local rank = { number = 1, string = 2, boolean = 3 }
local function before(a, b)
  local kind_a, kind_b = type(a), type(b)
  if kind_a ~= kind_b then return rank[kind_a] < rank[kind_b] end
  if kind_a == "boolean" then return not a and b end
  return a < b
end

-- Keys in an order that does not depend on hashes: numbers, strings, booleans, then one other. Several others have
-- none: their hashes are addresses.
local function ordered_keys(object, name, level)
  local keys, rest, n, in_order = {}, nil, 0, true
  for key in raw_next, object do
    if rank[type(key)] then
      if n > 0 and in_order and not before(keys[n], key) then in_order = false end
      n = n + 1
      keys[n] = key
    elseif rest == nil then
      rest = key
    else
      local kinds = "neither numbers, strings nor booleans, and have no order"
      raw_error(raw_format("%s: several keys are %s; keep a list of them", name, kinds), level)
    end
  end
  if not in_order then sort(keys, before) end
  keys[n + 1] = rest
  return keys
end

local function iterate(object, name)
  local keys, i = ordered_keys(object, name, 4), 0
  return function()
    while true do
      i = i + 1
      local key = keys[i]
      if key == nil then return nil end
      local value = object[key]
      if value ~= nil then return key, value end
    end
  end
end

function pairs(object)
  local meta = getmetatable(object)
  local own = type(meta) == "table" and rawget(meta, "__pairs")
  if own then return own(object) end
  object = host.list("pairs", object)
  local each = iterate(object, "pairs")
  return each, object, nil
end

-- The iteration by `next` of each table: its keys in order, and the place of the last one that was returned.
local walks = raw_setmetatable({}, { __mode = "k" })

-- Lua's own goes by hashes, which differ from run to run.
function next(object, key)
  if type(object) ~= "table" then
    raw_error("bad argument #1 to 'next' (table expected, got " .. type(object) .. ")", 2)
  end
  local walk = walks[object]
  if key == nil or not walk or walk.keys[walk.at] ~= key then
    walk = { keys = ordered_keys(object, "next", 3), at = 0 }
    while key ~= nil and walk.keys[walk.at] ~= key do
      walk.at = walk.at + 1
      if walk.keys[walk.at] == nil then raw_error("next: the table has no such key", 2) end
    end
    walks[object] = walk
  end
  repeat
    walk.at = walk.at + 1
    key = walk.keys[walk.at]
  until key == nil or rawget(object, key) ~= nil
  if key == nil then return nil end
  return key, rawget(object, key)
end

host.sorted = function(object)
  object = host.list("softvt.sorted", object)
  local each = iterate(object, "softvt.sorted")
  return each
end

function math.randomseed()
  raw_error("math.randomseed: a script is seeded by the run (--seed), so that it can be repeated", 2)
end
