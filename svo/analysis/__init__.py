"""What can be said before a run: distinguishability, input design, isolability, sets of control, calibration."""
