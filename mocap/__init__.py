"""From a video to rigid motions of head and package, with their uncertainty."""
