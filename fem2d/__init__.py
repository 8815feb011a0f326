"""Finite elements for soft tissue: hyperelastic materials, frictional contact, time marching."""
