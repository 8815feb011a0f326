"""A virtual camera: drawn videos whose motion is known exactly."""
