"""Measured and captured BTFs: surfaces, capture, files, representations, synthesis."""
