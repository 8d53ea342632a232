-- A small brick of coarse voxels. Further fields of its material replace the braces.
local material = { youngs_pa = 4e4, poisson = 0.3, density = 300, resolution = 4, grasp_spacing = 0.003 }
for name, value in pairs {} do
  material[name] = value
end
return softvt.asset {
  name = "brick",
  shape = softvt.shape.box({ size = { 0.04, 0.03, 0.024 } }):round(0.003):grounded(),
  body = softvt.soft(material),
}
