"""The tables of [Coombe03] and [Wallner10], measured on this machine and beside the published numbers: a file for each table."""
