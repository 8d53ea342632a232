-- Calibrated closures per asset: the smallest that holds, and the one at which D equals τ.
-- Written by scripts/calibrate.lua; experts close to a value in between.
return {
  braided_roll = { lower = 0.4800, at_tau = 0.6333 },
  capsule = { lower = 0.4800, at_tau = 0.7683 },
  croissant = { lower = 0.5400, at_tau = 0.7768 },
  cube = { lower = 0.3200, at_tau = 0.6820 },
  curved_layered = { lower = 0.3600, at_tau = 0.5880 },
  cylinder = { lower = 0.3600, at_tau = 0.7049 },
  golden_bun = { lower = 0.2600, at_tau = 0.6678 },
  long_roll = { lower = 0.4800, at_tau = 0.7587 },
  oval_loaf = { lower = 0.3000, at_tau = 0.6572 },
  sesame_bun = { lower = 0.2400, at_tau = 0.6575 },
  small_ridged_roll = { lower = 0.4800, at_tau = 0.7656 },
  sphere = { lower = 0.3000, at_tau = 0.7281 },
  spiral_roll = { lower = 0.4200, at_tau = 0.7468 },
  steamed_bun = { lower = 0.2600, at_tau = 0.6196 },
  twisted_stick = { lower = 0.6400, at_tau = 0.8339 },
  wedge = { lower = 0.4000, at_tau = 0.6272 },
  yellow_roll = { lower = 0.4000, at_tau = 0.7267 },
}
