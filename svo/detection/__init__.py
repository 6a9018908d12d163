"""A bank over recorded or live data: detection, verification of its alarms, the watch."""
