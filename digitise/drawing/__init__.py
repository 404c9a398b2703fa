"""Drawings in and out of CAD: the lines of a DXF file, and a traced crack as one."""
