"""What a conversion shows: overlay, chart, summary."""
