"""From pictures to marker tracks with stated errors."""
