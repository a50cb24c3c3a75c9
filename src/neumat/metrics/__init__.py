"""Distances, set metrics and appearance: pure functions of materials and pictures."""
