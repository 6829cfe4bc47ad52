"""Files and procedural scenes, read into triangles, materials and cameras."""
