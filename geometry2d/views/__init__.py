"""Geometry drawn on matplotlib axes."""
