"""Sections from the user's own files: SVG, DXF, cuts through STL surfaces."""
