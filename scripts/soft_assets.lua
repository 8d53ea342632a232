-- The names of all soft assets, in the order in which pages and tables show them: pastries, then toys.
return {
  "spiral_roll", "steamed_bun", "twisted_stick", "long_roll", "small_ridged_roll", "sesame_bun", "croissant", "curved_layered",
  "braided_roll", "golden_bun", "oval_loaf", "yellow_roll", "cube", "cylinder", "wedge", "capsule", "sphere",
}
