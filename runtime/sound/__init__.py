"""Sound that takes carry: kept as PCM, and mixed for any moment of the session."""
