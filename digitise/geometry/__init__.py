"""Geometry of lines and regions in the plane, and of meshes of triangles."""
