-- A block of 0.2 kg.
return softvt.asset {
  name = "block",
  shape = softvt.shape.box { size = { 0.045, 0.045, 0.05 } }:grounded(),
  body = softvt.rigid { density = 2000 },
}
