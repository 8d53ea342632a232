-- Closures that a calibration found, by asset: the smallest that holds, and the one that deforms by τ.
-- Written by scripts/calibrate.lua; the experts close in between.
return {
  braided_roll = { lower = 0.4600, at_tau = 0.5729 },
  sesame_bun = { lower = 0.2400, at_tau = 0.6775 },
  small_ridged_roll = { lower = 0.4800, at_tau = 0.7647 },
  spiral_roll = { lower = 0.4200, at_tau = 0.7468 },
  steamed_bun = { lower = 0.2600, at_tau = 0.6202 },
}
