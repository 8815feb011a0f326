"""Studies of a material, the suction test, calibration and the lip press."""
