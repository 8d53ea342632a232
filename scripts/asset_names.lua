-- Names of all assets, in the order of pages and tables.
local names = {
  soft = {
    "spiral_roll",
    "steamed_bun",
    "twisted_stick",
    "long_roll",
    "small_ridged_roll",
    "sesame_bun",
    "croissant",
    "curved_layered",
    "braided_roll",
    "golden_bun",
    "oval_loaf",
    "yellow_roll",
    "cube",
    "cylinder",
    "wedge",
    "capsule",
    "sphere",
  },
  rigid = {
    "black_bowl",
    "plate",
    "ramekin",
    "basket",
    "alphabet_soup",
    "tomato_sauce",
    "bbq_sauce",
    "ketchup",
    "salad_dressing",
    "milk",
    "orange_juice",
    "butter",
    "cream_cheese",
    "cookies",
    "chocolate_pudding",
  },
  articulated = { "wooden_cabinet", "flat_stove" },
}

-- True if `found` has an entry for every soft asset.
function names.has_all_soft(found)
  for _, name in ipairs(names.soft) do
    if not found[name] then return false end
  end
  return true
end

return names
