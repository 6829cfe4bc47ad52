"""What a solution says of itself: how far off it is expected to be, and which exposure it will need."""
