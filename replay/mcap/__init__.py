"""Read and write Bunraku's own recordings: MCAP files that survive a crash."""
