-- Closures that a calibration found, by asset: the smallest that holds, and the one that deforms by τ.
-- Written by scripts/calibrate.lua; the experts close in between.
return {
  braided_roll = { lower = 0.4600, at_tau = 0.5729 },
  capsule = { lower = 0.4800, at_tau = 0.7688 },
  croissant = { lower = 0.5400, at_tau = 0.7750 },
  cube = { lower = 0.3200, at_tau = 0.6820 },
  curved_layered = { lower = 0.3600, at_tau = 0.5880 },
  cylinder = { lower = 0.3600, at_tau = 0.7049 },
  golden_bun = { lower = 0.2600, at_tau = 0.6689 },
  long_roll = { lower = 0.4800, at_tau = 0.7629 },
  oval_loaf = { lower = 0.3000, at_tau = 0.6588 },
  sesame_bun = { lower = 0.2400, at_tau = 0.6775 },
  small_ridged_roll = { lower = 0.4800, at_tau = 0.7647 },
  sphere = { lower = 0.3000, at_tau = 0.7281 },
  spiral_roll = { lower = 0.4200, at_tau = 0.7468 },
  steamed_bun = { lower = 0.2600, at_tau = 0.6202 },
  twisted_stick = { lower = 0.6400, at_tau = 0.8418 },
  wedge = { lower = 0.3800, at_tau = 0.7165 },
  yellow_roll = { lower = 0.4000, at_tau = 0.7248 },
}
