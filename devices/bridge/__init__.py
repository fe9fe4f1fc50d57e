"""A performer on another machine: the receiving end of `bunraku bridge`."""
