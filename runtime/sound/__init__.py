"""Sound that takes carry: kept as PCM, mixed as a function of the session and the time alone."""
