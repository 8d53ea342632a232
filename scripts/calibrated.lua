-- Calibrated windows per asset: widths between the gels (m) at first contact, at the loose end and at τ, the forces per pad (N) at
-- the two ends, and the share of τ that the object reaches by bending while it is carried. Written by scripts/calibrate.lua; experts
-- grasp at a width in between.
return {
  braided_roll = { width_contact = 0.047042, width_lower = 0.045860, width_at_tau = 0.043360, force_lower = 0.40026, force_at_tau = 1.54921, bending = 0.4740 },
  capsule = { width_contact = 0.043500, width_lower = 0.043320, width_at_tau = 0.041711, force_lower = 0.14956, force_at_tau = 0.74040, bending = 0.5000 },
  croissant = { width_contact = 0.038500, width_lower = 0.038470, width_at_tau = 0.036351, force_lower = 0.17847, force_at_tau = 2.12477, bending = 0.2670 },
  cube = { width_contact = 0.056000, width_lower = 0.055410, width_at_tau = 0.053765, force_lower = 0.19311, force_at_tau = 1.34730, bending = 0.3027 },
  curved_layered = { width_contact = 0.054000, width_lower = 0.053500, width_at_tau = 0.051331, force_lower = 0.30550, force_at_tau = 2.99027, bending = 0.3725 },
  cylinder = { width_contact = 0.053000, width_lower = 0.052500, width_at_tau = 0.050781, force_lower = 0.12461, force_at_tau = 1.05608, bending = 0.2941 },
  golden_bun = { width_contact = 0.059500, width_lower = 0.059480, width_at_tau = 0.055760, force_lower = 0.22220, force_at_tau = 5.14165, bending = 0.1135 },
  long_roll = { width_contact = 0.043950, width_lower = 0.043120, width_at_tau = 0.041909, force_lower = 0.19287, force_at_tau = 0.65864, bending = 0.9345 },
  oval_loaf = { width_contact = 0.058500, width_lower = 0.058420, width_at_tau = 0.053393, force_lower = 0.23418, force_at_tau = 6.46915, bending = 0.1271 },
  sesame_bun = { width_contact = 0.061900, width_lower = 0.061210, width_at_tau = 0.057714, force_lower = 0.10989, force_at_tau = 1.21270, bending = 0.2996 },
  small_ridged_roll = { width_contact = 0.043850, width_lower = 0.043370, width_at_tau = 0.039766, force_lower = 0.08550, force_at_tau = 2.19769, bending = 0.1530 },
  sphere = { width_contact = 0.056500, width_lower = 0.056400, width_at_tau = 0.053290, force_lower = 0.10301, force_at_tau = 1.47089, bending = 0.2318 },
  spiral_roll = { width_contact = 0.046726, width_lower = 0.046410, width_at_tau = 0.044218, force_lower = 0.15638, force_at_tau = 1.85903, bending = 0.1764 },
  steamed_bun = { width_contact = 0.061950, width_lower = 0.061020, width_at_tau = 0.057440, force_lower = 0.09549, force_at_tau = 0.79782, bending = 0.3777 },
  twisted_stick = { width_contact = 0.030800, width_lower = 0.030260, width_at_tau = 0.027751, force_lower = 0.08163, force_at_tau = 1.03088, bending = 2.7104 },
  wedge = { width_contact = 0.049500, width_lower = 0.049460, width_at_tau = 0.048395, force_lower = 0.20043, force_at_tau = 0.87729, bending = 0.4593 },
  yellow_roll = { width_contact = 0.049500, width_lower = 0.049280, width_at_tau = 0.047520, force_lower = 0.21889, force_at_tau = 1.16329, bending = 0.4222 },
}
