-- Closures that a calibration found, by asset: the smallest that holds, and the one that deforms by τ.
-- Written by scripts/calibrate.lua; the experts close in between.
return {
}
