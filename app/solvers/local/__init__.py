"""Large worlds: a matrix of all reflections among the patches around the observer [Shcherbakov19]."""
