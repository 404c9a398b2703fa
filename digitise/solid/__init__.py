"""Build the watertight solid of a sample: a block minus the cavity of its crack."""
