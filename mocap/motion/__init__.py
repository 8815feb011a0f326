"""From tracks to rigid motions: scale, pose, smoothing, phases of drinking."""
