"""Subscriber side of `bunraku bridge`: performers that another machine publishes."""
