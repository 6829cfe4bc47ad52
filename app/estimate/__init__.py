"""What is known of a solution without any reference: how far off it is, and before the first shot which exposure it will need."""
