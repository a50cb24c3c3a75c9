"""Generative models of materials, under one contract."""
