"""One file per timing profile."""
