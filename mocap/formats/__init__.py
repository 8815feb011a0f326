"""Marker and motion tables of this program and of others."""
