"""Renderers: frozen samples for metrics, Mitsuba for people."""
