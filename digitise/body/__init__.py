"""The sample's body: a block less its crack, exact and watertight."""
