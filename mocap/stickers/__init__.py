"""Coded stickers: square marks that are found and named by their pattern."""
