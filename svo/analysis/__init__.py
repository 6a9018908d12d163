"""What can be said before anything runs: distinguishability, input design, isolability; and calibration of bounds."""
