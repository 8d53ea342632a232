-- Results of checks of the calibration, for docs/calibration.md; the commands that gave them are in the text.
return ""
