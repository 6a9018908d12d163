"""The observer that keeps a constrained zonotope."""
