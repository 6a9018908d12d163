"""Many runs of a plant: isolation times, thresholds, detectors side by side."""
