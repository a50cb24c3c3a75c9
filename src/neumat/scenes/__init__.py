"""Scenes: what materials look like on real shapes in real light, and the cheapest models that a scene needs."""
