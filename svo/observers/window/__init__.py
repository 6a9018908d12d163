"""The observer of a window of samples, and the proofs of its falsifications."""
