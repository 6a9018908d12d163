"""Every detector behind one protocol, to be set side by side."""
