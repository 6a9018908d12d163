"""The report on a log: a page, and its pictures as files."""
