"""Representations of BTFs, under one contract (`base.Representation`)."""
