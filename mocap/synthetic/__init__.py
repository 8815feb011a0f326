"""A virtual camera: rendered videos whose motion is known exactly."""
