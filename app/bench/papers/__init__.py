"""The tables of [Coombe03], [Wallner10] and [Kahl22], measured on this machine beside what is published: a file for each."""
