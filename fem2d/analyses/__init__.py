"""Answers from one material point or one wave: homogeneous stretch, wrinkling, creasing."""
