"""Pictures that all rooms share: their style, verdicts and bounds over time, and pictures in a page or notebook."""
