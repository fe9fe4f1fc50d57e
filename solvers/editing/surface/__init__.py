"""Cuts surfaces where bones are cut, and joins them where parts are merged."""
