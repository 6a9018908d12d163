"""A live view of a bank on a log that is still being written."""
