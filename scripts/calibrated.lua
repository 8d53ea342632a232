-- Calibrated windows per asset: widths between the gels (m) at first contact, at the loose end and at τ, the forces per pad (N) at
-- the two ends, and the smallest D of the carried object as a share of τ. Written by scripts/calibrate.lua; experts grasp at a width
-- in between.
return {
  braided_roll = { width_contact = 0.047040, width_lower = 0.046040, width_at_tau = 0.043400, force_lower = 0.33762, force_at_tau = 1.52885, carried = 0.4609 },
  capsule = { width_contact = 0.043950, width_lower = 0.043510, width_at_tau = 0.041635, force_lower = 0.09205, force_at_tau = 0.77051, carried = 0.4398 },
  croissant = { width_contact = 0.038700, width_lower = 0.038690, width_at_tau = 0.036350, force_lower = 0.06278, force_at_tau = 2.12776, carried = 0.2525 },
  cube = { width_contact = 0.056000, width_lower = 0.055460, width_at_tau = 0.053765, force_lower = 0.16556, force_at_tau = 1.34730, carried = 0.2810 },
  curved_layered = { width_contact = 0.053960, width_lower = 0.053670, width_at_tau = 0.051272, force_lower = 0.24116, force_at_tau = 3.08765, carried = 0.3529 },
  cylinder = { width_contact = 0.053000, width_lower = 0.052530, width_at_tau = 0.050781, force_lower = 0.11722, force_at_tau = 1.05600, carried = 0.2921 },
  golden_bun = { width_contact = 0.059900, width_lower = 0.059580, width_at_tau = 0.055761, force_lower = 0.16686, force_at_tau = 5.14009, carried = 0.1090 },
  long_roll = { width_contact = 0.043950, width_lower = 0.043360, width_at_tau = 0.041917, force_lower = 0.12093, force_at_tau = 0.65534, carried = 0.9375 },
  oval_loaf = { width_contact = 0.058900, width_lower = 0.058480, width_at_tau = 0.053396, force_lower = 0.19741, force_at_tau = 6.46431, carried = 0.1260 },
  sesame_bun = { width_contact = 0.061900, width_lower = 0.061270, width_at_tau = 0.057714, force_lower = 0.09828, force_at_tau = 1.21270, carried = 0.2988 },
  small_ridged_roll = { width_contact = 0.043850, width_lower = 0.043400, width_at_tau = 0.039772, force_lower = 0.07885, force_at_tau = 2.19098, carried = 0.1522 },
  sphere = { width_contact = 0.056950, width_lower = 0.056460, width_at_tau = 0.053288, force_lower = 0.08856, force_at_tau = 1.47180, carried = 0.2014 },
  spiral_roll = { width_contact = 0.046730, width_lower = 0.046520, width_at_tau = 0.044219, force_lower = 0.09487, force_at_tau = 1.85876, carried = 0.1435 },
  steamed_bun = { width_contact = 0.061950, width_lower = 0.061110, width_at_tau = 0.057440, force_lower = 0.08485, force_at_tau = 0.79782, carried = 0.3758 },
  twisted_stick = { width_contact = 0.030800, width_lower = 0.030310, width_at_tau = 0.027751, force_lower = 0.07220, force_at_tau = 1.03088, carried = 2.6904 },
  wedge = { width_contact = 0.049950, width_lower = 0.049650, width_at_tau = 0.048356, force_lower = 0.12227, force_at_tau = 0.90922, carried = 0.3831 },
  yellow_roll = { width_contact = 0.049950, width_lower = 0.049470, width_at_tau = 0.047520, force_lower = 0.13626, force_at_tau = 1.16328, carried = 0.3990 },
}
