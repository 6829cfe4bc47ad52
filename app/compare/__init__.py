"""The solution beside a reference: what its light should be, how far it is from that, and pictures of both."""
