"""Logs: samples of a run, and the files, data frames and columns that hold them."""
