"""What can be said before anything runs: distinguishability, input design, isolability, sets of control; calibration."""
