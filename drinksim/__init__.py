"""A virtual consumer: how a package opening feels on the lips."""
