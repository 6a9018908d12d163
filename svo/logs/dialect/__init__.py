"""Logs as they are: text of any dialect, folders, structures of MAT files, read as a `[log]` table states it.

Cells are text until a stated rule makes numbers of them; every channel is a series of times and values; one grid of the
sampling time takes them all.
"""
