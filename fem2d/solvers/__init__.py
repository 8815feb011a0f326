"""Linear systems, Newton's method, statics, time marching, stability."""
