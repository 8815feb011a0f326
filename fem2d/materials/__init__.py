"""Hyperelastic laws: energy, stress and tangent, one law a file, no mesh."""
