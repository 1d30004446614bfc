"""What each kind of drive is held against, and what of a motion its joint sees."""
