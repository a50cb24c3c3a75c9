"""Surfaces whose height and material are pure functions of the position and a seed."""
