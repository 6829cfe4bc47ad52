"""Triangles to charts to texels, on the CPU: ``parametrize`` is the whole, ``unwrap`` unfolds what is curved."""
