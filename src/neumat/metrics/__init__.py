"""Distances between materials and between sets of materials."""
