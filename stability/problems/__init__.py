"""Zero problems F(u, lambda) = 0 and the defining systems of their special points."""
