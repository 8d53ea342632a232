-- Where the collapse and damage strains and the loss factors of the soft assets come from, for docs/assets.md. The
-- values themselves are in the assets. `collapse` and `damage` are the ranges in which the true values are thought to
-- lie.
local crumb = "crumb: cell walls buckle at 0.05–0.15 (1, 2, 5)"
local elastomer = "elastomer foam: 0.05 in theory, 0.05–0.10 in tests (5)"
local sources = {
  assets = {
    spiral_roll = {
      collapse = { 0.05, 0.15 },
      damage = { 0.15, 0.35 },
      class = crumb .. "; middle of the range",
      why = "icing cracks and layers shear before the crumb sets",
    },
    steamed_bun = {
      collapse = { 0.08, 0.15 },
      damage = { 0.28, 0.50 },
      class = crumb .. "; upper half: moist, dense walls (7)",
      why = "most elastic crumb, no crust; texture tests squeeze it to 40–50 % (7, 8)",
    },
    twisted_stick = {
      collapse = { 0.05, 0.15 },
      damage = { 0.08, 0.30 },
      class = crumb .. "; middle of the range",
      why = "thin strands with much crust (9)",
    },
    long_roll = {
      collapse = { 0.05, 0.15 },
      damage = { 0.25, 0.45 },
      class = crumb .. "; middle of the range",
      why = "soft crumb; its slashes may tear (3, 8)",
    },
    small_ridged_roll = {
      collapse = { 0.08, 0.15 },
      damage = { 0.08, 0.25 },
      class = crumb .. "; upper half: firm and dense",
      why = "leathery crust, one day old (9)",
    },
    sesame_bun = {
      collapse = { 0.05, 0.15 },
      damage = { 0.25, 0.45 },
      class = crumb .. "; middle of the range",
      why = "soft crumb with a thin skin, which wrinkles first (3, 8)",
    },
    croissant = {
      collapse = { 0.05, 0.12 },
      damage = { 0.05, 0.18 },
      class = "flaky layers: large thin-walled alveoli, lower half of the crumb's range (10)",
      why = "the flaky shell breaks, alveoli fold and do not reopen (10)",
    },
    curved_layered = {
      collapse = { 0.05, 0.12 },
      damage = { 0.03, 0.12 },
      class = "flaky layers: dry leaves, lower half of the crumb's range (10)",
      why = "dry leaves are a brittle foam; the most fragile (10)",
    },
    braided_roll = {
      collapse = { 0.05, 0.15 },
      damage = { 0.20, 0.40 },
      class = crumb .. "; middle of the range",
      why = "enriched crumb; the glaze cracks and strands part (3, 4)",
    },
    golden_bun = {
      collapse = { 0.05, 0.15 },
      damage = { 0.06, 0.20 },
      class = crumb .. "; middle of the range",
      why = "its thin crisp crust cracks under the pads (9, 10)",
    },
    oval_loaf = {
      collapse = { 0.08, 0.15 },
      damage = { 0.06, 0.20 },
      class = crumb .. "; upper half: firm and dense",
      why = "ridges of its thick crust crack first (9, 10)",
    },
    yellow_roll = {
      collapse = { 0.05, 0.12 },
      damage = { 0.10, 0.30 },
      class = crumb .. "; lower half: sponge with thin walls (6)",
      why = "sponge crumbles earlier than bread, and cream flows out (6)",
    },
    cube = {
      collapse = { 0.05, 0.10 },
      damage = { 0.35, 0.70 },
      class = elastomer .. "; polyurethane",
      why = "sets only near densification or by long holding (5, 11)",
    },
    cylinder = {
      collapse = { 0.05, 0.10 },
      damage = { 0.35, 0.70 },
      class = elastomer .. "; polyurethane",
      why = "the same material as the cube (5, 11)",
    },
    wedge = {
      collapse = { 0.05, 0.10 },
      damage = { 0.35, 0.70 },
      class = elastomer .. "; polyurethane",
      why = "the same material as the cube (5, 11)",
    },
    capsule = {
      collapse = { 0.05, 0.12 },
      damage = { 0.45, 0.75 },
      class = "elastomer foam; upper end of 0.05–0.10: denser silicone with thick walls (5, 12)",
      why = "silicone sets least of all foams (12)",
    },
    sphere = {
      collapse = { 0.05, 0.12 },
      damage = { 0.45, 0.75 },
      class = "elastomer foam; upper end of 0.05–0.10: denser silicone with thick walls (5, 12)",
      why = "silicone sets least of all foams (12)",
    },
  },
  literature = [[
No full paper was read for these values: abstracts, tables and excerpts only. *Remembered* marks what was not checked at all.

1. Scanlon, Sapirstein, Fahloul (2000), *J Cereal Sci* 32:235: white bread crumb, stiffness 11 kPa, strength 1 kPa.
2. Wang, Austin, Bell (2011), *J Cereal Sci* 54:203: bread crumb is one open cell, and its strength follows the laws of foams.
3. Baker, Walker, Kemp (1988), *Cereal Chem* 65:302: crumb is probed at strains of 5 to 30 %.
4. Cornford, Axford, Elton (1964), *Cereal Chem* 41:216: crumb becomes 3 to 6 times stiffer in days (the factor is remembered).
5. Gibson, Ashby (1997), *Cellular Solids* (remembered): elastic collapse at 0.05 (ρ/ρ_s)² E_s, hence at a strain of about 0.05;
   densification at 1 − 1.4 ρ/ρ_s. Bread and soft foam pass the collapse strain daily and recover.
6. *J Home Econ Jpn* 38(12):1063 (1987): sponge cake, elastic modulus 1 to 10 kPa.
7. Lv (2012), master's thesis: 40 to 50 % of compression for the hardness of steamed bread; Raheem, Liu, Li, *Emir J Food Agric*: it is
   more resilient than baked bread.
8. Texture profiles of fresh crumb at 40 to 50 % (many papers, remembered): springiness 0.85 to 0.95.
9. Primo-Martín et al. (2008), *Food Res Int* 41:480; Hirte et al. (2010), *J Cereal Sci* 52:129: crust is crisp only when dry.
10. Mohammed, Charalambides, Williams, Rasburn (2014): dry wafer is a brittle foam that does not recover; walls crack at 1 to 5 % of strain
    (remembered). No modulus or yield strain of puff pastry was found.
11. ASTM D3574, through a test maker's page: flexible polyurethane keeps a set of at most 10 % of a squeeze to one half.
12. A materials catalogue: silicone foam of 240 to 560 kg/m³ keeps a set below 25 % of a squeeze to one half.

Loss factors (tan δ at small strains, 1 to 10 Hz) have three levels; the differences within them are not known.

| material | loss factor | plausible | source |
|---|---:|---|---|
| baked crumb, sponge | 0.20 | 0.10–0.35 | none measured was found: between starch gel (0.05 to 0.2, remembered) and gluten (0.28, 13). Stale crumb loses no less than fresh (14) |
| flaky pastry | 0.15 | 0.05–0.30 | none found; crisp crust about 0.05, moist layers as crumb |
| polyurethane foam | 0.15 | 0.06–0.25 | 0.17 at 1 Hz (15); 0.08 to 0.10 of closed cells (16); rebound of 50 to 60 % (17) gives 0.16 to 0.22 |
| silicone foam | 0.10 | 0.04–0.20 | as the rubber: a beam of silicone in `tests/reference/measured` has 0.107 at 7.7 Hz, 0.116 at 4.3 Hz |
| for comparison: wheat dough | 0.40 | 0.28–0.50 | a power law of exponent 0.27 (13, remembered), 0.1 to 10 Hz |
| gelatin, agar | 0.05 | 0.02–0.3 | G′ ∝ ω^0.02 gives 0.03; other values without a source |
| natural rubber | 0.05–0.10 | 0.02–0.15 | handbook values, frequency not given |

13. Ng, McKinley, Padmanabhan (2006), report HML 06-P-08, and Ng, McKinley (2008), *J Rheol* 52:417 (exponents remembered): dough and gluten
    are critical gels with a broad power law.
14. Persaud, Faubion, Ponte (1990), *Cereal Chem* 67:182: reheating aged crumb reduced its loss tangent to that of fresh crumb.
15. Ge, Rice (2018), *Polymer Testing* 72:187, quoted in public code.
16. Data sheets of Sylodyn ND and NF (Getzner), DIN 53513.
17. Polyurethane Foam Association, *InTouch* 11(1), 2016.
]],
}
return sources
