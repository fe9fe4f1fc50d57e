"""Where characters come from: files of any kind, and those that ship with Bunraku."""
