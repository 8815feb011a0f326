"""Planar geometry of head and package: rigid motions, outlines, sections, meshes."""
