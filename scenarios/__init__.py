"""Drinking scenarios: what a person runs and what a person sees."""
