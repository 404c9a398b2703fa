"""Lines and regions of the plane, and triangles that meet."""
