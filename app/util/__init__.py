"""What any program needs: long work in parts, background tasks, caches, the console. Knows no light."""
