"""The observer that keeps an H-polytope."""
