"""What several tests need: bodies, clips, runs and models made for them."""
