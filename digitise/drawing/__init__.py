"""Exchange drawings with CAD: read the lines of a DXF file, and write a traced crack as DXF."""
