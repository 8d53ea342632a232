-- Calibrated windows per asset: widths between the gels (m) at first contact, at the loose end and at τ, the forces per pad (N) at
-- the two ends, and the share of τ that the object reaches by bending while it is carried. Written by scripts/calibrate.lua; experts
-- grasp at a width in between.
return {
  braided_roll = { width_contact = 0.047042, width_lower = 0.046060, width_at_tau = 0.043386, force_lower = 0.32740, force_at_tau = 1.53488, bending = 0.4572 },
  capsule = { width_contact = 0.043950, width_lower = 0.043510, width_at_tau = 0.041635, force_lower = 0.09205, force_at_tau = 0.77051, bending = 0.4397 },
  croissant = { width_contact = 0.038696, width_lower = 0.038680, width_at_tau = 0.036350, force_lower = 0.06719, force_at_tau = 2.12780, bending = 0.2531 },
  cube = { width_contact = 0.056000, width_lower = 0.055470, width_at_tau = 0.053765, force_lower = 0.16005, force_at_tau = 1.34730, bending = 0.2799 },
  curved_layered = { width_contact = 0.053957, width_lower = 0.053670, width_at_tau = 0.051272, force_lower = 0.24085, force_at_tau = 3.08786, bending = 0.3528 },
  cylinder = { width_contact = 0.053000, width_lower = 0.052530, width_at_tau = 0.050781, force_lower = 0.11722, force_at_tau = 1.05600, bending = 0.2921 },
  golden_bun = { width_contact = 0.059900, width_lower = 0.059590, width_at_tau = 0.055761, force_lower = 0.16187, force_at_tau = 5.14009, bending = 0.1090 },
  long_roll = { width_contact = 0.043950, width_lower = 0.043360, width_at_tau = 0.041917, force_lower = 0.12093, force_at_tau = 0.65541, bending = 0.9375 },
  oval_loaf = { width_contact = 0.058900, width_lower = 0.058470, width_at_tau = 0.053397, force_lower = 0.20354, force_at_tau = 6.46341, bending = 0.1262 },
  sesame_bun = { width_contact = 0.061900, width_lower = 0.061260, width_at_tau = 0.057714, force_lower = 0.10022, force_at_tau = 1.21270, bending = 0.2987 },
  small_ridged_roll = { width_contact = 0.043850, width_lower = 0.043400, width_at_tau = 0.039772, force_lower = 0.07885, force_at_tau = 2.19098, bending = 0.1522 },
  sphere = { width_contact = 0.056950, width_lower = 0.056460, width_at_tau = 0.053288, force_lower = 0.08856, force_at_tau = 1.47186, bending = 0.2014 },
  spiral_roll = { width_contact = 0.046726, width_lower = 0.046530, width_at_tau = 0.044218, force_lower = 0.09043, force_at_tau = 1.85897, bending = 0.1427 },
  steamed_bun = { width_contact = 0.061950, width_lower = 0.061110, width_at_tau = 0.057440, force_lower = 0.08485, force_at_tau = 0.79782, bending = 0.3758 },
  twisted_stick = { width_contact = 0.030800, width_lower = 0.030310, width_at_tau = 0.027751, force_lower = 0.07220, force_at_tau = 1.03088, bending = 2.6904 },
  wedge = { width_contact = 0.049950, width_lower = 0.049650, width_at_tau = 0.048356, force_lower = 0.12227, force_at_tau = 0.90918, bending = 0.3831 },
  yellow_roll = { width_contact = 0.049950, width_lower = 0.049470, width_at_tau = 0.047520, force_lower = 0.13626, force_at_tau = 1.16328, bending = 0.3990 },
}
