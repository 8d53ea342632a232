-- Household: tasks of two to four steps with soft and rigid things on a kitchen table.
local drawer, knob = require "experts.drawer", require "experts.knob"
local layouts = require "layouts.household"
local pick_place = require "experts.pick_place"
local push = require "experts.push"
local sequence = require "experts.sequence"
local shifts = require "shifts"

local tasks = {
  softvt.task {
    prompt = "open the top drawer of the cabinet, put the ridged roll in it and close it",
    layout = layouts.cabinet("drawer", 0, {
      { "roll", "small_ridged_roll", -200, 80 },
      { "plate", "plate", 60, 210 },
      { "bun", "golden_bun", -90, 230 },
    }),
    goal = softvt.sequence {
      softvt.opened { joint = "cabinet.top_drawer", share = 0.7 },
      softvt.all {
        softvt.inside { object = "roll", target = "cabinet.top_drawer" },
        softvt.closed { joint = "cabinet.top_drawer", share = 0.1 },
      },
    },
    expert = sequence {
      drawer { joint = "cabinet.top_drawer" },
      pick_place { object = "roll", target = "cabinet.top_drawer" },
      drawer { joint = "cabinet.top_drawer", close = true },
    },
    budget_steps = 1300,
  },
  softvt.task {
    prompt = "close the top drawer of the cabinet and put the sesame bun on top of the cabinet",
    layout = layouts.cabinet("top", 0.12, {
      { "bun", "sesame_bun", -200, 100 },
      { "plate", "plate", 60, 210 },
      { "roll", "small_ridged_roll", -90, 230 },
    }),
    goal = softvt.all {
      softvt.closed { joint = "cabinet.top_drawer", share = 0.1 },
      softvt.on { object = "bun", target = "cabinet" },
    },
    expert = sequence {
      drawer { joint = "cabinet.top_drawer", close = true },
      pick_place { object = "bun", target = "cabinet" },
    },
    budget_steps = 900,
  },
  softvt.task {
    prompt = "take the capsule out of the top drawer, put it on the plate and close the drawer",
    layout = layouts.cabinet("take", 0.14, {
      { "plate", "plate", 60, 210 },
      { "bun", "golden_bun", -200, 100 },
      { "capsule", "capsule", 0, -155, yaw = math.pi / 2, on = "cabinet.top_drawer" },
    }),
    goal = softvt.all {
      softvt.on { object = "capsule", target = "plate" },
      softvt.closed { joint = "cabinet.top_drawer", share = 0.1 },
    },
    expert = sequence {
      pick_place { object = "capsule", target = "plate" },
      drawer { joint = "cabinet.top_drawer", close = true },
    },
    budget_steps = 900,
  },
  softvt.task {
    prompt = "push the ramekin next to the plate and put the steamed bun on the plate",
    layout = layouts.cabinet("ramekin", 0, {
      { "plate", "plate", 90, 170 },
      { "ramekin", "ramekin", -190, 40 },
      { "bun", "steamed_bun", -120, 260 },
    }),
    goal = softvt.all {
      softvt.near { object = "ramekin", target = "plate", distance = 0.15 },
      softvt.on { object = "bun", target = "plate" },
    },
    object = "bun",
    expert = sequence {
      push { object = "ramekin", target = "plate", distance = 0.135 },
      pick_place { object = "bun", target = "plate" },
    },
    budget_steps = 900,
  },
  softvt.task {
    prompt = "put the golden bun to the left of the plate, as the robot sees it, then the croissant on the plate",
    layout = layouts.cabinet("left", 0, {
      { "plate", "plate", 60, 120 },
      { "bun", "golden_bun", -160, -20 },
      { "croissant", "croissant", -170, 170 },
    }),
    goal = softvt.sequence {
      softvt.left_of { object = "bun", target = "plate" },
      softvt.all {
        softvt.left_of { object = "bun", target = "plate" },
        softvt.on { object = "croissant", target = "plate" },
      },
    },
    expert = sequence {
      pick_place { object = "bun", target = "plate", to = "left_of", distance = 0.14 },
      pick_place { object = "croissant", target = "plate" },
    },
    budget_steps = 900,
  },
  softvt.task {
    prompt = "put the spiral roll on the plate and turn the stove on",
    layout = layouts.stove("on", 0, {
      { "plate", "plate", 80, 180 },
      { "roll", "spiral_roll", 60, -100 },
      { "butter", "butter", -120, 230 },
    }),
    goal = softvt.all {
      softvt.on { object = "roll", target = "plate" },
      softvt.turned { joint = "stove.knob", range = { 0.5, 4.72 } },
    },
    expert = sequence {
      pick_place { object = "roll", target = "plate" },
      knob { joint = "stove.knob", angle = 0.64 },
    },
    budget_steps = 1000,
  },
  softvt.task {
    prompt = "stack the butter on the cookies and the ridged roll on the butter",
    layout = layouts.stove("stack", 0, {
      { "cookies", "cookies", 60, 150 },
      { "butter", "butter", -60, 20 },
      { "roll", "small_ridged_roll", 110, -70 },
    }),
    goal = softvt.stacked { objects = { "cookies", "butter", "roll" } },
    object = "roll",
    expert = sequence {
      pick_place { object = "butter", target = "cookies" },
      pick_place { object = "roll", target = "butter" },
    },
    budget_steps = 900,
  },
  softvt.task {
    prompt = "put the butter and the yellow roll into the basket",
    layout = layouts.stove("basket", 0, {
      { "basket", "basket", 60, 230 },
      { "butter", "butter", -90, 0 },
      { "roll", "yellow_roll", 90, -70 },
    }),
    goal = softvt.all {
      softvt.inside { object = "butter", target = "basket" },
      softvt.inside { object = "roll", target = "basket" },
    },
    object = "roll",
    expert = sequence {
      pick_place { object = "butter", target = "basket" },
      pick_place { object = "roll", target = "basket" },
    },
    budget_steps = 900,
  },
  softvt.task {
    prompt = "clear the plate: put the loaf that lies on it into the basket, and turn the stove off",
    layout = layouts.stove("clear", 0.62, {
      { "basket", "basket", 60, 230 },
      { "plate", "plate", 60, -60 },
      { "loaf", "oval_loaf", 0, 0, on = "plate" },
      { "roll", "small_ridged_roll", -130, 60 },
    }),
    goal = softvt.all {
      softvt.none { softvt.on { object = "loaf", target = "plate" }, softvt.on { object = "roll", target = "plate" } },
      softvt.inside { object = "loaf", target = "basket" },
      softvt.turned { joint = "stove.knob", range = { -0.01, 0.15 } },
    },
    expert = sequence {
      pick_place { object = "loaf", target = "basket" },
      knob { joint = "stove.knob", angle = 0.04 },
    },
    budget_steps = 1000,
  },
  softvt.task {
    prompt = "push the cookies behind the plate, and put the cylinder on the plate or on the cookies",
    layout = layouts.stove("behind", 0, {
      { "plate", "plate", -60, 150 },
      { "cookies", "cookies", 50, 0 },
      { "cylinder", "cylinder", -180, 20 },
    }),
    goal = softvt.all {
      softvt.behind { object = "cookies", target = "plate" },
      softvt.any {
        softvt.on { object = "cylinder", target = "plate" },
        softvt.on { object = "cylinder", target = "cookies" },
      },
    },
    object = "cylinder",
    expert = sequence {
      push { object = "cookies", target = "plate", to = "behind" },
      pick_place { object = "cylinder", target = "plate" },
    },
    budget_steps = 900,
  },
}

return softvt.suite {
  name = "household",
  object_type = "deformable",
  tasks_differ_in = "object",
  needs = "nothing",
  episodes = 5,
  tasks = tasks,
  shifts = shifts.soft,
}
